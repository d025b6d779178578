"""Meshes collide as the solids that they bound, and what touches may sink into them as into any other shape."""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
import pytest

import graspatlas as ga
from graspatlas.collision import CollisionChecker
from graspatlas.collision_shapes import convex_solid, is_mesh, thinner
from graspatlas.diagnosis import PROBLEM, diagnose
from graspatlas.urdf import box_urdf, mesh_urdf

BOX = np.array([0.05, 0.05, 0.14])
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
FACES += [(1, 5, 7), (1, 7, 3)]


def write_box(path, size, hollow):
    """A mesh of a box [m]; a hollow one has a cavity, so it is no convex solid."""
    corners, faces = CORNERS * size, list(FACES)
    if hollow:
        corners = np.concatenate([corners, 0.3 * corners])
        faces += [(a + 8, c + 8, b + 8) for a, b, c in FACES]
    rows = ["v {} {} {}\n".format(*corner) for corner in corners]
    path.write_text("".join(rows + ["f {} {} {}\n".format(*(i + 1 for i in face)) for face in faces]))
    return str(path)


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
    "sphere": coal.Sphere(0.01),
    "capsule": coal.Capsule(0.01, 0.04),
    "cylinder": coal.Cylinder(0.01, 0.04),
    "box": coal.Box(0.02, 0.03, 0.04),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_layer_is_taken_off(name):
    shape = SHAPES[name]
    left = thinner(shape, 0.002)
    for direction in np.eye(3):
        outside, inside = (
            coal.distance(
                body, coal.Transform3s(), coal.Sphere(1e-6), at, coal.DistanceRequest(), coal.DistanceResult()
            )
            for body in (shape, left)
            for at in [coal.Transform3s(np.eye(3), 0.1 * direction)]
        )
        assert inside - outside == pytest.approx(0.002, abs=1e-6)
    assert thinner(shape, 0.02) is None


def test_a_convex_solid_gets_thinner(tmp_path):
    path = write_box(tmp_path / "box.obj", np.array([0.02, 0.03, 0.04]), hollow=False)
    mesh = coal.MeshLoader().load(path, np.ones(3))
    assert is_mesh(mesh)
    solid = convex_solid(mesh)
    assert not is_mesh(solid)
    assert thinner(solid, 0.002).computeVolume() == pytest.approx(0.016 * 0.026 * 0.036, rel=1e-6)
    assert thinner(solid, 0.011) is None
    hollow = coal.MeshLoader().load(write_box(tmp_path / "hollow.obj", BOX, hollow=True), np.ones(3))
    assert is_mesh(convex_solid(hollow))


def test_a_flat_fingertip_is_refused(tmp_path):
    problem = ga.load_problem("allegro_box_3")
    path = tmp_path / "flat.obj"
    path.write_text("v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 3\n")
    urdf = problem.hand.urdf.replace('<sphere radius="0.012" />', f'<mesh filename="{path}"/>')
    with pytest.raises(ga.GraspAtlasError, match="is flat; give it some thickness"):
        CollisionChecker(replace(problem, hand=replace(problem.hand, urdf=urdf)))
