"""A hand with its pads, and a problem before it is solved: what touches where, and how that is called."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspatlas.hand.hand import Hand
from graspatlas.numerics.rotations import matrix_from_quaternion
from graspatlas.pads.find import closing_of
from graspatlas.pads.pad import Pad
from graspatlas.patches.base import Patch
from graspatlas.problem.contacts import ContactSide
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.viewer.scene.bodies import BodyMeshes, BodyShapes
from graspatlas.viewer.scene.meshes import Mesh, arrow, ellipsoid, smooth
from graspatlas.viewer.scene.scene import COLOURS, Colour, Part, obstacle_parts, vertices_of

__all__ = ["Mark", "Marked", "marked_hand", "marked_problem"]

#: Sizes of points and arrows, as shares of the diagonal of the box round the hand.
BALL, ARROW, SHAFT = 0.008, 0.13, 0.0042
#: How far patches are drawn above the surface that they fit, as such a share.
ABOVE = 0.0015
#: Points along u and v of the mesh of a patch.
STEPS = 25
#: A patch without bounds is drawn to this far from its point, as a share of that diagonal.
CUT = 0.05
#: Hands are drawn open: flexed by this share of their joints' ranges; or by the one of these that comes nearest to
#: touching, where nothing says how the hand is held.
OPEN = 0.2
SHARES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
#: The bodies are lighter than in other pictures, so that what is drawn on them stands out: share of white.
WHITE = 0.45
#: Directions from which a hand may be seen: round z, and above the horizon [rad].
AZIMUTHS, ELEVATIONS = np.radians(np.arange(0.0, 360.0, 15.0)), np.radians([8.0, 28.0, 50.0])
#: A mark whose normal points away from the camera by more than this cosine is hardly seen.
TURNED_AWAY = -0.2
#: What a mark counts that something hides.
HIDDEN = 0.35
#: A second view is turned from the first by at least this [rad].
TURNED = np.radians(70.0)


@dataclass(frozen=True, eq=False)
class Mark:
    """A place that is named.

    Attributes:
        point: Where (3,), metres.
        normal: Outward normal there (3,).
        name: What it is called.
        detail: What else is said of it.
    """

    point: Array
    normal: Array
    name: str
    detail: str = ""


@dataclass(frozen=True, eq=False)
class Marked:
    """Meshes, and the places on them that are named.

    Attributes:
        title: What is shown.
        parts: The meshes.
        marks: The places.
        legend: Colours and what they stand for.
    """

    title: str
    parts: tuple[Part, ...]
    marks: tuple[Mark, ...]
    legend: tuple[tuple[Colour, str], ...]

    @property
    def points(self) -> Array:
        """What must be in a picture (n, 3)."""
        groups = tuple({part.group for part in self.parts})
        return vertices_of(list(self.parts), groups)

    def directions(self) -> tuple[Array, Array]:
        """Unit vectors (3,) towards two cameras: the one that sees most of the marks, and one that sees the others."""
        views = np.array(
            [[np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)] for e in ELEVATIONS for a in AZIMUTHS]
        )
        seen = np.array([self._clear(mark, views) for mark in self.marks]).reshape(-1, len(views)).T
        first = int(np.argmax(seen.sum(axis=1)))
        flat = np.array([view / np.linalg.norm(view[:2]) * [1.0, 1.0, 0.0] for view in views])
        away = flat @ flat[first] <= np.cos(TURNED)
        both = np.maximum(seen, seen[first]).sum(axis=1) + 0.25 * seen.sum(axis=1)
        return views[first], views[int(np.argmax(np.where(away, both, -np.inf)))]

    def _clear(self, mark: Mark, views: Array) -> Array:
        """How well a mark is seen in each view: its face and the length of its normal, and that nothing is before it.

        Args:
            mark: The mark.
            views: Unit vectors towards cameras (v, 3).
        """
        facing = views @ mark.normal
        gaps = self._cloud - (mark.point + 0.02 * self._size * mark.normal)
        along = gaps @ views.T
        aside_squared = (gaps**2).sum(axis=1)[:, None] - along**2
        hidden = ((along > 0.02 * self._size) & (aside_squared < (0.012 * self._size) ** 2)).any(axis=0)
        seen = np.maximum(facing, 0.0) + np.sqrt(np.maximum(1.0 - facing**2, 0.0))
        return np.where(facing > TURNED_AWAY, seen, 0.2) * np.where(hidden, HIDDEN, 1.0)

    @cached_property
    def _cloud(self) -> Array:
        return vertices_of(list(self.parts))[::3]

    @cached_property
    def _size(self) -> float:
        return float(np.linalg.norm(np.ptp(self._cloud, axis=0)))


def marked_hand(hand: Hand, pads: Sequence[Pad]) -> Marked:
    """A hand that is nearly open, with its pads, their normals and names."""
    placements = hand.link_placements(hand.configuration(closing_of(hand).posture(OPEN)))
    parts = [Part("hand", mesh, T, _lighter(colour)) for mesh, T, colour in BodyMeshes(hand).on_links(placements)]
    size = _size_of(parts)
    marks = []
    for pad in pads:
        T = placements[pad.frame]
        what = f"{pad.patch.kind}, error {1e3 * pad.error:.2f} mm"
        marks.append(Mark(_moved(T, pad.position), T[:3, :3] @ pad.normal, pad.frame, what))
        parts += _sheet(pad.patch, T, size)
        parts += _needle(marks[-1], size, "normal")
    legend = ((COLOURS["pad"], "pad"), (COLOURS["contact"], "its point"), (COLOURS["normal"], "outward normal"))
    return Marked(f"{hand.name}: {len(pads)} pads", tuple(parts), tuple(marks), legend)


def marked_problem(problem: Problem, shapes: BodyShapes | None = None) -> Marked:
    """A problem before it is solved: hand and object at x1, or at the reference and the pose guess.

    Args:
        problem: The problem.
        shapes: Its meshes, where they have been read.
    """
    q, T_object, where = _setup(problem)
    placements = problem.hand.link_placements(q)
    shapes = shapes or BodyShapes(problem)
    parts = [Part("hand", mesh, T, _lighter(colour)) for mesh, T, colour in shapes.hand(q)]
    size = _size_of(parts)
    for mesh, T, colour in shapes.object():
        parts.append(Part("object", mesh, T_object @ T, (*_lighter(colour)[:3], min(colour[3], 0.55))))
    parts += obstacle_parts(shapes, T_object)
    marks = []
    for number, contact in enumerate(problem.contacts):
        T = placements[contact.frame]
        mark, other = _touching(problem, number, T, T_object)
        parts += [*_sheet(contact.hand, T, size), *_needle(mark, size, "normal")]
        parts += _needle(other, size, "object normal")
        marks.append(mark)
    legend = (
        *([(COLOURS["pad"], "patch of the hand")] if any(part.group == "pad" for part in parts) else []),
        (COLOURS["contact"], "contact points"),
        (COLOURS["normal"], "normal out of the hand"),
        (COLOURS["object normal"], "out of the object"),
    )
    return Marked(f"{problem.name}: {where}", tuple(parts), tuple(marks), legend)


def _touching(problem: Problem, number: int, T_hand: Array, T_object: Array) -> tuple[Mark, Mark]:
    """The points of hand and object at a contact: those of x1, or the middle of the patch and what is nearest to it."""
    contact = problem.contacts[number]
    name, detail = f"{number + 1}  {contact.frame}", f"{contact.hand.kind} on {contact.object.kind}"
    if problem.x1 is not None:
        arrays = problem.full_system.grasp_arrays(problem.x1_array[None])
        on_hand, on_object = (
            [np.asarray(arrays[f"{side}_{what}"])[0, number] for what in ("points", "normals")]
            for side in ("hand", "object")
        )
        return Mark(on_hand[0], on_hand[1], name, detail), Mark(on_object[0], on_object[1], "")
    mark = _mark(contact.sides[0], T_hand, name, detail)
    near = np.linalg.inv(T_object) @ [*mark.point, 1.0]
    return mark, _mark(contact.sides[1], T_object, "", "", near[:3])


def _setup(problem: Problem) -> tuple[Array, Array, str]:
    """Configuration of the hand, placement of the object (4, 4), and what these are."""
    nq = problem.hand.model.hand_q_size
    if problem.x1 is not None:
        x1 = problem.x1
        T = _pose(x1.object_xyz, x1.object_quat_xyzw)
        return problem.x1_array[:nq], T, "at x1"
    closing = closing_of(problem.hand)
    if problem.reference is not None:
        posture = {**closing.posture(OPEN), **problem.reference}
        what, postures = "the hand at its reference", [problem.hand.mechanism.completed(posture, "the reference")]
    else:
        what, postures = "before it is solved", [closing.posture(share) for share in SHARES]
    configurations = [problem.hand.configuration(posture) for posture in postures]
    if problem.pose_guess is not None:
        guess = problem.pose_guess
        T = _pose(guess.xyz, guess.quat_xyzw or (0.0, 0.0, 0.0, 1.0))
        q = min(configurations, key=lambda q: _gap(problem, q, T))
        return q, T, f"{what}, the object at the pose guess"
    q = configurations[len(configurations) // 2]
    placements = problem.hand.link_placements(q)
    on_hand = [_mark(c.sides[0], placements[c.frame], "", "").point for c in problem.contacts]
    on_object = [_mark(c.sides[1], np.eye(4), "", "").point for c in problem.contacts]
    T = np.eye(4)
    T[:3, 3] = np.mean(on_hand, axis=0) - np.mean(on_object, axis=0)
    return q, T, f"{what}, the object anywhere between the fingers (no x1, no pose_guess)"


def _gap(problem: Problem, q: Array, T_object: Array) -> float:
    """How far hand and object are from touching at the contacts, at a configuration of the hand [m]."""
    placements = problem.hand.link_placements(q)
    marks = [_touching(problem, i, placements[c.frame], T_object) for i, c in enumerate(problem.contacts)]
    return float(sum(np.linalg.norm(a.point - b.point) for a, b in marks))


def _pose(xyz: Sequence[float], quaternion: Sequence[float]) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = matrix_from_quaternion(quaternion), xyz
    return T


def _mark(side: ContactSide, T: Array, name: str, detail: str, near: Array | None = None) -> Mark:
    """The point of one side of a contact: where its free parameters are nearest to a point, or in their middle."""
    patch = side.patch
    located = dict(zip("uv", patch.locate(near), strict=True)) if near is not None else {}
    values = {}
    for parameter in patch.parameters:
        low, high = patch.interval(parameter) or (-np.pi, np.pi)
        middle = 0.5 * (low + high) if np.isfinite(high - low) else 0.0
        free = float(np.clip(located.get(parameter, middle), low, high))
        values[parameter] = side.frozen.get(parameter, free)
    u, v = values.get("u", 0.0), values.get("v", 0.0)
    return Mark(_moved(T, patch.point(u, v)), T[:3, :3] @ patch.normal_at(u, v), name, detail)


def _needle(mark: Mark, size: float, group: str) -> Iterable[Part]:
    """A point and its normal."""
    T = np.eye(4)
    T[:3, 3] = mark.point
    yield Part("contact", ellipsoid(np.full(3, BALL * size), 20), T, COLOURS["contact"])
    yield Part(group, arrow(mark.point, mark.normal, ARROW * size, SHAFT * size), np.eye(4), COLOURS[group])


def _sheet(patch: Patch, T: Array, size: float) -> Iterable[Part]:
    """The surface of a patch of the hand."""
    if len(patch.parameters) < 2:
        return
    cut, ranges = CUT * size, []
    for parameter in patch.parameters:
        low, high = patch.interval(parameter) or (-np.pi, np.pi)
        low, high = (-cut if np.isinf(low) else low), (cut if np.isinf(high) else high)
        ranges.append(np.linspace(low, high, STEPS))
    grid = [(u, v) for u in ranges[0] for v in ranges[1]]
    points = np.array([patch.point(u, v) for u, v in grid])
    normals = np.array([patch.normal_at(u, v) for u, v in grid])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(STEPS - 1), np.arange(STEPS - 1), indexing="ij"))
    a, b = i * STEPS + j, (i + 1) * STEPS + j
    faces = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    mesh = smooth(points + ABOVE * size * normals, faces)
    if mesh.normals.mean(axis=0) @ normals.mean(axis=0) < 0.0:
        mesh = Mesh(mesh.vertices, -mesh.normals, mesh.faces[:, ::-1])
    yield Part("pad", mesh, T, COLOURS["pad"])


def _lighter(colour: Colour) -> Colour:
    red, green, blue = (WHITE + (1.0 - WHITE) * part for part in colour[:3])
    return red, green, blue, colour[3]


def _size_of(parts: Sequence[Part]) -> float:
    return float(np.linalg.norm(np.ptp(vertices_of(list(parts)), axis=0)))


def _moved(T: Array, point: Iterable[float]) -> Array:
    return np.asarray(T[:3, :3] @ np.asarray(list(point), float) + T[:3, 3])
