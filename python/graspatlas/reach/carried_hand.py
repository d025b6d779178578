"""An arm and the hand that it carries as one mechanism, with their collision shapes in one scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from graspatlas import _core
from graspatlas.collision.always_touching import with_touching_links_allowed
from graspatlas.collision.checker import OBJECT, OBSTACLE
from graspatlas.collision.problem_shapes import body_shapes, may_touch, obstacle_shapes
from graspatlas.hand.urdf import root_link
from graspatlas.numerics.rotations import rpy_from_matrix

if TYPE_CHECKING:
    from graspatlas.collision.shapes import Shape
    from graspatlas.hand.hand import Hand
    from graspatlas.problem.problem import Problem
    from graspatlas.support.arrays import Array, Int32Array
    from graspatlas.world.arm import Arm

__all__ = ["ArmScene", "CarriedHand"]

#: Before the names of the arm's links, joints and shapes, and of the hand's.
ARM, HAND = "arm/", "hand/"


@dataclass(frozen=True, eq=False)
class CarriedHand:
    """The kinematic tree of an arm with a hand at its flange; its root is the arm's base.

    Attributes:
        arm: The arm.
        hand: The hand.
        model: Both as one tree; links and joints have ``arm/`` or ``hand/`` before their names.
    """

    arm: Arm
    hand: Hand
    model: _core.Model

    @classmethod
    def of(cls, arm: Arm, hand: Hand) -> CarriedHand:
        """An arm and a hand, joined."""
        return cls(arm, hand, _core.Model(_joined_tree(arm, hand), "none"))

    @property
    def arm_at(self) -> list[int]:
        """Where the numbers of the arm's configuration stand in that of both [nq of the arm]."""
        return self._places(self.arm.robot, ARM)

    @property
    def hand_at(self) -> list[int]:
        """Where the numbers of the hand's configuration stand in that of both [nq of the hand]."""
        return self._places(self.hand, HAND)

    @property
    def palm(self) -> tuple[int, Array]:
        """The joint that carries the palm, and the palm's placement in it (4, 4)."""
        joint, T = self.model.frames[HAND + root_link(self.hand.tree)]
        return joint, np.asarray(T)

    def carried(self, shapes: tuple[Shape, ...], body: Hand, prefix: str) -> Iterator[Shape]:
        """Shapes of the arm or the hand on the joints of both."""
        numbers = {joint.name: number for number, joint in enumerate(self.model.hand_joints, start=1)}
        root, T_root = self.palm if prefix == HAND else (0, np.eye(4))
        for shape in shapes:
            fixed = shape.joint == 0
            yield replace(
                shape,
                name=prefix + shape.name,
                link=prefix + shape.link,
                joint=root if fixed else numbers[prefix + body.joints[shape.joint - 1]],
                placement=T_root @ shape.placement if fixed else shape.placement,
            )

    def _places(self, body: Hand, prefix: str) -> list[int]:
        starts = {joint.name: joint.q_index for joint in self.model.hand_joints}
        return [starts[prefix + j.name] + i for j in body.model.hand_joints for i in range(j.q_size)]


