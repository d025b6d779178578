"""Triangle meshes: reading, repairing, and the smooth normals of a surface that was scanned with noise."""

from graspatlas.meshes.repair import Repair, repaired

__all__ = ["Repair", "repaired"]
