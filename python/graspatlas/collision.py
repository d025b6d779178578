"""Collisions of hand and object, by coal through Pinocchio."""

from __future__ import annotations

import os
import sys
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from tqdm import tqdm

from graspatlas.collision_shapes import convex_hull, convex_solid, is_mesh, thinner
from graspatlas.errors import GraspAtlasError
from graspatlas.mesh_files import check_meshes

if TYPE_CHECKING:
    from graspatlas.hand import Body
    from graspatlas.problem import Problem

__all__ = ["CollisionChecker"]

#: Before the names of the object's shapes.
OBJECT = "object/"
#: After the names of shapes that are thinner than those of the hand.
THINNER = "/thinner"
#: Distances are as exact as this, so that optimisers can differentiate them; depths are not [m].
DISTANCE_TOLERANCE = 1e-10
#: Radius of the ball that stands for a point [m].
DOT = 1e-6
#: Grasps are checked in batches of this size, on all cores, unless there are very few.
BATCH = 2048
SMALLEST_BATCH = 64


class CollisionChecker:
    """Tells whether a grasp is free of collision: hand with itself, and hand with object.

    Pairs of links that the hand's SRDF lists may touch. The links that carry a contact touch the object; they may sink
    into it by `touch_depth`, since a collision shape only approximates the surface. Meshes that bound a convex solid
    are solid. Other meshes of a link with a contact count by their convex hulls where they meet the object; those of an
    object are surfaces, and what touches them is made thinner by `touch_depth`.

    Args:
        problem: The problem; hand and object need collision shapes.
        touch_depth: Depth to which a touching link may sink into the object [m].
        clearance: Distance that all other pairs must keep [m].

    Raises:
        GraspAtlasError: If hand or object has no collision shape, or a mesh cannot be read.
    """

    def __init__(self, problem: Problem, touch_depth: float = 0.002, clearance: float = 0.0) -> None:
        import coal
        import pinocchio as pin

        self._pin = pin
        self._model, self._geometry = _joined(problem, touch_depth)
        self._data = self._model.createData()
        self._geometry_data = pin.GeometryData(self._geometry)
        touching = _touching_joints(self._model, problem)
        for i, pair in enumerate(self._geometry.collisionPairs):
            shapes = [self._geometry.geometryObjects[s] for s in (pair.first, pair.second)]
            in_object = [shape.name.startswith(OBJECT) for shape in shapes]
            touches = in_object == [False, True] and shapes[0].parentJoint in touching
            request = coal.CollisionRequest()
            depth = 0.0 if shapes[0].name.endswith(THINNER) else touch_depth
            request.security_margin = -depth if touches else clearance
            self._geometry_data.collisionRequests[i] = request
            self._geometry_data.distanceRequests[i].gjk_tolerance = DISTANCE_TOLERANCE
        pairs = range(len(self._geometry.collisionPairs))
        self._required = np.array([self._geometry_data.collisionRequests[i].security_margin for i in pairs])

    def first_collision(self, x: ArrayLike) -> tuple[str, str] | None:
        """Names of the first two shapes found in collision at a grasp, or None.

        Args:
            x: The grasp [configuration_size].
        """
        q = np.asarray(x, float)[: self._model.nq]
        hit = self._pin.computeCollisions(self._model, self._data, self._geometry, self._geometry_data, q, True)
        if not hit:
            return None
        for pair, result in zip(self._geometry.collisionPairs, self._geometry_data.collisionResults, strict=True):
            if result.isCollision():
                first, second = (self._geometry.geometryObjects[i].name for i in (pair.first, pair.second))
                return first.removesuffix(THINNER), second
        return None

    def free(self, X: ArrayLike) -> NDArray[np.bool_]:
        """Whether each grasp is free of collision [n].

        Args:
            X: One grasp a row [n, configuration_size].
        """
        rows = np.asarray(X, float)[:, : self._model.nq]
        if len(rows) < SMALLEST_BATCH:
            args = self._model, self._data, self._geometry, self._geometry_data
            return np.array([not self._pin.computeCollisions(*args, q, True) for q in np.ascontiguousarray(rows)], bool)
        out = np.empty(len(rows), bool)
        bar = tqdm(total=len(rows), desc="collisions", unit=" grasps", delay=1.0, disable=not sys.stderr.isatty())
        with bar:
            for start in range(0, len(rows), BATCH):
                batch = np.asfortranarray(rows[start : start + BATCH].T)
                threads = len(os.sched_getaffinity(0))
                hits = self._pin.computeCollisionsInParallel(threads, self._pool, batch, True, False)
                out[start : start + BATCH] = ~np.asarray(hits, bool)
                bar.update(batch.shape[1])
        return out

    @cached_property
    def _pool(self) -> Any:
        """Copies of the geometry, one for each thread."""
        size = len(os.sched_getaffinity(0))
        pool = self._pin.GeometryPool(self._model, self._geometry, size)
        for i in range(size):
            for pair, request in enumerate(self._geometry_data.collisionRequests):
                pool.getGeometryData(i).collisionRequests[pair] = request
        return pool

    def clearances(self, X: ArrayLike, pairs: ArrayLike | None = None) -> NDArray[np.float64]:
        """Distance of each pair of shapes, less the distance that it must keep; negative in collision [n, p], metres.

        Args:
            X: One grasp a row [n, configuration_size].
            pairs: Numbers of the pairs [p], in the order of the collision geometry; all by default.
        """
        chosen = np.arange(len(self._required)) if pairs is None else np.asarray(pairs, int)
        rows = np.ascontiguousarray(np.asarray(X, float)[:, : self._model.nq])
        data, geometry_data, distance = self._data, self._geometry_data, self._pin.computeDistance
        out = np.empty((len(rows), len(chosen)))
        for row, q in zip(out, rows, strict=True):
            self._pin.updateGeometryPlacements(self._model, data, self._geometry, geometry_data, q)
            row[:] = [distance(self._geometry, geometry_data, int(pair)).min_distance for pair in chosen]
        return np.asarray(out - self._required[chosen])

    def depths(self, x: ArrayLike, frame: str | None, points: ArrayLike) -> NDArray[np.float64]:
        """How far points are from the collision shapes of a link or of the object, at a grasp.

        Args:
            x: The grasp [configuration_size].
            frame: Link of the hand, of which the shapes of its joint count; the object where there is none.
            points: The points in the palm's frame [n, 3], metres.

        Returns:
            Distance of each point from the nearest shape [n], metres: negative inside, but for meshes that are not
            convex, and infinite where there is no shape.
        """
        import coal

        q = np.asarray(x, float)[: self._model.nq]
        self._pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._geometry_data, q)
        joint = None if frame is None else self._model.frames[self._model.getFrameId(frame)].parentJoint
        dot, request = coal.Sphere(DOT), coal.DistanceRequest()
        out = np.full(len(np.atleast_2d(points)), np.inf)
        for shape, placement in zip(self._geometry.geometryObjects, self._geometry_data.oMg, strict=True):
            in_object = shape.name.startswith(OBJECT)
            if in_object if joint is None else not in_object and shape.parentJoint == joint:
                at = coal.Transform3s(placement.rotation, placement.translation)
                for i, point in enumerate(np.atleast_2d(points)):
                    here = coal.Transform3s(np.eye(3), np.asarray(point, float))
                    gap = coal.distance(dot, here, shape.geometry, at, request, coal.DistanceResult())
                    out[i] = min(out[i], gap + DOT)
        return out


