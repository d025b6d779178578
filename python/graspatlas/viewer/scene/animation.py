"""What the viewers show of a path: hand, object and contacts at its points, seen from one direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasp
from graspatlas.paths.path import GraspPath, Path
from graspatlas.support.arrays import Array, IntArray
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.meshes import arrow, ellipsoid, frame_along
from graspatlas.viewer.scene.scene import (
    COLOURS,
    CONTACT_RADIUS,
    NORMAL_LENGTH,
    NORMAL_RADIUS,
    Part,
    body_parts,
    direction_to,
    fitted_camera,
    size_of,
    subject_of,
    vertices_of,
)

__all__ = ["Film"]

#: Most frames of a film; of a path with more points, so many are shown, evenly chosen.
MAX_FRAMES = 300
#: Frames by which the camera is placed.
LOOKS = 6
#: A part that moves and turns less than this stands still.
STILL = 1e-9


class Film:
    """Hand, object, contact points and normals at points of a path; each part is one mesh that moves.

    Args:
        path: The path.
        frames: Largest number of frames.

    Raises:
        GraspAtlasError: If the path is not one of grasps, or a mesh of the hand or the object cannot be read.
    """

    def __init__(self, path: Path, frames: int = MAX_FRAMES) -> None:
        if not isinstance(path, GraspPath):
            raise GraspAtlasError("this path is not one of grasps, so there is no hand to show; plot path.x instead")
        self.path = path
        #: Points of the path that are shown (f,).
        self.points = _evenly_chosen(len(path), frames)
        grasps = [path.grasps[int(i)] for i in self.points]
        shapes = BodyShapes(path.result.problem)
        shots = [body_parts(shapes, grasp) for grasp in grasps]
        size = size_of(shots[0])
        parts = shots[0] + _marks(grasps[0], size)
        S = np.diag([1.0 / size, 1.0 / size, 1.0 / size, 1.0])
        #: Placement of each part in each frame, scaled to the usual size (f, parts, 4, 4).
        self.T: Array = S @ np.array(
            [[p.T for p in shot] + _mark_placements(grasp) for shot, grasp in zip(shots, grasps, strict=True)]
        )
        #: Each part as in the first frame.
        self.parts = tuple(replace(part, T=T) for part, T in zip(parts, self.T[0], strict=True))
        #: Which parts move (parts,).
        self.moving = (np.ptp(self.T, axis=0) > STILL).any(axis=(1, 2))
        subjects = [subject_of(shots[i] + _marks(grasps[i], size), grasps[i], size) for i in (0, -1)]
        #: Unit vector to the camera (3,).
        self.direction = direction_to(subjects, path.result.problem.object_joint_model)

    def __len__(self) -> int:
        return len(self.points)

    def frame(self, i: int) -> list[Part]:
        """The parts of a frame, placed in the world."""
        return [replace(part, T=T) for part, T in zip(self.parts, self.T[i], strict=True)]

    def camera(self, aspect: float, window: tuple[float, float, float, float]) -> Camera:
        """Camera that shows all frames inside a window of its picture; see :meth:`Scene.camera`."""
        points = np.concatenate([vertices_of(self.frame(int(i))) for i in _evenly_chosen(len(self), LOOKS)])
        return fitted_camera(points, self.direction, aspect, window)


def _evenly_chosen(n: int, most: int) -> IntArray:
    """The first and the last of n, and others between, at most so many."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))


def _marks(grasp: Grasp, size: float) -> list[Part]:
    """A ball and an arrow for each contact, in the palm's frame."""
    ball = ellipsoid(np.full(3, size * CONTACT_RADIUS), 24)
    needle = arrow(np.zeros(3), np.array([0.0, 0.0, 1.0]), size * NORMAL_LENGTH, size * NORMAL_RADIUS)
    shapes = [("contact", ball), ("normal", needle)] * len(grasp.contact_points)
    return [
        Part(group, mesh, T, COLOURS[group]) for (group, mesh), T in zip(shapes, _mark_placements(grasp), strict=True)
    ]


def _mark_placements(grasp: Grasp) -> list[Array]:
    """Placements of the balls and arrows (4, 4), in the order of :func:`_marks`."""
    placements = []
    for point, normal in zip(grasp.contact_points, grasp.contact_normals, strict=True):
        T = np.eye(4)
        T[:3, 3] = point
        placements += [T, frame_along(normal, point)]
    return placements
