"""What the viewers show: the best grasp, and another beside it, as coloured meshes, and where to look from."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspatlas.collision.clash import Clash
from graspatlas.collision.hulls import hull_of
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.problem.object_joint import ObjectJoint
from graspatlas.problem.problem import Problem
from graspatlas.requirements.rejections import Rejection
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import Array
from graspatlas.viewer.scene.bodies import FADED, BodyShapes
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.clashing import STRIPES, WIDTH, in_stripes, names_of
from graspatlas.viewer.scene.meshes import Mesh, arrow, ellipsoid, merged
from graspatlas.viewer.scene.velocity_ellipsoid import velocity_ellipsoid
from graspatlas.viewer.scene.viewpoint import Subject, best_direction

__all__ = [
    "COLOURS",
    "SHOW_THROUGH",
    "Colour",
    "Exhibit",
    "Part",
    "Scene",
    "arm_parts",
    "body_parts",
    "clash_of",
    "direction_to",
    "fitted_camera",
    "grasp_parts",
    "levelled",
    "obstacle_parts",
    "outermost",
    "size_of",
    "subject_of",
    "up_of_object",
    "upright_parts",
    "vertices_of",
]

#: Red, green, blue and opacity, each 0 to 1.
Colour = tuple[float, float, float, float]

#: Colours of what is drawn on top of hand and object: red, green, blue, opacity, each 0 to 1.
COLOURS: dict[str, Colour] = {
    "contact": (0.86, 0.03, 0.12, 1.0),
    "normal": (1.0, 0.50, 0.0, 1.0),
    "ellipsoid": (0.56, 0.20, 0.88, 0.24),
    "force": (1.0, 0.50, 0.0, 1.0),
    "push": (0.56, 0.20, 0.88, 1.0),
    "pad": (0.02, 0.50, 0.46, 1.0),
    "object normal": (0.10, 0.30, 0.85, 1.0),
    "clash": (0.06, 0.07, 0.10, 1.0),
}
#: How much of them shows through what hides them.
SHOW_THROUGH = {
    "contact": 0.9,
    "normal": 0.8,
    "ellipsoid": 0.22,
    "force": 0.8,
    "push": 0.7,
    "pad": 0.35,
    "object normal": 0.8,
    "clash": 0.55,
}
#: Sizes of contact points and arrows, and the longest semi-axis that an ellipsoid is drawn with [m].
CONTACT_RADIUS = 0.0042
NORMAL_LENGTH = 0.042
NORMAL_RADIUS = 0.0015
ELLIPSOID_LENGTH = 0.05
#: Flat ellipsoids are drawn this thick, to be seen at all [m].
ELLIPSOID_THICKNESS = 0.0022
#: Steps in which the camera is moved until both grasps fit.
MAX_FRAMING_STEPS = 40
#: Diagonal of the box round hand and object that all sizes here are meant for; others are scaled to it [m].
USUAL_SIZE = 0.32
#: From where planar problems are seen.
FROM_ABOVE = np.array([0.0, -0.45, 1.0])
#: Space between the two grasps [m].
GAP = 0.05


@dataclass(frozen=True, eq=False)
class Part:
    """One mesh of one colour.

    Attributes:
        group: ``hand``, ``object``, ``obstacle``, ``arm``, or what is drawn on top, a name in ``COLOURS``.
        mesh: The mesh; the same one may stand in several parts.
        T: Its placement (4, 4).
        colour: Red, green, blue and opacity, each 0 to 1.
    """

    group: str
    mesh: Mesh
    T: Array
    colour: Colour


@dataclass(frozen=True, eq=False)
class Exhibit:
    """One grasp as it is shown.

    Attributes:
        name: ``best``, ``worst``, ``chart`` for one that was chosen, or ``nearest`` to being accepted.
        grasp: The grasp.
        parts: Its meshes, placed in the world.
        semi_axes: Semi-axes of the object's velocity ellipsoid, longest first (3,), metres a radian.
        rejections: What requirements have against it.
    """

    name: str
    grasp: Grasp
    parts: tuple[Part, ...]
    semi_axes: Array
    rejections: tuple[Rejection, ...] = ()

    @property
    def clash(self) -> Clash | None:
        """The two shapes that collide, where a requirement rejects it for that."""
        return clash_of(self.rejections)

    @cached_property
    def points(self) -> Array:
        """Vertices of hand, object and normals: what must be in the picture (n, 3)."""
        return vertices_of(list(self.parts), ("hand", "object", "normal"))


class Scene:
    """The best grasp on the left, the worst or one that was chosen on the right, seen from one direction.

    Where no grasp is accepted, the one that comes nearest to it stands for the best, and what it lacks is shown: shapes
    that collide in stripes.

    The palm is as in its own frame, unless the object stands on a plane: that one is level then.

    Args:
        result: The result.
        worst: Whether a second grasp is shown: the worst beside the best, or the best beside a chart.
        chart: The chart whose grasp is shown, in place of the worst.
        arm: Whether the arm stands behind the best grasp; by default where that is alone, since it would be in the way.

    Raises:
        GraspAtlasError: If a mesh of the hand or the object cannot be read, or there is no such chart.
    """

    def __init__(
        self, result: GraspAtlas, *, worst: bool = True, chart: int | None = None, arm: bool | None = None
    ) -> None:
        self.result = result
        shapes = BodyShapes(result.problem)
        grasps = _shown(result, worst, chart)
        size = size_of(body_parts(shapes, grasps[0][1]))
        sides, subjects = [], []
        for name, grasp in grasps:
            rejections = result.rejections(grasp.chart) if name in ("chart", "nearest") else ()
            clash = clash_of(rejections)
            parts, semi_axes = upright_parts(shapes, grasp, size, clash)
            sides.append((name, grasp, parts, semi_axes, rejections))
            subjects.append(subject_of(parts, size, clash))
        self.direction = direction_to(subjects, result.problem.object_joint_model)
        if len(sides) == 1 if arm is None else arm:
            sides[0][2].extend(levelled(grasps[0][1], arm_parts(shapes, grasps[0][1])))
        right = Camera(np.zeros(3), self.direction, 1.0).axes[0]
        #: The best first.
        self.exhibits = tuple(
            Exhibit(name, grasp, _side(parts, right, sign, size), semi_axes, rejections)
            for (name, grasp, parts, semi_axes, rejections), sign in zip(sides, (-1.0, 1.0), strict=False)
        )

    def camera(self, aspect: float, window: tuple[float, float, float, float]) -> Camera:
        """Camera that shows all grasps inside a window of its picture.

        Args:
            aspect: Width over height of the picture.
            window: Left, right, bottom and top of the window; the picture spans -1 to 1 both ways.
        """
        points = np.concatenate([exhibit.points for exhibit in self.exhibits])
        return fitted_camera(points, self.direction, aspect, window)


def _shown(result: GraspAtlas, second: bool, chart: int | None) -> list[tuple[str, Grasp]]:
    """The grasps that are shown, and what each is: the best, unless a chart is shown alone, and perhaps another."""
    best = result.refined_best if result.refinement else None if result.nearest else result.best
    if chart is not None:
        chosen = ("chart", result.grasp(chart))
        if best is None or not second:
            return [chosen]
        is_best = not result.refinement and chosen[1].chart == best.chart
        return [("best", best)] if is_best else [("best", best), chosen]
    if best is None:
        assert result.nearest is not None
        return [("nearest", result.nearest)]
    return [("best", best), *([("worst", result.worst)] if second and result.accepted.any() else [])]


def clash_of(rejections: tuple[Rejection, ...]) -> Clash | None:
    """The shapes that collide, where one of the rejections is for that."""
    return next((rejection.clash for rejection in rejections if rejection.clash), None)


def direction_to(subjects: list[Subject], joint: ObjectJoint) -> Array:
    """Unit vector (3,) towards the camera: from above where the object stays in a plane, else where most is seen."""
    return FROM_ABOVE / np.linalg.norm(FROM_ABOVE) if joint.planar else best_direction(subjects)


def fitted_camera(points: Array, direction: Array, aspect: float, window: tuple[float, float, float, float]) -> Camera:
    """Camera that shows points (n, 3) from a direction (3,) in a window of its picture; see :meth:`Scene.camera`."""
    low, high = np.array([window[0], window[2]]), np.array([window[1], window[3]])
    points = outermost(points)
    camera = Camera(points.mean(axis=0), direction, 1.0)
    for _ in range(MAX_FRAMING_STEPS):
        seen = camera.project(points, aspect)[:, :2]
        size = float((np.ptp(seen, axis=0) / (high - low)).max())
        shift = (seen.min(axis=0) + seen.max(axis=0) - size * (low + high)) / 2.0
        half = camera.distance * np.tan(camera.field_of_view / 2.0)
        target = camera.target + half * (shift * [aspect, 1.0]) @ camera.axes[:2]
        camera = Camera(target, direction, camera.distance * size)
        if abs(size - 1.0) < 1e-8 and np.abs(shift).max() < 1e-8:
            break
    return camera


def outermost(points: Array) -> Array:
    """Corners of the convex hull of points (n, 3): what shows these shows all. Points of a plane are all kept."""
    try:
        return np.asarray(points[hull_of(points).corners])
    except GraspAtlasError:
        return points


def body_parts(shapes: BodyShapes, grasp: Grasp, clash: Clash | None = None) -> list[Part]:
    """Hand, object and obstacles of a grasp, in the palm's frame; those faded whose shapes collide."""
    parts = [Part("hand", *shape) for shape in shapes.hand(grasp.q, names_of(clash, "hand"))]
    faded = bool(names_of(clash, "object"))
    for mesh, T, colour in shapes.object():
        parts.append(Part("object", mesh, grasp.T_palm_object @ T, (*colour[:3], FADED) if faded else colour))
    return parts + obstacle_parts(shapes, grasp.T_palm_object, names_of(clash, "obstacle"))


