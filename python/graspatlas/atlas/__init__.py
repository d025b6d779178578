"""The atlas of charts that covers a manifold of feasible grasps: growth, checkpoints, coverage."""

from graspatlas.atlas.atlas import BOX_TAG, Atlas
from graspatlas.atlas.status import Audit, Closed, Status

__all__ = [
    "BOX_TAG",
    "Atlas",
    "Audit",
    "Closed",
    "Status",
]