def _joined(problem: Problem, touch_depth: float) -> tuple[Any, Any]:
    """Model and collision geometry of hand and object in one; the object's shapes sit on the joint named object."""
    import pinocchio as pin

    model = pin.buildModelFromXML(problem.hand.tree)
    geometry = _shapes(problem.hand, model)
    if problem.hand.srdf:
        geometry.addAllCollisionPairs()
        pin.removeCollisionPairsFromXML(model, geometry, problem.hand.srdf)
    else:
        geometry.addAllCollisionPairs()
        _drop_adjacent(model, geometry)
    touching = _touching_joints(model, problem)
    in_hand = list(enumerate(geometry.geometryObjects.tolist()))
    joint = pin.JointModelFreeFlyer() if problem.object_joint == "free_flyer" else pin.JointModelPlanar()
    object_joint = model.addJoint(0, joint, pin.SE3.Identity(), "object")
    body = _shapes(problem.object, pin.buildModelFromXML(problem.object.urdf))
    for shape in body.geometryObjects:
        placed = pin.GeometryObject(OBJECT + shape.name, object_joint, 0, shape.placement, shape.geometry)
        index = geometry.addGeometryObject(placed)
        for other, of_link in in_hand:
            may_touch = of_link.parentJoint in touching and (is_mesh(of_link.geometry) or is_mesh(shape.geometry))
            added = _may_touch(of_link, is_mesh(shape.geometry), touch_depth) if may_touch else of_link
            if added is not None:
                first = geometry.addGeometryObject(added) if may_touch else other
                geometry.addCollisionPair(pin.CollisionPair(first, index))
    return model, geometry


def _may_touch(shape: Any, surface: bool, touch_depth: float) -> Any | None:
    """A stand-in for a link's shape, where coal knows no depth of the pair: its hull, thinner where it meets a surface.

    None when nothing is left of it.
    """
    import pinocchio as pin

    hull, name = convex_hull(shape.geometry), shape.name
    if is_mesh(hull):
        raise GraspAtlasError(f"the collision mesh '{name}' touches the object and is flat; give it some thickness")
    if surface:
        hull, name = thinner(hull, touch_depth), name + THINNER
    return None if hull is None else pin.GeometryObject(name, shape.parentJoint, 0, shape.placement, hull)


def _shapes(body: Body, model: Any) -> Any:
    import pinocchio as pin

    check_meshes(body)
    try:
        geometry = pin.buildGeomFromUrdfString(model, body.urdf, pin.COLLISION, package_dirs=list(body.package_dirs))
    except (ValueError, RuntimeError) as error:
        reason = " ".join(str(error).rpartition("message: ")[2].split())
        raise GraspAtlasError(f"collision shapes of '{body.name}' cannot be read: {reason}") from None
    if geometry.ngeoms == 0:
        raise GraspAtlasError(f"'{body.name}' has no collision shape; give its URDF <collision> elements")
    for shape in geometry.geometryObjects:
        shape.geometry = convex_solid(shape.geometry)
    return geometry


def _drop_adjacent(model: Any, geometry: Any) -> None:
    """Without an SRDF, shapes of one joint and of parent and child joints may touch."""
    import pinocchio as pin

    copies = [pin.CollisionPair(pair.first, pair.second) for pair in geometry.collisionPairs]  # removing moves them
    for pair in copies:
        a, b = (geometry.geometryObjects[i].parentJoint for i in (pair.first, pair.second))
        if a == b or model.parents[a] == b or model.parents[b] == a:
            geometry.removeCollisionPair(pair)


def _touching_joints(model: Any, problem: Problem) -> set[int]:
    """Joints that carry a link with a contact."""
    return {model.frames[model.getFrameId(contact.frame)].parentJoint for contact in problem.contacts}
