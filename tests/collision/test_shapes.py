"""Meshes collide as the solids that they bound, and what touches may sink into them as into any other shape."""

from __future__ import annotations

import time
from dataclasses import replace

import coal
import numpy as np
import pytest
from oracles.collision_oracle import write_box
from scipy.spatial import ConvexHull

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.collision.shapes import Shape, convex_hull, convex_solid, read_shapes, thinner
from graspatlas.commands.diagnosis import OK, PROBLEM, diagnose
from graspatlas.hand.urdf import box_urdf, mesh_urdf

BOX = np.array([0.05, 0.05, 0.14])


@pytest.fixture(scope="module")
def grasps():
    """The problem, and grasps of it with some fingers pressed into the box by up to a few millimetres."""
    problem = ga.load_problem("allegro_box_3")
    result = ga.optimize(problem, radius=0.5, require=[])
    X = np.repeat(result.atlas.centers, 3, axis=0)
    h = len(problem.hand.joints)
    X[:, :h] += np.random.default_rng(0).normal(scale=0.02, size=(len(X), h))
    return problem, X


@pytest.mark.parametrize("hollow", [False, True])
def test_an_object_that_is_a_mesh(hollow, grasps, tmp_path):
    problem, X = grasps
    mesh = replace(problem.object, urdf=mesh_urdf("box", write_box(tmp_path / "box.obj", BOX, hollow), (1, 1, 1)))
    free = CollisionChecker(problem).free(X)
    assert 0.1 < free.mean() < 0.9
    checker = CollisionChecker(replace(problem, object=mesh))
    np.testing.assert_array_equal(checker.free(X), free)
    first = X[~free][0]
    assert checker.first_collision(first)[0] in {f"link_{i}.0_tip_0" for i in (3, 7, 15)}
    # Distances agree where nothing is deeper than it may be.
    x = X[free][:20]
    least = [c.clearances(x).min(axis=1) for c in (CollisionChecker(problem), checker)]
    np.testing.assert_allclose(*least, atol=1e-5)


@pytest.mark.parametrize("hollow", [False, True])
@pytest.mark.parametrize("object_hollow", [False, True])
def test_fingertips_that_are_meshes(hollow, object_hollow, grasps, tmp_path):
    problem, X = grasps
    tip = write_box(tmp_path / "tip.obj", np.full(3, 0.02), hollow)
    box = mesh_urdf("box", write_box(tmp_path / "box.obj", BOX, object_hollow), (1, 1, 1))
    sphere = '<sphere radius="0.012" />'
    assert problem.hand.urdf.count(sphere) >= 3
    answers = []
    for tips, body in (('<box size="0.02 0.02 0.02"/>', box_urdf("box", BOX)), (f'<mesh filename="{tip}"/>', box)):
        hand = replace(problem.hand, urdf=problem.hand.urdf.replace(sphere, tips))
        answers.append(CollisionChecker(replace(problem, hand=hand, object=replace(problem.object, urdf=body))).free(X))
    assert 0.02 < answers[0].mean() < 0.98
    if object_hollow:  # a layer off a box takes more than its thickness off the corners
        assert answers[1][answers[0]].all()
        assert (answers[0] == answers[1]).mean() > 0.8
    else:
        np.testing.assert_array_equal(*answers)


def test_check_and_optimize_a_mesh(tmp_path):
    problem = ga.load_problem("allegro_box_3")
    box = mesh_urdf("box", write_box(tmp_path / "box.obj", BOX, hollow=True), (1, 1, 1))
    problem = replace(problem, object=replace(problem.object, urdf=box))
    assert not [finding for finding in diagnose(problem, radius=0.5) if finding.mark == PROBLEM]
    assert ga.optimize(problem, radius=0.5, refine=True).refined_best.quality > 0.0


