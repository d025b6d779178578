"""The Allegro hand with a ball, a box and a cylinder, in three and in four fingers: complete, right, and they hold."""

from __future__ import annotations

from functools import cache

import coal
import numpy as np
import pinocchio as pin
import pytest
from helpers import slow_but
from numpy.typing import NDArray
from oracles.wrench_lp import margin_by_linear_programming

import graspatlas as ga

Array = NDArray[np.float64]

#: Freedoms t of each problem.
FREEDOMS = {
    "allegro_box_3": 7,
    "allegro_box_4": 9,
    "allegro_cylinder_3": 7,
    "allegro_cylinder_4": 8,
    "allegro_sphere_3": 7,
    "allegro_sphere_4": 9,
}
BALL, BOX = 0.04, np.array([0.05, 0.05, 0.14])
CYLINDER_RADIUS, CYLINDER_LENGTHS = 0.03, {3: 0.12, 4: 0.14}
FINGERTIP = 0.012
FRICTION, MARGIN, DEPTH = 0.5, 0.02, 0.002


@cache
def best_of(name: str) -> ga.Result:
    """The result at the problem's own radius, refined, under the requirements of the file."""
    return ga.optimize(ga.load_problem(name), refine=True)


def shape_of(name: str) -> coal.CollisionGeometry:
    """The object, made here from its sizes."""
    if "sphere" in name:
        return coal.Sphere(BALL)
    if "box" in name:
        return coal.Box(*BOX)
    return coal.Cylinder(CYLINDER_RADIUS, CYLINDER_LENGTHS[int(name[-1])])


def height_above(name: str, points: Array) -> Array:
    """Height of points [n, 3] in the object's frame above the surface that the fingers touch [n], metres."""
    if "sphere" in name:
        return np.asarray(np.linalg.norm(points, axis=1) - BALL)
    if "box" in name:
        return np.asarray(np.abs(points[:, 0]) - BOX[0] / 2.0)
    return np.asarray(np.linalg.norm(points[:, :2], axis=1) - CYLINDER_RADIUS)


def test_all_six_are_bundled():
    assert {name for name in ga.bundled_problems() if name.startswith("allegro")} == set(FREEDOMS)


@pytest.mark.parametrize("name", FREEDOMS)
def test_freedoms(name):
    problem = ga.load_problem(name)
    fingers = int(name[-1])
    assert len(problem.contacts) == fingers
    assert len(problem.hand.joints) == 4 * fingers
    assert problem.full_dimension == FREEDOMS[name]
    assert problem.defaults["dimension"] == 2
    assert problem.frozen_motions(2) == len(problem.motions.couplings) == FREEDOMS[name] - 2
    J = problem.system(2).evaluate_jacobian(problem.x1_array)
    assert np.linalg.matrix_rank(J) == 5 * fingers == J.shape[1] - 2


@pytest.mark.parametrize("name", slow_but(FREEDOMS, "allegro_cylinder_3"))
def test_the_atlas_is_complete(name):
    result = best_of(name)
    assert result.is_global
    assert result.status is ga.Status.COMPLETE
    assert result.dimension == 2
    assert 2000 < result.atlas.n_charts < 10_000
    residuals = [np.abs(result.atlas.system.evaluate_residual(x)).max() for x in result.atlas.centers]
    assert max(residuals) < 1e-9
    assert result.accepted[0], "the first grasp meets the requirements"


@pytest.mark.parametrize("name", slow_but(FREEDOMS, "allegro_cylinder_3"))
def test_a_coarse_atlas_passes_every_check(name):
    result = ga.optimize(ga.load_problem(name), radius=0.25)
    assert result.is_global
    report = result.check()
    assert report.passed, str(report)


@pytest.mark.parametrize("name", slow_but(FREEDOMS, "allegro_cylinder_3"))
def test_fingertips_lie_on_the_object(name):
    """The centre of each fingertip's ball is its radius above the surface; the thumb's on the other side."""
    result = best_of(name)
    problem = result.problem
    rows = np.random.default_rng(0).choice(result.atlas.n_charts, 200, replace=False)
    grasps = ga.Grasps(problem, result.atlas.centers[rows])
    for contact in problem.contacts:
        tips = np.array([problem.hand.link_placements(q)[contact.frame][:3, 3] for q in grasps.q])
        T = grasps.T_palm_object
        seen = np.einsum("nji,nj->ni", T[:, :3, :3], tips - T[:, :3, 3])
        np.testing.assert_allclose(height_above(name, seen), FINGERTIP, atol=1e-8)
        if "box" in name:
            side = 1.0 if contact.frame == "link_15.0_tip" else -1.0
            assert (side * seen[:, 0] > 0.0).all()
            assert (np.abs(seen[:, 1:]) < BOX[1:] / 2.0).all()


@pytest.mark.parametrize("name", slow_but(FREEDOMS, "allegro_cylinder_3"))
def test_the_best_grasp_holds(name):
    """Force closure by linear programming; the refined best may lie on the edge of the requirement."""
    result = best_of(name)
    assert result.refined_best.quality >= result.best.quality
    for grasp in (result.best, result.refined_best):
        assert np.abs(result.atlas.system.evaluate_residual(grasp.x)).max() < 1e-9
        assert margin_by_linear_programming(grasp, FRICTION) >= MARGIN - 1e-6


@pytest.mark.parametrize("name", slow_but(FREEDOMS, "allegro_cylinder_3"))
def test_the_best_grasp_collides_with_nothing(name):
    """Shapes one by one in coal, the object made here: only links of touching fingertips may sink in, by 2 mm."""
    result = best_of(name)
    hand = result.problem.hand
    model = pin.buildModelFromXML(hand.urdf)
    folders = list(hand.package_dirs)
    shapes = pin.buildGeomFromUrdfString(model, hand.urdf, pin.COLLISION, package_dirs=folders)
    shapes.addAllCollisionPairs()
    pin.removeCollisionPairsFromXML(model, shapes, hand.srdf)
    touching = {model.frames[model.getFrameId(contact.frame)].parentJoint for contact in result.problem.contacts}
    for grasp in (result.best, result.refined_best):
        data, places = model.createData(), pin.GeometryData(shapes)
        assert not pin.computeCollisions(model, data, shapes, places, grasp.q, True)
        pose = coal.Transform3s(grasp.T_palm_object[:3, :3], grasp.T_palm_object[:3, 3])
        for shape, M in zip(shapes.geometryObjects, places.oMg, strict=True):
            place = coal.Transform3s(M.rotation, M.translation)
            found = coal.DistanceResult()
            gap = coal.distance(shape.geometry, place, shape_of(name), pose, coal.DistanceRequest(), found)
            assert gap >= (-DEPTH if shape.parentJoint in touching else 0.0) - 1e-6, shape.name
