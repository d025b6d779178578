"""The film of a path: hand, object and contacts at its points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.paths.path import GraspPath, Path
from graspatlas.support.arrays import Array, IntArray
from graspatlas.viewer.films.animation import MAX_FRAMES, Film, Readout, evenly_chosen
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.captions import index_name, legend, path_text
from graspatlas.viewer.scene.meshes import arrow, ellipsoid, frame_along
from graspatlas.viewer.scene.scene import (
    COLOURS,
    CONTACT_RADIUS,
    NORMAL_LENGTH,
    NORMAL_RADIUS,
    Part,
    body_parts,
    direction_to,
    size_of,
    subject_of,
)

__all__ = ["path_film"]

#: Time that playing takes [s]: so much for each unit of length, at least and at most.
SECONDS_A_UNIT, LEAST_SECONDS, MOST_SECONDS = 3.0, 3.0, 15.0


def path_film(path: Path, frames: int = MAX_FRAMES) -> Film:
    """Hand, object, contact points and normals at points of a path; each part is one mesh that moves.

    Args:
        path: The path.
        frames: Largest number of frames.

    Raises:
        GraspAtlasError: If the path is not one of grasps, or a mesh of the hand or the object cannot be read.
    """
    if not isinstance(path, GraspPath):
        raise GraspAtlasError("this path is not one of grasps, so there is no hand to show; plot path.x instead")
    points = evenly_chosen(len(path), frames)
    grasps = [path.grasps[int(i)] for i in points]
    shapes = BodyShapes(path.result.problem)
    shots = [body_parts(shapes, grasp) for grasp in grasps]
    size = size_of(shots[0])
    parts = shots[0] + _marks(grasps[0], size)
    S = np.diag([1.0 / size, 1.0 / size, 1.0 / size, 1.0])
    T = S @ np.array([[p.T for p in shot] + _mark_placements(grasp) for shot, grasp in zip(shots, grasps, strict=True)])
    subjects = [subject_of(shots[i] + _marks(grasps[i], size), size) for i in (0, -1)]
    arc_lengths = path.arc_length[points]
    return Film(
        name=path.result.problem.name,
        text=path_text(path),
        frames=points,
        parts=tuple(replace(part, T=T) for part, T in zip(parts, T[0], strict=True)),
        T=T,
        direction=direction_to(subjects, path.result.problem.object_joint_model),
        readouts=_readouts(path, points),
        curve=np.column_stack([arc_lengths, path.qualities[points]]) if path.knows_quality else None,
        seconds=float(np.clip(SECONDS_A_UNIT * path.length, LEAST_SECONDS, MOST_SECONDS)),
        legend=tuple(legend()[:2]),
        course="along the path",
    )


def _readouts(path: GraspPath, points: IntArray) -> tuple[Readout, ...]:
    """What is written below the grasps at some points."""
    breaks = np.zeros(len(path), bool)
    if path.result.requirements and path.knows_requirements:
        breaks = ~path.accepted
    found = []
    for i in points:
        number = f"point {i} of {len(path) - 1}"
        name = {0: "start", len(path) - 1: "end"}.get(int(i), f"point {i}")
        length = f"{path.arc_length[i]:.3f} of {path.length:.3f}"
        value = f"{index_name(path.result)} {path.qualities[i]:.3g}" if path.knows_quality else ""
        details = f"arc length {length}, {number}" if value else f"arc length {length}"
        place = f"{name}, at {path.arc_length[i]:.2f} of {path.length:.2f}"
        found.append(Readout(place, value or number, details, "breaks a requirement" if breaks[i] else ""))
    return tuple(found)


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