SHAPES = {
    "sphere": (Shape("sphere", (0.01, 0.0, 0.0)), lambda s: coal.Sphere(s[0])),
    "capsule": (Shape("capsule", (0.01, 0.04, 0.0)), lambda s: coal.Capsule(s[0], s[1])),
    "cylinder": (Shape("cylinder", (0.01, 0.04, 0.0)), lambda s: coal.Cylinder(s[0], s[1])),
    "box": (Shape("box", (0.02, 0.03, 0.04)), lambda s: coal.Box(*s)),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_layer_is_taken_off(name):
    shape, made = SHAPES[name]
    left = thinner(shape, 0.002)
    for direction in np.eye(3):
        outside, inside = (
            coal.distance(
                made(body.sizes),
                coal.Transform3s(),
                coal.Sphere(1e-6),
                at,
                coal.DistanceRequest(),
                coal.DistanceResult(),
            )
            for body in (shape, left)
            for at in [coal.Transform3s(np.eye(3), 0.1 * direction)]
        )
        assert inside - outside == pytest.approx(0.002, abs=1e-6)
    assert thinner(shape, 0.02) is None


def read_mesh(path):
    """The one shape of a URDF with this mesh."""
    urdf = mesh_urdf("thing", str(path), (1, 1, 1))
    (shape,) = read_shapes(urdf, urdf, [])
    return shape


def test_a_convex_solid_gets_thinner(tmp_path):
    mesh = read_mesh(write_box(tmp_path / "box.obj", np.array([0.02, 0.03, 0.04]), hollow=False))
    assert mesh.is_mesh
    solid = convex_solid(mesh)
    assert not solid.is_mesh
    assert ConvexHull(thinner(solid, 0.002).points).volume == pytest.approx(0.016 * 0.026 * 0.036, rel=1e-6)
    assert thinner(solid, 0.011) is None
    assert convex_solid(read_mesh(write_box(tmp_path / "hollow.obj", BOX, hollow=True))).is_mesh


def test_a_flat_fingertip_is_refused(tmp_path):
    problem = ga.load_problem("allegro_box_3")
    path = tmp_path / "flat.obj"
    path.write_text("v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 3\n")
    urdf = problem.hand.urdf.replace('<sphere radius="0.012" />', f'<mesh filename="{path}"/>')
    with pytest.raises(ga.GraspAtlasError, match="is flat; give it some thickness"):
        CollisionChecker(replace(problem, hand=replace(problem.hand, urdf=urdf)))


def round_mesh(rings, around, radii, dent=0.0):
    """Points and triangles of an ellipsoid [m], with a dent at one end."""
    u = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    v = np.linspace(0.0, np.pi, rings + 2)[1:-1]
    ring = np.stack([np.outer(np.sin(v), np.cos(u)), np.outer(np.sin(v), np.sin(u))], axis=-1)
    height = np.cos(v) * np.where(v < 0.5, 1.0 - dent, 1.0)
    points = np.concatenate([ring, np.broadcast_to(height[:, None, None], (rings, around, 1))], axis=-1).reshape(-1, 3)
    points = np.vstack([points, [0.0, 0.0, 1.0 - dent], [0.0, 0.0, -1.0]]) * radii
    i = np.arange(rings * around).reshape(rings, around)
    j = np.roll(i, -1, axis=1)
    top, bottom = np.full(around, rings * around), np.full(around, rings * around + 1)
    faces = [(i[:-1], i[1:], j[:-1]), (j[:-1], i[1:], j[1:]), (top, i[0], j[0]), (bottom, j[-1], i[-1])]
    return points, np.vstack([np.stack([c.ravel() for c in corners], axis=1) for corners in faces]).astype(np.int32)


def write_stl(path, points, triangles):
    rows = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = points[triangles]
    path.write_bytes(b" " * 80 + len(triangles).to_bytes(4, "little") + rows.tobytes())
    return str(path)


def distance_by_coal(points, hull):
    """Largest distance of points from a convex solid [m]."""
    corners = coal.StdVec_Vec3s()
    for corner in hull:
        corners.append(corner)
    solid, request = coal.Convex.convexHull(corners, True, "Qt"), coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    return max(
        coal.distance(
            coal.Sphere(0.0), coal.Transform3s(np.eye(3), p), solid, coal.Transform3s(), request, coal.DistanceResult()
        )
        for p in points
    )


@pytest.mark.parametrize("radii", [(0.01, 0.01, 0.01), (0.008, 0.012, 0.025), (0.03, 0.02, 0.001)])
def test_a_hull_of_6000_corners_is_thinned(radii):
    points, triangles = round_mesh(60, 100, radii)
    assert len(ConvexHull(points).vertices) == 6002
    solid = convex_solid(Shape("mesh", points=points, triangles=triangles))
    assert solid.kind == "convex"
    assert len(solid.points) < 1500
    assert 0.0 < solid.error <= 1e-4
    assert distance_by_coal(points, solid.points) == pytest.approx(solid.error, abs=1e-7)


def test_hulls_of_few_corners_stay_as_they_are():
    points, triangles = round_mesh(10, 20, (0.01, 0.01, 0.01))
    solid = convex_solid(Shape("mesh", points=points, triangles=triangles))
    assert solid.error == 0.0
    assert {tuple(p) for p in solid.points} == {tuple(p) for p in points}


def test_a_needle_is_thinned_by_distance_not_by_height():
    """Beyond a sharp edge points are much farther from the hull than they are above its faces."""
    points, _ = round_mesh(60, 100, (0.05, 0.0008, 0.0008))
    hull = convex_hull(Shape("mesh", points=points))
    assert distance_by_coal(points, hull.points) <= 1e-4 + 1e-7


@pytest.mark.slow
def test_dents_are_told_from_solids_in_large_meshes_too():
    for rings, around in ((60, 100), (180, 200)):
        for dent, kind in ((0.0, "convex"), (0.2, "mesh")):
            points, triangles = round_mesh(rings, around, (0.01, 0.01, 0.02), dent)
            assert convex_solid(Shape("mesh", points=points, triangles=triangles)).kind == kind


@pytest.mark.slow
def test_fingertips_of_many_corners_collide_as_balls_do(grasps, tmp_path):
    problem, X = grasps
    path = write_stl(tmp_path / "tip.stl", *round_mesh(60, 100, np.full(3, 0.012)))
    sphere = '<sphere radius="0.012" />'
    hand = replace(problem.hand, urdf=problem.hand.urdf.replace(sphere, f'<mesh filename="{path}"/>'))
    fine = replace(problem, hand=hand)
    balls, tips = CollisionChecker(problem), CollisionChecker(fine)
    assert len(tips.thinned) >= 3
    assert max(tips.thinned.values()) <= 1e-4
    inside, outside = (CollisionChecker(problem, touch_depth=0.002 + by).free(X) for by in (-2e-4, 2e-4))
    free = tips.free(X)
    assert (free[inside]).all()
    assert not free[~outside].any()
    gaps = balls.clearances(X[:20]) - tips.clearances(X[:20])
    assert np.abs(gaps[balls.clearances(X[:20]) > 0.0]).max() < 3e-4
    (finding,) = [finding for finding in diagnose(fine, radius=0.5) if finding.subject == "collision hulls"]
    assert finding.mark == OK
    assert finding.text.startswith(f"thinned, to {1000.0 * max(tips.thinned.values()):.2f} mm: link_")
    assert not [finding for finding in diagnose(problem, radius=0.5) if finding.subject == "collision hulls"]


@pytest.mark.slow
def test_a_mesh_of_a_million_faces_is_read_in_seconds(tmp_path):
    path = write_stl(tmp_path / "tip.stl", *round_mesh(700, 720, (0.01, 0.01, 0.02)))
    start = time.process_time()
    solid = convex_solid(read_mesh(path))
    assert time.process_time() - start < 12.0  # of one core; 4 where nothing else runs, 24 with the exact hull
    assert solid.kind == "convex"
    assert solid.error <= 1e-4