def obstacle_parts(shapes: BodyShapes, T_palm_object: Array, without: Collection[str] = ()) -> list[Part]:
    """The obstacles but those of some names, in the palm's frame, where the object is at a placement (4, 4)."""
    placements = {"object": T_palm_object, "palm": np.eye(4)}
    names = [obstacle.name for obstacle in shapes.problem.obstacles if obstacle.name not in without]
    return [
        Part("obstacle", mesh, T_palm_frame @ T, colour)
        for frame, T_palm_frame in placements.items()
        for mesh, T, colour in shapes.obstacles(frame, names)
    ]


def arm_parts(shapes: BodyShapes, grasp: Grasp) -> list[Part]:
    """The arm that brings the hand to a grasp, in the palm's frame; nothing where there is none, or none is found."""
    return [Part("arm", mesh, T, colour) for mesh, T, colour in shapes.arm(grasp)]


def _clash_parts(shapes: BodyShapes, grasp: Grasp, size: float, clash: Clash) -> list[Part]:
    """Shapes that collide, in stripes, and the point where they do most."""
    hand, placements = grasp.problem.hand, grasp.problem.hand.link_placements(grasp.q)
    carried = {"object": grasp.T_palm_object, "obstacle": grasp.T_palm_object}
    for shape, group in zip(clash.shapes, clash.groups, strict=True):
        if group == "hand":
            carried[f"hand {shape.joint}"] = placements[shape.link] @ np.linalg.inv(hand.frame(shape.link)[1])
    parts = []
    for group, joint, (mesh, T, colour) in in_stripes(clash, shapes, size * WIDTH):
        T_palm_joint = np.eye(4) if joint == 0 else carried[f"hand {joint}" if group == "hand" else group]
        parts.append(Part(group, mesh, T_palm_joint @ T, colour))
    if np.isfinite(clash.point).all():
        T_palm_point = np.eye(4)
        T_palm_point[:3, 3] = clash.point
        ball = ellipsoid(np.full(3, size * CONTACT_RADIUS), 24)
        parts.append(Part("clash", ball, T_palm_point, COLOURS["clash"]))
    return parts


