"""What a controller needs to execute a grasp: contact forces and joint torques, and the squeeze that exerts them."""

from graspatlas.execution.contact_forces import ContactForces, ForceOptions, contact_forces
from graspatlas.execution.squeeze import squeeze

__all__ = ["ContactForces", "ForceOptions", "contact_forces", "squeeze"]
