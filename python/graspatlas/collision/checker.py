"""Collisions of hand and object, by coal in the compiled core."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.collision.clash import Clash
from graspatlas.collision.problem_shapes import collision_shapes
from graspatlas.collision.shapes import Shape, convex_hull, thinner
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, BoolArray, Int32Array
from graspatlas.support.progress import progress_bar

if TYPE_CHECKING:
    from graspatlas.problem.problem import Problem

__all__ = ["CollisionChecker", "Nearest", "collision_checker"]

#: Before the names of the object's shapes, and of the obstacles'.
OBJECT, OBSTACLE = "object/", "obstacle/"
#: Grasps are checked in batches of this size, on all cores.
BATCH = 2048


@dataclass(frozen=True, eq=False)
class Nearest:
    """Where pairs of shapes are nearest, or deepest in each other, for n grasps and p pairs.

    A change of x that moves the first shape's point by da and the second's by db changes the distance by
    normal . (db - da), where the points are unique. Where two meshes cut each other points and normals are NaN.

    Attributes:
        pairs: Names of the shapes (p,).
        distances: Signed distances (n, p), metres: negative is the depth of a collision; meshes that are no solids have
            none.
        on_first: The point on the first shape, in the palm's frame (n, p, 3), metres.
        on_second: The point on the second shape (n, p, 3), metres.
        normals: Unit vectors along which the second shape gets away from the first (n, p, 3), in the palm's frame.
    """

    pairs: tuple[tuple[str, str], ...]
    distances: Array
    on_first: Array
    on_second: Array
    normals: Array


class CollisionChecker:
    """Tells whether a grasp is free of collision: hand with itself, with the object, and with the obstacles.

    Pairs of links that the hand's SRDF lists may touch. The links that carry a contact touch the object; they may sink
    into it by `touch_depth`, since a collision shape only approximates the surface. Other links keep `clearance`, those
    that are fixed to them too; which link carries a contact whose frame has no shapes of its own says
    :attr:`graspatlas.collision.problem_shapes.CollisionShapes.touching`. Meshes that bound a convex solid are solid.
    Other meshes of a link with a contact count by their convex hulls where they meet the object; those of an object are
    surfaces, and what touches them is made thinner by `touch_depth`. Hulls with more than some 250 corners are thinned,
    to 0.1 mm; `thinned` tells which.

    All links keep `clearance` from obstacles, those that carry a contact too. Obstacles in the palm's frame are fixed
    to the palm and to the links that do not move against it, so that these are not looked at; the object keeps
    `clearance` from them. It may touch those in its own frame.

    Any number of threads may use one checker. Answers are functions of the grasp alone.

    Args:
        problem: The problem; hand, object and obstacles need collision shapes.
        touch_depth: Depth to which a touching link may sink into the object [m].
        clearance: Distance that all other pairs must keep [m].

    Attributes:
        pairs: Names of the shapes of each pair that is looked at (p,).
        required: Distance that each pair must keep, less what it may sink in (p,), metres.
        batch: The compiled checker.
        thinned: How far the hulls that were thinned reach beyond what is left of them, by the shapes' names [m].

    Raises:
        GraspAtlasError: If one of them has no collision shape, or a mesh or the SRDF cannot be read.
    """

    def __init__(self, problem: Problem, touch_depth: float = 0.002, clearance: float = 0.0) -> None:
        self._hand, self._object_name = problem.hand, problem.object.name
        self._obstacles = [obstacle.name for obstacle in problem.obstacles]
        model = problem.object_joint_model.model(problem.hand.tree)
        shapes, pairs = _joined(problem, model.object_joint, touch_depth, clearance)
        self._shapes = tuple(shapes)
        self._size = model.q_size
        self.pairs = tuple((shapes[pair.first].name, shapes[pair.second].name) for pair in pairs)
        self.required: Array = np.array([pair.required for pair in pairs])
        self._stated = tuple(pairs)
        self.thinned = {shape.name: shape.error for shape in shapes if shape.error > 0.0}
        numbers = np.array([(pair.first, pair.second) for pair in pairs], np.int32).reshape(-1, 2)
        self.batch = _core.CollisionBatch(model, [shape.as_tuple() for shape in shapes], numbers, self.required)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """The shapes of hand, object and obstacles, by whose names the pairs go."""
        return self._shapes

    def first_collision(self, x: ArrayLike) -> tuple[str, str] | None:
        """Names of the first two shapes found in collision at a grasp, or None.

        Args:
            x: The grasp (configuration_size,).
        """
        (hit,) = self.batch.first_hits(self._rows(np.asarray(x, float)[None]))
        return None if hit < 0 else self.pairs[hit]

    def free(self, X: ArrayLike) -> BoolArray:
        """Whether each grasp is free of collision (n,).

        Args:
            X: One grasp a row (n, configuration_size).
        """
        rows = self._rows(X)
        out = np.empty(len(rows), bool)
        with progress_bar("collisions", "grasps", len(rows)) as bar:
            for start in range(0, len(rows), BATCH):
                batch = rows[start : start + BATCH]
                out[start : start + BATCH] = self.batch.free(batch)
                bar.update(len(batch))
        return out

    def clearances(self, X: ArrayLike, pairs: ArrayLike | None = None) -> Array:
        """Distance of each pair of shapes, less the distance that it must keep; negative in collision (n, p), metres.

        Args:
            X: One grasp a row (n, configuration_size).
            pairs: Numbers of the pairs (p,), in the order of the attribute `pairs`; all by default.
        """
        chosen = self._chosen(pairs)
        return np.asarray(self.batch.nearest(self._rows(X), chosen)["distances"] - self.required[chosen])

    def nearest(self, X: ArrayLike, pairs: ArrayLike | None = None) -> Nearest:
        """Signed distance, nearest points and normal of pairs of shapes.

        Distances of shapes that are apart are exact to 1e-10 m, depths to 1e-6 m.

        Args:
            X: One grasp a row (n, configuration_size).
            pairs: Numbers of the pairs (p,), in the order of the attribute `pairs`; all by default.
        """
        chosen = self._chosen(pairs)
        found = self.batch.nearest(self._rows(X), chosen)
        return Nearest(tuple(self.pairs[i] for i in chosen), **found)

    def worst(self, x: ArrayLike) -> Clash | None:
        """The two shapes of a grasp that miss the distance which they must keep by most; None where there are no pairs.

        Args:
            x: The grasp (configuration_size,).
        """
        rows = self._rows(np.asarray(x, float)[None])
        found = self.batch.nearest(rows, self._chosen(None))
        distances, points = found["distances"][0], 0.5 * (found["on_first"] + found["on_second"])[0]
        cut = ~np.isfinite(found["normals"][0]).all(axis=1) & (distances <= self.required)
        slacks = np.where(cut, -np.inf, distances - self.required)
        if not len(slacks):
            return None
        number = int(np.argmin(slacks))
        pair = self._stated[number]
        shapes = self._shapes[pair.first], self._shapes[pair.second]
        return Clash(
            shapes=shapes,
            names=(self._body_of(shapes[0]), self._body_of(shapes[1])),
            groups=(_group_of(shapes[0]), _group_of(shapes[1])),
            distance=float("nan") if cut[number] else float(distances[number]) - pair.thinned,
            required=pair.required - pair.thinned,
            point=points[number],
        )

    def _body_of(self, shape: Shape) -> str:
        """What a shape belongs to: a link, the object or an obstacle."""
        group, name = _group_of(shape), shape.name.removeprefix(OBSTACLE)
        if group == "obstacle":
            return name if name in self._obstacles else name.rpartition("_")[0]
        return self._object_name if group == "object" else shape.link

    def depths(self, x: ArrayLike, frame: str | None, points: ArrayLike) -> Array:
        """How far points are from the collision shapes of a link or of the object, at a grasp.

        Args:
            x: The grasp (configuration_size,).
            frame: Link of the hand, of which the shapes of its joint count; the object where there is none.
            points: The points in the palm's frame (n, 3), metres.

        Returns:
            Distance of each point from the nearest shape (n,), metres: negative inside, but for meshes that are not
            convex, and infinite where there is no shape.
        """
        joint = None if frame is None else self._hand.frame(frame)[0]
        chosen = [i for i, shape in enumerate(self._shapes) if _carried(shape, joint)]
        rows, at = self._rows(np.asarray(x, float)[None]), np.atleast_2d(np.asarray(points, float))
        return np.asarray(self.batch.point_distances(rows, np.array(chosen, np.int32), at)[0])

    def _rows(self, X: ArrayLike) -> Array:
        """The configurations in grasps, one a row."""
        rows = np.asarray(X, float)
        if rows.ndim != 2 or rows.shape[1] < self._size:
            raise GraspAtlasError(
                f"grasps must be an array [n, configuration_size] with at least {self._size} columns; "
                f"its shape is {rows.shape}"
            )
        return np.ascontiguousarray(rows[:, : self._size])

    def _chosen(self, pairs: ArrayLike | None) -> Int32Array:
        return np.arange(len(self.pairs), dtype=np.int32) if pairs is None else np.asarray(pairs, np.int32)


@lru_cache(maxsize=8)
def collision_checker(problem: Problem, touch_depth: float = 0.002, clearance: float = 0.0) -> CollisionChecker:
    """The checker of a problem, of the last ones kept: reading the shapes takes longer than to check many grasps.

    Args and errors are those of :class:`CollisionChecker`.
    """
    return CollisionChecker(problem, touch_depth, clearance)


@dataclass(frozen=True)
class _Pair:
    """Numbers of two shapes, the distance that they must keep, and by how much the first was made thinner [m]."""

    first: int
    second: int
    required: float
    thinned: float = 0.0


def _joined(
    problem: Problem, object_joint: int, touch_depth: float, clearance: float
) -> tuple[list[Shape], list[_Pair]]:
    """All shapes, and the pairs to look at: those in the hand, then those with the object, then with the obstacles."""
    stated = collision_shapes(problem)
    shapes = list(stated.hand)
    in_hand = list(enumerate(shapes))
    pairs = [_Pair(a, b, clearance) for a, b in stated.hand_pairs]
    for shape in stated.object:
        second = len(shapes)
        shapes.append(replace(shape, name=OBJECT + shape.name, joint=object_joint))
        for first, of_link in in_hand:
            if first not in stated.touching:
                pairs.append(_Pair(first, second, clearance))
            elif not (of_link.is_mesh or shape.is_mesh):
                pairs.append(_Pair(first, second, -touch_depth))
            elif (stand_in := _may_touch(of_link, shape.is_mesh, touch_depth)) is not None:
                sunk = (0.0, touch_depth) if shape.is_mesh else (-touch_depth, 0.0)
                pairs.append(_Pair(len(shapes), second, *sunk))
                shapes.append(stand_in)
    of_object = [i for i, shape in enumerate(shapes) if _in_object(shape)]
    for obstacle in stated.obstacles:
        number, joint = len(shapes), object_joint if obstacle.on_object else 0
        shapes.append(replace(obstacle.shape, name=OBSTACLE + obstacle.shape.name, joint=joint))
        kept_off = [first for first, shape in in_hand if shape.joint != joint]
        kept_off += [] if obstacle.on_object else of_object
        pairs += [_Pair(first, number, clearance) for first in kept_off]
    return shapes, pairs


def _may_touch(shape: Shape, surface: bool, touch_depth: float) -> Shape | None:
    """A stand-in for a link's shape, where coal knows no depth of the pair: its hull, thinner where it meets a mesh.

    None when nothing is left of it.
    """
    hull = convex_hull(shape)
    if hull.is_mesh:
        raise GraspAtlasError(
            f"the collision mesh '{shape.name}' touches the object and is flat; give it some thickness"
        )
    return thinner(hull, touch_depth) if surface else hull


def _carried(shape: Shape, joint: int | None) -> bool:
    """Whether a shape is one of the hand's on a joint, or of the object's where there is none."""
    if joint is None:
        return _in_object(shape)
    return not shape.name.startswith((OBJECT, OBSTACLE)) and shape.joint == joint


def _group_of(shape: Shape) -> str:
    """Whether a shape is of the hand, the object or an obstacle."""
    if shape.name.startswith(OBSTACLE):
        return "obstacle"
    return "object" if _in_object(shape) else "hand"


def _in_object(shape: Shape) -> bool:
    return shape.name.startswith(OBJECT)
