"""Collisions with obstacles against Pinocchio's and coal's Python, on all charts of an atlas."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from oracles.collision_oracle import DOUBT, hull, write_box

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.collision.shapes import Shape
from graspatlas.problem.object_joint import FREE_FLYER

RIM = ga.Pose([0.0, 0.07, -0.02], [0.1, 0.2, 0.3, 0.9])
KINDS = ("sphere", "capsule", "cylinder", "box", "convex", "mesh")


@pytest.fixture(scope="module")
def free_standing() -> ga.Result:
    """Grasps of a cylinder that nothing is round."""
    return ga.optimize(ga.load_problem("allegro_cylinder_3"), radius=0.25, require=[])


@pytest.fixture(scope="module")
def standing(free_standing: ga.Result, tmp_path_factory: pytest.TempPathFactory) -> ga.Problem:
    """The cylinder on a table, between other things."""
    mesh = write_box(tmp_path_factory.mktemp("meshes") / "block.obj", np.array([0.03, 0.05, 0.04]), False)
    hollow = write_box(Path(mesh).with_name("crate.obj"), np.array([0.04, 0.05, 0.04]), True)
    obstacles = (
        ga.Obstacle.plane("table", [0.0, 0.0, -0.06], [0.0, 0.0, 3.0]),
        ga.Obstacle.box("rim", [0.1, 0.02, 0.1], RIM),
        ga.Obstacle.cylinder("post", 0.02, 0.2, ga.Pose([0.0, 0.0, 0.16])),
        ga.Obstacle.mesh("block", mesh, pose=ga.Pose([-0.04, 0.02, -0.04])),
        ga.Obstacle.mesh("crate", hollow, pose=ga.Pose([0.02, -0.05, -0.04])),
        ga.Obstacle.sphere("camera", 0.03, ga.Pose([0.09, 0.0, 0.06]), frame="palm"),
        ga.Obstacle.plane("wall", [0.0, 0.0, -0.03], [0.1, 0.0, 1.0], frame="palm"),
    )
    return replace(free_standing.problem, obstacles=obstacles)


def geometry(obstacle: ga.Obstacle) -> tuple[Any, Any]:
    """An obstacle for coal, by another route: made from what was stated, and its placement."""
    at = pin.XYZQUATToSE3(np.r_[obstacle.pose.xyz, obstacle.pose.quat_xyzw])
    if obstacle.normal is not None:
        return coal.Halfspace(np.array(obstacle.normal), 0.0), at
    assert obstacle.body is not None
    body = obstacle.body
    ((_, shape, _, there),) = read(pin.buildModelFromXML(body.urdf), body.urdf, list(body.package_dirs))
    return solid(shape) if obstacle.name == "block" else shape, at * there


def hand_shapes(problem: ga.Problem) -> tuple[Any, dict[str, tuple[Any, int, Any]]]:
    """Pinocchio's model of hand and object, and the hand's shapes with joint and placement by name."""
    model = pin.buildModelFromXML(problem.hand.tree)
    hand, folders = problem.hand, list(problem.hand.package_dirs)
    shapes = {name: (solid(shape), *at) for name, shape, *at in read(model, hand.urdf, folders)}
    return model, shapes


def solid(shape: Any) -> Any:
    return hull(shape) if isinstance(shape, coal.BVHModelBase) else shape


def read(model: Any, urdf: str, folders: list[str]) -> list[tuple[str, Any, int, Any]]:
    """Name, geometry, joint and placement of the collision shapes of a URDF, in our hands."""
    held = pin.buildGeomFromUrdfString(model, urdf, pin.COLLISION, package_dirs=folders)
    out = []
    for item in held.geometryObjects.tolist():
        at = pin.SE3(item.placement.rotation.copy(), item.placement.translation.copy())
        out.append((item.name, item.geometry.clone(), int(item.parentJoint), at))
    return out


def test_distances_on_all_charts_are_those_of_coal(standing: ga.Problem, free_standing: ga.Result) -> None:
    X, checker = free_standing.atlas.centers, CollisionChecker(standing)
    assert len(X) > 500
    model, shapes = hand_shapes(standing)
    ((_, cylinder, _, at),) = read(pin.buildModelFromXML(standing.object.urdf), standing.object.urdf, [])
    obstacles = {f"obstacle/{obstacle.name}": (obstacle, *geometry(obstacle)) for obstacle in standing.obstacles}
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "object")
    shapes["object/cylinder_0"] = cylinder, joint, at
    data = model.createData()
    chosen = [i for i, (_, second) in enumerate(checker.pairs) if second in obstacles]
    wanted = {
        (name, other)
        for other, (obstacle, *_) in obstacles.items()
        for name, (_, carrier, _) in shapes.items()
        if (carrier not in (0, joint) if obstacle.frame == "palm" else carrier != joint)
        or (obstacle.frame == "palm" and carrier == joint)
    }
    assert {checker.pairs[i] for i in chosen} == wanted
    found = checker.nearest(X, chosen)
    ask = coal.DistanceRequest()
    ask.gjk_tolerance = 1e-10
    expected = np.empty_like(found.distances)
    for row, x in enumerate(X):
        pin.forwardKinematics(model, data, x[: model.nq])
        for column, i in enumerate(chosen):
            name, other = checker.pairs[i]
            shape, carrier, at = shapes[name]
            obstacle, thing, there = obstacles[other]
            T = data.oMi[carrier] * at
            S = data.oMi[joint] * there if obstacle.frame == "object" else there
            expected[row, column] = coal.distance(
                shape,
                coal.Transform3s(T.rotation, T.translation),
                thing,
                coal.Transform3s(S.rotation, S.translation),
                ask,
                coal.DistanceResult(),
            )
    surface = np.array([checker.pairs[i][1] == "obstacle/crate" for i in chosen])
    apart = expected > 1e-6
    assert apart.any(axis=0).sum() > 0.8 * len(chosen)
    assert (~apart).any()
    np.testing.assert_allclose(found.distances[apart], expected[apart], atol=1e-8)
    deep = ~apart & ~surface
    np.testing.assert_allclose(found.distances[deep], expected[deep], atol=DOUBT)
    sure = (np.abs(expected) > DOUBT).all(axis=1)
    free = CollisionChecker(free_standing.problem).free(X) & (expected > 0.0).all(axis=1)
    assert sure.sum() > 0.9 * len(X)
    np.testing.assert_array_equal(checker.free(X)[sure], free[sure])


def random_shape(kind: str, rng: np.random.Generator) -> Shape:
    sizes, points = rng.uniform(0.01, 0.03, 3), rng.uniform(-0.02, 0.02, (12, 3))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = pin.exp3(rng.normal(size=3)), rng.uniform(-0.01, 0.01, 3)
    if kind not in ("convex", "mesh"):
        return Shape(kind, sizes, name=kind, placement=T)
    triangles = np.array([(i, i + 1, i + 2) for i in range(10)], np.int32)
    return Shape(kind, points=points, triangles=triangles if kind == "mesh" else triangles[:0], name=kind, placement=T)


@pytest.mark.parametrize("kind", KINDS)
def test_half_spaces_and_every_kind_of_shape(kind: str, planar_result: ga.Result) -> None:
    """Either way round: depths and distances are the height of the lowest point, of many on the surface."""
    from graspatlas import _core

    rng = np.random.default_rng(KINDS.index(kind))
    model = FREE_FLYER.model(planar_result.problem.hand.tree)
    X = np.tile(np.r_[np.array(model.neutral)], (40, 1))
    X[:, -7:-4] = rng.uniform(-0.05, 0.05, (40, 3))
    X[:, -4:] = [pin.Quaternion(pin.exp3(rng.normal(size=3))).coeffs() for _ in X]
    shape = replace(random_shape(kind, rng), joint=model.object_joint)
    plane = Shape("half_space", name="plane", placement=random_shape("sphere", rng).placement)
    for order in ([0, 1], [1, 0]):
        tuples = [shape.as_tuple(), plane.as_tuple()]
        batch = _core.CollisionBatch(model, tuples, np.array([order], np.int32), np.array([-0.003]))
        found = batch.nearest(X, np.array([0], np.int32))
        lowest = np.array([height(shape, plane.placement, x) for x in X])
        np.testing.assert_allclose(found["distances"][:, 0], lowest, atol=1e-9)
        assert (lowest > 0).any()
        assert (lowest < 0).any()
        np.testing.assert_array_equal(batch.free(X), lowest > -0.003)
        between = found["on_second"] - found["on_first"]
        np.testing.assert_allclose(between, found["distances"][..., None] * found["normals"], atol=1e-12)
        up = plane.placement[:3, 2] * (1.0 if order == [1, 0] else -1.0)
        np.testing.assert_allclose(found["normals"][:, 0], np.tile(up, (len(X), 1)), atol=1e-12)
    with pytest.raises(ga.GraspAtlasError, match="two half-spaces have no distance"):
        _core.CollisionBatch(model, [plane.as_tuple()] * 2, np.array([[0, 1]], np.int32), np.zeros(1))


def height(shape: Shape, T_plane: Any, x: Any) -> float:
    """Height of the lowest point of a shape above a plane, by coal, of meshes by their corners."""
    T = pin.XYZQUATToSE3(x[-7:]) * pin.SE3(shape.placement)
    if shape.kind in ("convex", "mesh"):
        return float(
            ((T.homogeneous[:3, :3] @ shape.points.T).T + T.translation - T_plane[:3, 3]).dot(T_plane[:3, 2]).min()
        )
    a, b, c = shape.sizes
    made = {
        "sphere": lambda: coal.Sphere(a),
        "capsule": lambda: coal.Capsule(a, b),
        "cylinder": lambda: coal.Cylinder(a, b),
        "box": lambda: coal.Box(a, b, c),
    }[shape.kind]()
    half = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    places = coal.Transform3s(T.rotation, T.translation), coal.Transform3s(T_plane[:3, :3], T_plane[:3, 3])
    return float(coal.distance(made, places[0], half, places[1], coal.DistanceRequest(), coal.DistanceResult()))


def test_a_table_takes_grasps_away(free_standing: ga.Result) -> None:
    bare = free_standing.problem
    table = ga.Obstacle.plane("table", [0.0, 0.0, -0.06])
    standing = replace(bare, obstacles=(table,))
    results = [ga.optimize(problem, radius=0.25) for problem in (bare, standing)]
    assert results[0].atlas.n_charts == results[1].atlas.n_charts
    assert 0 < results[1].accepted.sum() < results[0].accepted.sum()
    assert not (results[1].accepted & ~results[0].accepted).any()
    lost = results[0].accepted & ~results[1].accepted
    checker = CollisionChecker(standing, 5e-5)
    hits = {checker.first_collision(x) for x in results[0].atlas.centers[lost]}
    assert {second for _, second in hits} == {"obstacle/table"}


def test_climbs_stay_above_the_table(free_standing: ga.Result) -> None:
    standing = replace(free_standing.problem, obstacles=(ga.Obstacle.plane("table", [0.0, 0.0, -0.06]),))
    result = ga.optimize(standing, radius=0.25, refine=True)
    assert result.refined_best.quality > result.best.quality
    checker = CollisionChecker(standing, 5e-5)
    assert checker.free(result.refined_best.x[None]).all()
    table = [i for i, (_, second) in enumerate(checker.pairs) if second == "obstacle/table"]
    assert checker.clearances(result.refined_best.x[None], table).min() > 0.0
