"""Regions of a mesh: smooth parts, each with the simplest patch that fits it."""

from graspatlas.regions.find import find_regions, region_named
from graspatlas.regions.region import Region

__all__ = ["Region", "find_regions", "region_named"]
