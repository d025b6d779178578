"""The pads of a hand: which links, in which direction, and where on them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from graspatlas import _core
from graspatlas.collision.shapes import Shape, read_shapes
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.embedded_meshes import mesh_folders
from graspatlas.hand.hand import Hand
from graspatlas.hand.mesh_files import check_meshes
from graspatlas.pads.closing import Closing
from graspatlas.pads.dome import fit_dome
from graspatlas.pads.pad import Pad
from graspatlas.pads.reach import Dome
from graspatlas.pads.surface import bounding_points, frame_along, look
from graspatlas.support.arrays import Array
from graspatlas.support.validation import checked_instance

__all__ = ["closing_of", "find_pads"]

#: Rays along each side of the square through which a link is looked at as a whole.
RAYS = 96
#: What comes within this share of the link's width of its outermost point in the closing direction is its front.
FRONT = 0.03
#: The largest patch reaches this share of the link's width to each side.
LARGEST = 0.45
#: A fingertip is the part of its link beyond this share of the way from the joint to the end.
TIP = 0.55
#: A fingertip whose patch is smaller than this share of its width has an edge there.
NARROW = 0.12
#: How often the closing direction of the point that is found is asked again.
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class _Body:
    """What one joint carries, or the palm.

    Attributes:
        shapes: Its shapes, in the joint's frame.
        frame: The link in whose coordinates its pad is wanted; by default the one that the pad lies on.
    """

    shapes: tuple[Shape, ...]
    frame: str = ""

    @cached_property
    def width(self) -> float:
        """How wide the body is, being longer one way and perhaps thinner another [m]."""
        return float(np.sort(np.ptp(self.corners, axis=0))[1])

    @cached_property
    def corners(self) -> Array:
        """Points (n, 3) whose bounding box holds all shapes, metres."""
        return np.concatenate([bounding_points(shape) for shape in self.shapes])


@dataclass(frozen=True, eq=False)
class _Place:
    """A link, and a patch on it in its coordinates."""

    link: str
    dome: Dome


def find_pads(hand: Hand, links: Sequence[str] | None = None) -> tuple[Pad, ...]:
    """Where the links of a hand touch when it closes, and the patches that roll there.

    The direction in which a link closes follows from the kinematics: joints with axes parallel to that of its finger's
    last one flex, to the side on which the finger's end comes nearer to its beginning and to the other fingers. The
    middle of a fingertip's pad is where a plate that it closes against would touch its collision shape first, or its
    visual shape where it has no other; that of a phalanx is in the middle of the side to which it closes, and the
    palm's on the way from between the fingertips to its middle.

    Args:
        hand: The hand.
        links: Names of the links to look at, palm and phalanges too; by default the fingertips, the links whose joints
            move no other. A link without a shape, such as a mere frame, stands for all that its joint carries.

    Returns:
        The pads, in the order of the links or of the hand's joints.

    Raises:
        GraspAtlasError: If there is no such link, a link that is named has no shape or no smooth place to touch, or no
            fingertip has one. Fingertips without one beside others are left out, with a ``RuntimeWarning``.
    """
    checked_instance(hand, Hand, "hand")
    bodies = _bodies(hand)
    closing = _closing(hand, bodies)
    if links is None:
        tips = [number for number in closing.fingertips if number in bodies]
        if not tips:
            raise GraspAtlasError(f"no fingertip of hand '{hand.name}' has a shape; name links that have some")
        return _fingertips(hand, closing, {number: bodies[number] for number in tips})
    return tuple(_pad_of(hand, closing, bodies, link) for link in links)


def _fingertips(hand: Hand, closing: Closing, bodies: Mapping[int, _Body]) -> tuple[Pad, ...]:
    """The pads of fingertips; those that have no place for one are left out, with a warning."""
    pads, faults = [], []
    for number, body in bodies.items():
        try:
            pads.append(_fingertip(closing, body, number))
        except GraspAtlasError as error:
            faults.append((body.shapes[0].link, error))
    if not pads:
        raise faults[0][1]
    if faults:
        links = ", ".join(f"'{link}'" for link, _ in faults[:5]) + (" and more" if len(faults) > 5 else "")
        what = f"no smooth place to touch on {links} of hand '{hand.name}': left out"
        warnings.warn(what, RuntimeWarning, stacklevel=3)
    return tuple(pads)


def closing_of(hand: Hand) -> Closing:
    """How a hand closes; it has postures of the hand that is open, or flexed by any share of its joints' ranges."""
    return _closing(hand, _bodies(hand))