def grasp_parts(
    shapes: BodyShapes, grasp: Grasp, size: float = 1.0, clash: Clash | None = None
) -> tuple[list[Part], Array]:
    """Everything that one grasp is drawn with, in the palm's frame.

    Shapes that collide are drawn in stripes with the point where they are deepest in each other, in place of contacts,
    normals and ellipsoid.

    Args:
        shapes: Meshes of hand and object.
        grasp: The grasp.
        size: Scale of what is drawn on top of hand and object.
        clash: The shapes that collide, if any.

    Returns:
        The parts, and the semi-axes of the velocity ellipsoid, longest first (3,), metres a radian.
    """
    parts = body_parts(shapes, grasp, clash)
    if clash is not None:
        return parts + _clash_parts(shapes, grasp, size, clash), velocity_ellipsoid(grasp)[1]
    ball = ellipsoid(np.full(3, size * CONTACT_RADIUS), 24)
    for point, normal in zip(grasp.contact_points, grasp.contact_normals, strict=True):
        T = np.eye(4)
        T[:3, 3] = point
        parts.append(Part("contact", ball, T, COLOURS["contact"]))
        needle = arrow(point, normal, size * NORMAL_LENGTH, size * NORMAL_RADIUS)
        parts.append(Part("normal", needle, np.eye(4), COLOURS["normal"]))

    axes, semi_axes = velocity_ellipsoid(grasp)
    if semi_axes[0] > 0.0:
        drawn = size * np.maximum(ELLIPSOID_LENGTH * semi_axes / semi_axes[0], ELLIPSOID_THICKNESS)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = axes, grasp.object_xyz
        parts.append(Part("ellipsoid", ellipsoid(drawn), T, COLOURS["ellipsoid"]))
    return parts, semi_axes


