"""Hand and object made ready: what a hand's file leaves out, a mesh repaired and written, and the assignments."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspatlas.collision.always_touching import with_touching_links_allowed
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.named_hands import NamedHand
from graspatlas.meshes.repair import repaired
from graspatlas.problem.validation import check_obstacles
from graspatlas.proposals.assignments.fingers import grips
from graspatlas.proposals.assignments.matching import Assignment, Counts, assignments_of
from graspatlas.proposals.assignments.planes import Planes
from graspatlas.proposals.assignments.symmetry import region_symmetries
from graspatlas.proposals.files import write_text
from graspatlas.proposals.object_files import write_object
from graspatlas.regions.find import find_regions
from graspatlas.regions.region import Region
from graspatlas.support.arrays import Array
from graspatlas.world.obstacle import Obstacle

if TYPE_CHECKING:
    import trimesh

__all__ = ["Setting", "made_ready"]


@dataclass(frozen=True, eq=False)
class Setting:
    """A hand and an object, and what could touch what.

    Attributes:
        hand: Name of the hand.
        source: How a problem file names the hand: ``{"urdf": path}`` and so on.
        body: The object.
        surface: SHA-256 of its repaired surface.
        regions: Its regions, the largest first.
        assignments: The assignments, the most promising first.
        counts: How many there were, and why some were left out.
        obstacles: What the hand must not touch beside the object.
        notes: What a user should know of hand and object, one sentence each.
    """

    hand: str
    source: dict[str, str]
    body: Body
    surface: str
    regions: tuple[Region, ...]
    assignments: list[Assignment]
    counts: Counts
    obstacles: tuple[Obstacle, ...]
    notes: tuple[str, ...]


def made_ready(
    named: NamedHand,
    mesh: Path,
    folder: Path,
    *,
    scale: float | None,
    fingers: int | None,
    links: Sequence[str] | None,
    obstacles: tuple[Obstacle, ...],
    on_table: bool,
    seed: int,
) -> Setting:
    """Read hand and mesh, write the object, and find the assignments.

    Args:
        named: The hand.
        mesh: Mesh file.
        folder: Where ``object.urdf`` and ``hand.srdf`` are written.
        scale: From the mesh's unit to metres; None where it is metres, which is doubted where it looks like others.
        fingers: How many fingertips touch; three by default, or all where there are fewer.
        links: Links that may touch; the fingertips by default.
        obstacles: What the hand must not touch beside the object.
        on_table: Whether the object stands on a table.
        seed: Of the random numbers.

    Raises:
        GraspAtlasError: If they cannot be read, or no posture could hold the object.
    """
    hand, touching = with_touching_links_allowed(named.hand)
    notes = []
    if touching:
        pairs = ", ".join(f"{a} and {b}" for a, b in touching)
        notes.append(f"links of the hand that touch in all postures are let: {pairs}; an SRDF would say which may")
    if hand.srdf:
        write_text(hand.srdf, folder / "hand.srdf")
    fixed, report = repaired(mesh, scale=1.0 if scale is None else scale)
    if scale is None and report.unit_doubt():
        raise GraspAtlasError(report.unit_doubt())
    notes.append(f"the mesh: {report}")
    regions = find_regions(fixed, scale=1.0)
    body, note = write_object(fixed, mesh.stem, folder)
    notes.append(note)
    if on_table:
        obstacles = (*obstacles, _table_below(fixed))
        check_obstacles(obstacles)
    planes = Planes.of(obstacles)
    symmetries = region_symmetries(regions, _keeps(obstacles, planes))
    assignments, counts = assignments_of(
        grips(hand, fingers, links), regions, symmetries, planes, np.random.default_rng(seed)
    )
    if not assignments:
        raise GraspAtlasError(
            f"no posture of hand '{hand.name}' could hold '{mesh.name}' by its fingertips ({counts}): check that its "
            "size fits the hand, or name other links, such as the palm"
        )
    return Setting(
        hand.name,
        dict(named.source),
        body,
        _digest(fixed),
        tuple(regions),
        assignments,
        counts,
        obstacles,
        tuple(notes),
    )


def _table_below(mesh: trimesh.Trimesh) -> Obstacle:
    """The table that an object stands on, z being upwards."""
    (x, y, _), lowest = mesh.bounds.mean(axis=0), mesh.bounds[0, 2]
    return Obstacle.plane("table", (float(x), float(y), float(lowest)))


def _keeps(obstacles: Sequence[Obstacle], planes: Planes) -> Callable[[Array], bool]:
    """Whether a rotation of the object leaves the obstacles that are fixed to it where they are, as far as known."""
    bodies = any(each.frame == "object" and each.body is not None for each in obstacles)
    return (lambda turn: False) if bodies else planes.kept_by


def _digest(mesh: trimesh.Trimesh) -> str:
    """SHA-256 of the vertices and faces of a mesh."""
    arrays = np.asarray(mesh.vertices, "<f8"), np.asarray(mesh.faces, "<i8")
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()
