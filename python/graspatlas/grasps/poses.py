"""Rigid transforms of grasps: T_a_b is the pose of b in the frame of a, and maps coordinates in b to those in a."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from graspatlas.hand.hand import Hand
from graspatlas.numerics.rotations import quaternions_from_matrices
from graspatlas.support.arrays import Array

if TYPE_CHECKING:
    import pinocchio as pin

__all__ = ["inverse", "poses_by_name", "quaternions", "se3"]


def inverse(T: Array) -> Array:
    """Inverses of rigid transforms [..., 4, 4]."""
    out = np.zeros_like(T)
    out[..., :3, :3] = T[..., :3, :3].swapaxes(-1, -2)
    out[..., :3, 3] = -np.einsum("...ji,...j->...i", T[..., :3, :3], T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def quaternions(T: Array) -> Array:
    """Rotations of transforms [n, 4, 4] as unit quaternions x y z w [n, 4]."""
    return quaternions_from_matrices(T[:, :3, :3])


def se3(T: Array) -> pin.SE3:
    """A transform [4, 4] as Pinocchio has it."""
    import pinocchio as pin  # slow to import

    return pin.SE3(T[:3, :3], T[:3, 3])


def poses_by_name(hand: Hand, q: Array, T_palm_object: Array, frames: Sequence[str]) -> dict[str, Array]:
    """Poses (n, 4, 4) of palm, object and frames of the hand by name; see :meth:`graspatlas.Grasp.poses`.

    Args:
        hand: The hand.
        q: Its joint configurations (n, nq).
        T_palm_object: Poses of the object in the palm's frame (n, 4, 4).
        frames: Links and frames of the hand.

    Raises:
        GraspAtlasError: If the hand has no such frame.
    """
    T_object_palm = inverse(T_palm_object)
    named = {"object_in_palm": T_palm_object, "palm_in_object": T_object_palm}
    wanted = dict.fromkeys(frames)
    for frame in wanted:
        hand.frame(frame)
    places = [hand.link_placements(row) for row in q]
    for frame in wanted:
        T_palm_frame = np.array([place[frame] for place in places]).reshape(-1, 4, 4)
        named[f"{frame}_in_object"] = T_object_palm @ T_palm_frame
    return named
