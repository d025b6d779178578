"""The shapes of a problem against Pinocchio's own reading of URDF and SRDF."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.collision.problem_shapes import collision_shapes

NAMES = ("allegro_sphere_3", "schunk_can", "gripper_skittle", "three_finger_cup", "planar_hand")


@pytest.mark.parametrize("name", NAMES)
def test_shapes_are_where_pinocchio_has_them(name: str) -> None:
    problem = ga.load_problem(name)
    urdf, folders = problem.hand.tree, list(problem.hand.package_dirs)
    read = pin.buildGeomFromUrdfString(pin.buildModelFromXML(urdf), urdf, pin.COLLISION, package_dirs=folders)
    shapes = collision_shapes(problem)
    expected = {geometry.name: geometry for geometry in read.geometryObjects}
    assert {shape.name for shape in shapes.hand} == set(expected)
    for shape in shapes.hand:
        assert shape.joint == expected[shape.name].parentJoint
        np.testing.assert_allclose(shape.placement, expected[shape.name].placement.homogeneous, atol=1e-12)
    assert len(shapes.object) > 0
    assert {shape.joint for shape in shapes.object} == {0}  # in the object's own frame


@pytest.mark.parametrize("name", NAMES)
def test_pairs_are_those_of_the_checker(name: str) -> None:
    problem = ga.load_problem(name)
    shapes = collision_shapes(problem)
    looked_at = [(shapes.hand[i].name, shapes.hand[j].name) for i, j in shapes.hand_pairs]
    assert looked_at == [pair for pair in CollisionChecker(problem).pairs if not pair[1].startswith("object/")]
    n = len(shapes.hand)
    assert len(shapes.hand_pairs) + len(shapes.ignored) == n * (n - 1) // 2


def test_who_may_touch() -> None:
    problem = ga.load_problem("allegro_sphere_3")
    for srdf in ("", '<robot><disable_collisions link1="link_3.0_tip" link2="link_7.0_tip"/></robot>'):
        shapes = collision_shapes(replace(problem, hand=replace(problem.hand, srdf=srdf)))
        may = {frozenset((shapes.hand[i].link, shapes.hand[j].link)) for i, j in shapes.ignored}
        assert (frozenset(("link_3.0_tip", "link_7.0_tip")) in may) == bool(srdf)
        assert (frozenset(("link_1.0", "link_2.0")) in may) == (not srdf)  # neighbours
        assert frozenset(("link_3.0_tip", "link_3.0")) in may  # of one joint
