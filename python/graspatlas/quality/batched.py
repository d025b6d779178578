"""Your own quality index: any function of one :class:`~graspatlas.grasps.Grasp` that returns a finite number.

One that takes a whole :class:`~graspatlas.grasps.Grasps` batch and returns an array (n,) is marked by :func:`batched`.
It cannot write to the arrays that it gets::

    @ga.batched
    def spread(grasps):
        points = grasps.contact_points                      # (n, m, 3)
        return np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).min(axis=1)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import SupportsFloat, TypeVar

from numpy.typing import ArrayLike

from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps

__all__ = ["Quality", "batched", "quality_name"]

#: A quality index: the name of one of the package's, a function of one grasp, or one of a batch of grasps that
#: :func:`graspatlas.batched` marks.
Quality = str | Callable[[Grasp], SupportsFloat] | Callable[[Grasps], ArrayLike]
F = TypeVar("F", bound=Callable[..., object])


def batched(index: F) -> F:
    """Mark a quality index, or a requirement, as one that takes a :class:`Grasps` batch and returns an array (n,).

    Args:
        index: A function of grasps.

    Returns:
        The function itself, marked by an attribute ``batched``.
    """
    setattr(index, "batched", True)  # noqa: B010  (functions have no such attribute by their type)
    return index


def quality_name(quality: Quality) -> str:
    """The name of an index."""
    return quality if isinstance(quality, str) else getattr(quality, "__name__", type(quality).__name__)
