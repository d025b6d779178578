"""Pads of a hand: where its links touch when it closes, with the patches that roll there."""

from graspatlas.pads.find import find_pads
from graspatlas.pads.pad import Pad

__all__ = ["Pad", "find_pads"]
