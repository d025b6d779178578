"""The collision shapes of a problem, and which of them may touch: what a simulator builds the same scene from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from graspatlas.collision.shapes import Shape, convex_solid, read_shapes
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.embedded_meshes import mesh_folders
from graspatlas.hand.mesh_files import check_meshes
from graspatlas.hand.urdf import fixed_parents

if TYPE_CHECKING:
    from graspatlas.hand.body import Body
    from graspatlas.hand.hand import Hand
    from graspatlas.problem.problem import Problem
    from graspatlas.world.obstacle import Obstacle

__all__ = ["CollisionShapes", "ObstacleShape", "body_shapes", "collision_shapes", "may_touch", "obstacle_shapes"]


@dataclass(frozen=True, eq=False)
class ObstacleShape:
    """A shape of an obstacle, and whether that is fixed to the object, or else to the palm."""

    shape: Shape
    on_object: bool


@dataclass(frozen=True, eq=False)
class CollisionShapes:
    """The collision shapes of a hand and an object, meshes that bound a convex solid as that solid.

    Attributes:
        hand: Shapes of the hand, each placed in the frame of the joint that carries it; 0 is the palm.
        object: Shapes of the object, placed in its own frame.
        ignored: Pairs of numbers of ``hand``, the smaller first, that may touch: shapes of one joint, links that the
            SRDF lists, and without an SRDF those of neighbouring joints.
        obstacles: Shapes of the obstacles, placed in the object's frame or the palm's.
        touching_by_contact: Numbers of ``hand`` that touch the object at each contact (m,): the shapes of the link
            that it is stated on. A link without shapes, such as a mere frame, stands for the next one that it is fixed
            to and that has some; where there is none, for all that the same joint carries.
    """

    hand: tuple[Shape, ...]
    object: tuple[Shape, ...]
    obstacles: tuple[ObstacleShape, ...]
    ignored: frozenset[tuple[int, int]]
    touching_by_contact: tuple[frozenset[int], ...]

    @property
    def touching(self) -> frozenset[int]:
        """Numbers of ``hand`` that touch the object at any contact."""
        return frozenset().union(*self.touching_by_contact)

    @property
    def hand_pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of numbers of ``hand``, the smaller first and in order, that must not touch."""
        return tuple(pair for pair in combinations(range(len(self.hand)), 2) if pair not in self.ignored)


def collision_shapes(problem: Problem) -> CollisionShapes:
    """The collision shapes of a problem, those that :class:`graspatlas.CollisionFree` looks at.

    What links with a contact sink into the object by, and the thinner stand-ins that this takes, is left to
    :class:`graspatlas.collision.checker.CollisionChecker`.

    Raises:
        GraspAtlasError: If hand, object or an obstacle has no collision shape, or a mesh or the SRDF cannot be read.
    """
    hand = body_shapes(problem.hand, problem.hand.tree)
    of_object = body_shapes(problem.object, problem.object.urdf)
    touching = tuple(_touching(hand, problem, contact.frame) for contact in problem.contacts)
    obstacles = tuple(shape for obstacle in problem.obstacles for shape in obstacle_shapes(obstacle))
    return CollisionShapes(hand, of_object, obstacles, may_touch(hand, problem.hand), touching)


def obstacle_shapes(obstacle: Obstacle) -> Iterator[ObstacleShape]:
    """Shapes of an obstacle, each named after it."""
    on_object, T = obstacle.frame == "object", obstacle.T_frame_shape
    if obstacle.body is None:
        yield ObstacleShape(Shape("half_space", name=obstacle.name, placement=T), on_object)
        return
    shapes = body_shapes(obstacle.body, obstacle.body.urdf)
    for i, shape in enumerate(shapes):
        name = obstacle.name if len(shapes) == 1 else f"{obstacle.name}_{i}"
        yield ObstacleShape(replace(shape, name=name, placement=T @ shape.placement), on_object)


def body_shapes(body: Body, tree: str) -> tuple[Shape, ...]:
    """Collision shapes of a body, convex meshes as solids."""
    check_meshes(body)
    try:
        shapes = read_shapes(tree, body.urdf, mesh_folders(body))
    except GraspAtlasError as error:
        reason = " ".join(str(error).split())
        raise GraspAtlasError(f"collision shapes of '{body.name}' cannot be read: {reason}") from None
    if not shapes:
        raise GraspAtlasError(f"'{body.name}' has no collision shape; give its URDF <collision> elements")
    return tuple(map(convex_solid, shapes))


def may_touch(shapes: tuple[Shape, ...], hand: Hand) -> frozenset[tuple[int, int]]:
    """Pairs of the hand's shapes that may touch; without an SRDF those of neighbouring joints may."""
    listed = _disabled(hand)
    return frozenset(
        (i, j)
        for (i, a), (j, b) in combinations(enumerate(shapes), 2)
        if a.joint == b.joint
        or (not hand.srdf and (a.parent_joint == b.joint or b.parent_joint == a.joint))
        or frozenset((a.link, b.link)) in listed
    )


def _touching(shapes: tuple[Shape, ...], problem: Problem, frame: str) -> frozenset[int]:
    """Numbers of the hand's shapes that touch where a contact is stated on a frame."""
    held = {shape.link for shape in shapes}
    parents = fixed_parents(problem.hand.tree)
    link: str | None = frame
    while link is not None and link not in held:
        link = parents.get(link)
    joint = problem.hand.frame(frame)[0]
    return frozenset(i for i, s in enumerate(shapes) if (s.joint == joint if link is None else s.link == link))


def _disabled(hand: Hand) -> set[frozenset[str]]:
    """Pairs of links that the hand's SRDF lists."""
    if not hand.srdf:
        return set()
    try:
        elements = ElementTree.fromstring(hand.srdf).iter("disable_collisions")
        return {frozenset((element.attrib["link1"], element.attrib["link2"])) for element in elements}
    except ElementTree.ParseError as error:
        raise GraspAtlasError(f"the SRDF of '{hand.name}' is not XML: {error}") from None
    except KeyError as error:
        raise GraspAtlasError(f"a disable_collisions element in the SRDF of '{hand.name}' has no {error}") from None
