"""Grasps for simulators and controllers: with pregrasp, grasp and squeeze, in the formats that others read."""

from graspatlas.formats.export import FORMATS, export_grasps
from graspatlas.formats.hand_over import HandOver, hand_over

__all__ = ["FORMATS", "HandOver", "export_grasps", "hand_over"]
