"""One grasp in three dimensions on white paper: hand, object, contact points and normals, and the arm behind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspatlas import _core
from graspatlas.grasps.grasp import Grasp
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array, Float32Array
from graspatlas.viewer.render.picture import RIM
from graspatlas.viewer.render.raster import nearest
from graspatlas.viewer.render.shading import Shadow, lamps, to_linear
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.meshes import merged
from graspatlas.viewer.scene.scene import SHOW_THROUGH, Part, arm_parts, levelled, upright_parts
from graspatlas.viewer.scene.viewpoint import Subject, best_direction

__all__ = ["common_direction", "portrait"]


#: Each pixel is the mean of this many by this many.
SAMPLES = 2
#: Share of the picture's smaller side that the grasp fills.
FILLED = 0.96


def common_direction(problem: Problem, grasps: list[Grasp]) -> Array:
    """Unit vector [3] towards a camera that sees the contacts of all these grasps well."""
    shapes = BodyShapes(problem)
    subjects = []
    for grasp in grasps:
        parts = _parts(shapes, grasp)
        hand, body = (merged([p.mesh.moved(p.T) for p in parts if p.group == g]) for g in ("hand", "object"))
        points = np.array([part.T[:3, 3] for part in parts if part.group == "contact"]).reshape(-1, 3)
        subjects.append(Subject.of(hand, body, points))
    return best_direction(subjects)


def portrait(
    problem: Problem, grasp: Grasp, *, direction: Array | None = None, width: int = 600, height: int = 600
) -> NDArray[np.uint8]:
    """A picture of one grasp.

    Args:
        problem: The problem.
        grasp: One of its grasps.
        direction: Unit vector [3] towards the camera, in the palm's frame, turned until the plane is
            level on which the object stands, if it stands on one; the one that sees most by default.
        width: Width in pixels.
        height: Height in pixels.

    Returns:
        Red, green and blue of each pixel [height, width, 3].

    Raises:
        GraspAtlasError: If a mesh cannot be read.
    """
    shapes = BodyShapes(problem)
    parts = _parts(shapes, grasp) + levelled(grasp, arm_parts(shapes, grasp))
    towards = common_direction(problem, [grasp]) if direction is None else np.asarray(direction, float)
    camera = _framed(parts, towards, width / height)
    size = (width * SAMPLES, height * SAMPLES)
    light = np.ones((size[0] * size[1], 3), np.float32)
    front = np.zeros(len(light), np.float32)
    opaque, clear = ([p for p in parts if (p.colour[3] >= 1.0) is solid] for solid in (True, False))
    shadow = Shadow(_corners(opaque), lamps(camera)[0]) if opaque else None
    clear.sort(key=lambda part: camera.project(_corners([part]).reshape(-1, 3), 1.0)[:, 2].max())
    for layer, see_through in ((opaque, False), *(([part], False) for part in clear), (parts, True)):
        _paint(layer, camera, size, light, front, shadow, see_through)
    pixels = _core.developed(light, width, height, SAMPLES)
    background = front.reshape(height, SAMPLES, width, SAMPLES).max(axis=(1, 3)) == 0.0
    pixels[background] = 255
    return pixels


def _parts(shapes: BodyShapes, grasp: Grasp) -> list[Part]:
    return [part for part in upright_parts(shapes, grasp)[0] if part.group != "ellipsoid"]


def _corners(parts: list[Part]) -> Array:
    """Corners of all triangles [f, 3, 3]."""
    return np.concatenate([m.vertices[m.faces] for m in (part.mesh.moved(part.T) for part in parts)])


def _framed(parts: list[Part], direction: Array, aspect: float) -> Camera:
    """Camera that fills its picture with the parts."""
    points = _corners([part for part in parts if part.group not in ("obstacle", "arm")]).reshape(-1, 3)
    camera = Camera(points.mean(axis=0), direction, 1.0)
    for _ in range(30):
        seen = camera.project(points, aspect)[:, :2]
        low, high = seen.min(axis=0), seen.max(axis=0)
        half = camera.distance * np.tan(camera.field_of_view / 2.0)
        target = camera.target + half * ((low + high) / 2.0 * [aspect, 1.0]) @ camera.axes[:2]
        camera = Camera(target, direction, camera.distance * float((high - low).max()) / (2.0 * FILLED))
    return camera


def _paint(
    parts: list[Part],
    camera: Camera,
    size: tuple[int, int],
    light: Float32Array,
    front: Float32Array,
    shadow: Shadow | None,
    see_through: bool,
) -> None:
    """Lay the nearest surface of some parts over the light [pixels, 3]; or let marks shine through what hides them."""
    shown = [p for p in parts if not see_through or p.group in SHOW_THROUGH]
    if not shown:
        return
    placed = [part.mesh.moved(part.T) for part in shown]
    points = np.concatenate([m.vertices[m.faces] for m in placed])
    normals = np.concatenate([m.normals[m.faces] for m in placed])
    owner = np.repeat(np.arange(len(shown)), [len(m.faces) for m in placed])
    seen = camera.project(points.reshape(-1, 3), size[0] / size[1])
    screen = np.column_stack([(seen[:, 0] + 1.0) * size[0] / 2.0, (1.0 - seen[:, 1]) * size[1] / 2.0, seen[:, 2]])
    screen = screen.reshape(-1, 3, 3)
    found = nearest(screen, *size)
    hidden = found.nearness < front[found.pixels]
    found = found[hidden if see_through else ~hidden]
    colours = np.array([(*to_linear(np.array(p.colour[:3])), p.colour[3]) for p in shown])[owner]
    shaded, facing = _core.shaded(
        points,
        normals,
        screen[:, :, 2],
        colours,
        found.triangles,
        found.weights,
        camera.position,
        [(lamp.direction, lamp.intensity) for lamp in lamps(camera)],
        None if shadow is None else (shadow.axes, shadow.origin, shadow.pixel, shadow.depths),
    )
    clear = colours[found.triangles, 3]
    glass = clear + (1.0 - clear) * RIM * (1.0 - facing) ** 3
    opacity = np.array([SHOW_THROUGH.get(p.group, 1.0) for p in shown])[owner[found.triangles]]
    _core.lay_over(light, found.pixels, opacity if see_through else glass, shaded)
    if not see_through:
        front[found.pixels] = np.maximum(front[found.pixels], found.nearness)