def _closing(hand: Hand, bodies: dict[int, _Body]) -> Closing:
    return Closing(hand, {number: _end(body) for number, body in bodies.items()})


def _bodies(hand: Hand) -> dict[int, _Body]:
    """The shapes of each joint, collision shapes where it has some; the palm is 0."""
    check_meshes(hand)
    collision = read_shapes(hand.tree, hand.urdf, mesh_folders(hand))
    by_joint: dict[int, list[Shape]] = {}
    for shape in collision:
        by_joint.setdefault(shape.joint, []).append(shape)
    missing = {joint.number for joint in Closing(hand, {}).joints.values()} | {0}
    missing -= set(by_joint)
    if missing:
        for shape in _visual_shapes(hand):
            if shape.joint in missing:
                by_joint.setdefault(shape.joint, []).append(shape)
    return {number: _Body(tuple(shapes)) for number, shapes in by_joint.items()}


def _visual_shapes(hand: Hand) -> list[Shape]:
    known = ("kind", "sizes", "points", "triangles", "name", "link", "joint", "parent_joint", "placement")
    tables = _core.read_visual_shapes(hand.tree, hand.urdf, list(mesh_folders(hand)))
    return [Shape(**{name: table[name] for name in known}) for table in tables]


def _end(body: _Body) -> Array:
    """Where a link ends: the middle of what is farthest from its joint (3,), metres."""
    corners = body.corners
    distances = np.linalg.norm(corners, axis=1)
    return np.asarray(corners[distances >= 0.9 * distances.max()].mean(axis=0))


def _pad_of(hand: Hand, closing: Closing, bodies: dict[int, _Body], link: str) -> Pad:
    """The pad of a link that the user names."""
    number, _ = hand.frame(link)
    body = bodies.get(number)
    if body is None:
        raise unknown_name("link", link, _links(bodies), f"one with a shape in hand '{hand.name}'")
    own = tuple(shape for shape in body.shapes if shape.link == link)
    body = _Body(own or body.shapes, link)
    if number == 0:
        return _palm(closing, body, {n: _end(b) for n, b in bodies.items()})
    if number in closing.fingertips:
        return _fingertip(closing, body, number)
    return _phalanx(closing, body, number)


def _links(bodies: dict[int, _Body]) -> list[str]:
    return sorted({shape.link for body in bodies.values() for shape in body.shapes})


def _fingertip(closing: Closing, body: _Body, number: int) -> Pad:
    """The pad at the front of a link where its finger closes, or where its last joint does if that is an edge."""
    best: _Place | None = None
    for last in (False, True):
        point, direction = _end(body), np.zeros(3)
        for _ in range(ROUNDS):
            direction = closing.direction(number, _beneath(body, point, direction), last=last)
            point = _front(body, direction, turns=not closing.joints[number].slides)
        place = _dome(closing, body, number, point, direction)
        if place is not None and (best is None or place.dome.half > best.dome.half):
            best = place
        if best is not None and best.dome.half > NARROW * body.width:
            break
    return _pad(closing, body, best)


def _phalanx(closing: Closing, body: _Body, number: int) -> Pad:
    """The pad in the middle of a link's side to which it closes."""
    low, high = body.corners.min(axis=0), body.corners.max(axis=0)
    middle = 0.5 * (low + high)
    direction = closing.direction(number, middle, last=True)
    return _pad(closing, body, _dome(closing, body, number, middle, direction))


def _palm(closing: Closing, body: _Body, ends: dict[int, Array]) -> Pad:
    """The pad of the palm, on the way from between the fingertips to its middle."""
    rest = closing.middle
    tips = [closing.placement(n, rest) for n in closing.fingertips]
    reached = [T[:3, :3] @ ends[n] + T[:3, 3] for T, n in zip(tips, closing.fingertips, strict=True) if n in ends]
    middle = 0.5 * (body.corners.min(axis=0) + body.corners.max(axis=0))
    direction = np.mean(reached, axis=0) - middle
    direction = direction / np.linalg.norm(direction)
    return _pad(closing, body, _dome(closing, body, 0, middle, direction))


