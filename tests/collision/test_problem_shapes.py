"""The shapes of a problem against Pinocchio's own reading of URDF and SRDF."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import graspatlas as ga
from graspatlas.collision.checker import CollisionChecker
from graspatlas.collision.problem_shapes import collision_shapes
from graspatlas.problem.object_joint import FREE_FLYER

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


def with_fixed_links(*frames: str) -> Any:
    """A finger whose last joint carries a box, to which a ball is fixed and to that a mere frame; a ball to hold."""
    shapes = {
        "palm": '<box size="0.02 0.02 0.02"/>',
        "distal": '<box size="0.02 0.02 0.02"/>',
        "tip": '<sphere radius="0.01"/>',
        "nail": '<sphere radius="0.002"/>',
    }
    parents = {"palm_frame": "palm", "tip": "distal", "tip_frame": "tip", "nail": "base", "base_frame": "base"}
    places = {"tip": "0 0 0.03", "distal": "0 0 0.1", "nail": "0 0.05 0"}
    turning = {"distal": "palm", "base": "palm"}
    urdf = "".join(
        f"<link name='{link}'>"
        + (f"<collision><geometry>{shapes[link]}</geometry></collision>" if link in shapes else "")
        + "</link>"
        for link in ("palm", *turning, *parents)
    )
    for link, parent in {**turning, **parents}.items():
        urdf += (
            f'<joint name="to_{link}" type="{"revolute" if link in turning else "fixed"}"><parent link="{parent}"/>'
            f'<child link="{link}"/><origin xyz="{places.get(link, "0 0 0")}"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )
    return SimpleNamespace(
        hand=ga.Hand("made", f"<robot name='made'>{urdf}</robot>"),
        object=ga.Body.sphere("ball", 0.02),
        contacts=[SimpleNamespace(frame=frame) for frame in frames],
        object_joint_model=FREE_FLYER,
        obstacles=(),
    )


@pytest.mark.parametrize(
    ("frames", "links"),
    [
        (("tip",), {"tip"}),
        (("distal",), {"distal"}),
        (("tip_frame",), {"tip"}),  # the next link that it is fixed to and that has shapes
        (("palm_frame",), {"palm"}),
        (("palm_frame", "tip", "tip", "tip_frame"), {"palm", "tip"}),
        (("distal", "tip"), {"distal", "tip"}),
        (("base_frame",), {"nail"}),  # none has: all that the joint carries
    ],
)
def test_who_touches(frames: tuple[str, ...], links: set[str]) -> None:
    shapes = collision_shapes(with_fixed_links(*frames))
    assert {shapes.hand[i].link for i in shapes.touching} == links


@pytest.mark.parametrize("frame", ["tip", "tip_frame"])
def test_only_the_link_that_touches_may_sink_in(frame: str) -> None:
    """Not the one that it is fixed to, though both are carried by one joint."""
    checker = CollisionChecker(with_fixed_links(frame))
    above, beside, clear = (
        np.array([0, 0, *xyz, 0, 0, 0, 1]) for xyz in ((0, 0, 0.159), (0.029, 0, 0.1), (0.031, 0, 0.1))
    )
    assert checker.first_collision(above) is None  # the ball's tip in the ball by 1 mm
    assert checker.first_collision(beside) == ("distal_0", "object/ball_0")  # the box in it by 1 mm
    assert checker.first_collision(clear) is None