def upright_parts(
    shapes: BodyShapes, grasp: Grasp, size: float = 1.0, clash: Clash | None = None
) -> tuple[list[Part], Array]:
    """The parts and semi-axes of :func:`grasp_parts`, with the plane level on which the object stands."""
    parts, semi_axes = grasp_parts(shapes, grasp, size, clash)
    return levelled(grasp, parts), semi_axes


def levelled(grasp: Grasp, parts: list[Part]) -> list[Part]:
    """Parts in the palm's frame, turned until the plane is level on which the object stands."""
    T = _upright(grasp)
    return [Part(p.group, p.mesh, T @ p.T, p.colour) for p in parts]


def up_of_object(problem: Problem) -> Array | None:
    """The normal (3,) of the plane on which the object stands, in the object's frame, if it stands on one."""
    planes = [each for each in problem.obstacles if each.frame == "object" and each.body is None]
    return planes[0].T_frame_shape[:3, 2] if planes else None


def _upright(grasp: Grasp) -> Array:
    """The rotation (4, 4) of the palm's frame that levels the plane on which the object stands."""
    T, normal = np.eye(4), up_of_object(grasp.problem)
    if normal is None:
        return T
    up = grasp.T_palm_object[:3, :3] @ normal
    about, cosine = np.cross(up, (0.0, 0.0, 1.0)), float(up[2])
    if np.linalg.norm(about) < 1e-9:
        T[:3, :3] = np.diag([1.0, np.sign(cosine), np.sign(cosine)])
        return T
    K = np.cross(about, np.eye(3)).T
    T[:3, :3] = np.eye(3) + K + K @ K / (1.0 + cosine)
    return T


def vertices_of(parts: list[Part], groups: tuple[str, ...] = ("hand", "object")) -> Array:
    """All vertices of parts of some groups (n, 3)."""
    return np.concatenate([p.mesh.moved(p.T).vertices for p in parts if p.group in groups])


def size_of(parts: list[Part]) -> float:
    """Size of hand and object compared with that which the scene is made for; 1 when they are about alike."""
    size = float(np.linalg.norm(np.ptp(vertices_of(parts), axis=0))) / USUAL_SIZE
    return 1.0 if 0.6 < size < 1.6 else size


def subject_of(parts: list[Part], size: float, clash: Clash | None = None) -> Subject:
    """What the camera should see; the contacts stand for an object that has no shape.

    Where shapes collide, what it should see are those of hand and object, and where they do most.
    """
    marks = [p for p in parts if p.group in ("contact", "clash")]
    groups = [[p for p in parts if p.group == group] or marks for group in ("hand", "object")]
    if clash is not None:
        bodies = [p for p in parts if p.group in ("hand", "object")]
        groups = [[p for p in bodies if (p.colour in STRIPES) is which] or bodies for which in (False, True)]
    T = np.diag([1.0 / size, 1.0 / size, 1.0 / size, 1.0])
    hand, body = (merged([p.mesh.moved(T @ p.T) for p in group]) for group in groups)
    marked = [T[:3, :3] @ mark.T[:3, 3] for mark in marks] or [body.vertices.mean(axis=0)]
    return Subject.of(hand, body, np.array(marked))


def _side(parts: list[Part], right: Array, sign: float, size: float) -> tuple[Part, ...]:
    """Parts scaled to the usual size and moved along the picture's right axis, half a gap from its middle."""
    reach = float((-sign * (vertices_of(parts) @ right)).max()) / size
    T = np.diag([1.0 / size, 1.0 / size, 1.0 / size, 1.0])
    T[:3, 3] = sign * (reach + GAP / 2.0) * right
    return tuple(Part(p.group, p.mesh, T @ p.T, p.colour) for p in parts)