def _front(body: _Body, direction: Array, turns: bool) -> Array:
    """The middle of what of a body is foremost in a direction (3,), metres.

    Args:
        body: The body.
        direction: The direction (3,).
        turns: Whether its joint turns it; then it is looked at away from the joint only.
    """
    T, xs, ys, width = _window(body, direction)
    heights = look(body.shapes, T, xs, ys).heights
    points = np.stack([*np.meshgrid(xs, ys, indexing="ij"), heights], axis=-1) @ T[:3, :3].T
    if turns:
        along = points @ _end(body)
        heights = np.where(along >= TIP * np.nanmax(along), heights, np.nan)
    near = np.maximum(heights - (np.nanmax(heights) - FRONT * width), 0.0)
    near = np.where(np.isnan(near), 0.0, near)[..., None]
    return np.asarray((near * np.nan_to_num(points)).sum(axis=(0, 1)) / near.sum())


def _beneath(body: _Body, point: Array, direction: Array) -> Array:
    """The point below one of the surface (3,), halfway through the body, which moves but does not roll."""
    along = body.corners @ direction
    return np.asarray(point - (point @ direction - 0.5 * (along.min() + along.max())) * direction)


def _window(body: _Body, direction: Array) -> tuple[Array, Array, Array, float]:
    """A frame (4, 4) that looks down on a body, the places of rays that cover it, and the width of the body [m]."""
    T = frame_along(direction, np.zeros(3))
    local = body.corners @ T[:3, :3]
    low, high = local.min(axis=0), local.max(axis=0)
    xs, ys = (_cells(low[k], high[k]) for k in range(2))
    return T, xs, ys, float(np.min(high - low))


def _cells(low: float, high: float) -> Array:
    """Middles of the cells of an interval."""
    edges = np.linspace(low, high, RAYS + 1)
    return np.asarray(0.5 * (edges[1:] + edges[:-1]))


def _dome(closing: Closing, body: _Body, number: int, point: Array, direction: Array) -> _Place | None:
    """The patch round a point of a body, in the coordinates of the link that is met there; None where none fits."""
    if not direction.any():
        return None
    link = body.frame or _link_at(body, point, direction)
    _, T = closing.hand.frame(link)
    to_link = np.linalg.inv(T)
    joint, size = closing.joints.get(number), np.ptp(body.corners, axis=0)
    along = np.eye(3)[np.argmax(size)]
    if joint is not None and not joint.slides:
        along = np.cross(np.array(joint.axis), direction)
    shapes = [replace(shape, placement=to_link @ shape.placement) for shape in body.shapes]
    at, towards, u_axis = to_link[:3, :3] @ point + to_link[:3, 3], to_link[:3, :3] @ direction, to_link[:3, :3] @ along
    dome = fit_dome(shapes, at, towards, u_axis, LARGEST * body.width)
    return None if dome is None else _Place(link, dome)


def _link_at(body: _Body, point: Array, direction: Array) -> str:
    """The link that a ray to a point meets first, or the one whose shape is nearest to the ray."""
    T = frame_along(direction, point)
    grid = np.linspace(-1e-3, 1e-3, 3)
    number = int(look(body.shapes, T, grid, grid).shapes[1, 1])
    if number >= 0:
        return body.shapes[number].link
    gaps = [np.linalg.norm(np.mean(bounding_points(shape) - point, axis=0)) for shape in body.shapes]
    return body.shapes[int(np.argmin(gaps))].link


def _pad(closing: Closing, body: _Body, place: _Place | None) -> Pad:
    """The pad of a patch."""
    if place is None:
        raise GraspAtlasError(
            f"link '{body.shapes[0].link}' of hand '{closing.hand.name}' has no smooth place where it closes: its "
            "shape has an edge or a hole there, or no joint moves it; state its patch by hand"
        )
    patch, error = place.dome.patch, place.dome.error
    (x, y, z), (a, b, c) = map(float, patch.point()), map(float, patch.normal_at())
    return Pad(place.link, (x, y, z), (a, b, c), patch, error)