@dataclass(frozen=True, eq=False)
class ArmScene:
    """The collision shapes of arm, hand, object and obstacles, and the pairs of which the arm is a part.

    Collisions of the hand with itself, the object and obstacles are left to :class:`graspatlas.CollisionFree`. Links of
    the arm may touch that the robot's SRDF lists; without one neighbours may, and those that nearly always do. What is
    fixed to the same joint may touch: the palm and the link of the flange, the base and a table.

    Attributes:
        shapes: The shapes; those of object and obstacles where the object stands in the base's frame.
        pairs: Numbers of the shapes that must keep their distance [p, 2].
        names: Their names (p,).
    """

    shapes: tuple[Shape, ...]
    pairs: Int32Array
    names: tuple[tuple[str, str], ...]

    def required(self, clearance: float) -> Array:
        """Distances that the pairs must keep [p], metres: a clearance, or 0 between links of the arm.

        These are near each other in whatever posture, by construction.
        """
        return np.array([0.0 if second.startswith(ARM) else clearance for _, second in self.names])

    @classmethod
    def of(cls, problem: Problem, both: CarriedHand) -> ArmScene:
        """The scene of a problem and its arm.

        Raises:
            GraspAtlasError: If arm, hand, object or an obstacle has no collision shape, or one cannot be read.
        """
        of_robot, may = _shapes_of_robot(_Same(both.arm.robot))
        of_hand = body_shapes(problem.hand, problem.hand.tree)
        arm = list(both.carried(of_robot, both.arm.robot, ARM))
        around = [*_surroundings(problem, both), *both.carried(of_hand, problem.hand, HAND)]
        # What is in the way of most postures first, and the arm's own links, which take longest, last.
        pairs = []
        for number, shape in enumerate(around, start=len(arm)):
            together = shape.joint if shape.name.startswith((HAND, OBSTACLE)) else -1
            pairs += [(first, number) for first, link in enumerate(arm) if link.joint != together]
        pairs += [pair for pair in combinations(range(len(arm)), 2) if pair not in may]
        shapes = (*arm, *around)
        names = tuple((shapes[a].name, shapes[b].name) for a, b in pairs)
        return cls(shapes, np.array(pairs, np.int32).reshape(-1, 2), names)


class _Same:
    """A robot as a key: the same object, which arms that stand elsewhere share."""

    def __init__(self, robot: Hand) -> None:
        self.robot = robot

    def __hash__(self) -> int:
        return id(self.robot)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.robot is self.robot


@lru_cache(maxsize=4)
def _shapes_of_robot(same: _Same) -> tuple[tuple[Shape, ...], frozenset[tuple[int, int]]]:
    """Shapes of a robot and pairs of their numbers that may touch, of the last ones kept: what takes longest."""
    robot, _ = with_touching_links_allowed(same.robot)
    shapes = body_shapes(robot, robot.tree)
    return shapes, may_touch(shapes, robot)


def _surroundings(problem: Problem, both: CarriedHand) -> Iterator[Shape]:
    """The object and the obstacles, where they are fixed."""
    T_base_object = both.arm.T_base_object
    palm, T_joint_palm = both.palm
    for shape in body_shapes(problem.object, problem.object.urdf):
        yield replace(shape, name=OBJECT + shape.name, joint=0, placement=T_base_object @ shape.placement)
    for obstacle in problem.obstacles:
        for found in obstacle_shapes(obstacle):
            joint, T = (0, T_base_object) if found.on_object else (palm, T_joint_palm)
            name = OBSTACLE + found.shape.name
            yield replace(found.shape, name=name, joint=joint, placement=T @ found.shape.placement)


def _joined_tree(arm: Arm, hand: Hand) -> str:
    """The URDF of an arm with a hand at its flange: links and joints, without shapes."""
    robot = ElementTree.Element("robot", {"name": "arm_with_hand"})
    for text, prefix in ((arm.robot.tree, ARM), (hand.tree, HAND)):
        for element in ElementTree.fromstring(text):
            if element.tag in ("link", "joint"):
                robot.append(_renamed(element, prefix))
    flange = ElementTree.SubElement(robot, "joint", {"name": "flange", "type": "fixed"})
    ElementTree.SubElement(flange, "parent", {"link": ARM + arm.flange})
    ElementTree.SubElement(flange, "child", {"link": HAND + root_link(hand.tree)})
    T = arm.T_flange_palm
    origin = {"xyz": _words(T[:3, 3]), "rpy": _words(rpy_from_matrix(T[:3, :3]))}
    ElementTree.SubElement(flange, "origin", origin)
    return ElementTree.tostring(robot, encoding="unicode")


def _renamed(element: ElementTree.Element, prefix: str) -> ElementTree.Element:
    """A link without its shapes, or a joint without its mimic, with a prefix before its names."""
    out = ElementTree.Element(element.tag, dict(element.attrib, name=prefix + str(element.get("name"))))
    if element.tag == "joint":
        for child in element:
            if child.tag in ("parent", "child"):
                ElementTree.SubElement(out, child.tag, {"link": prefix + str(child.get("link"))})
            elif child.tag in ("origin", "axis", "limit"):
                out.append(child)
    return out


def _words(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
