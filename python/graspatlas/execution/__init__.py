"""What a controller needs to execute a grasp: contact forces, the squeeze that exerts them, pregrasp and the way in.

The methods of :class:`graspatlas.Grasp` and :class:`graspatlas.Grasps` make these.
"""

from graspatlas.execution.approach import Approach
from graspatlas.execution.contact_forces import ContactForces, ForceOptions
from graspatlas.execution.pregrasp import Pregrasp

__all__ = ["Approach", "ContactForces", "ForceOptions", "Pregrasp"]
