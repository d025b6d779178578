"""Small pictures within a page's text, drawn in a fraction of a second; nothing where one cannot be drawn."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np
from PIL import Image

from graspatlas.atlas.atlas import Atlas
from graspatlas.grasps.grasp import Grasp
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.viewer.notebook.card import picture
from graspatlas.viewer.render.picture import painted
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.marks import marked_problem
from graspatlas.viewer.scene.scene import (
    body_parts,
    direction_to,
    fitted_camera,
    grasp_parts,
    size_of,
    subject_of,
    vertices_of,
)

__all__ = ["picture_of_atlas", "picture_of_grasp", "picture_of_problem"]

#: Size of a picture [pixels].
WIDE, HIGH = 320, 240
#: Where bodies are in it; it spans -1 to 1: left, right, bottom, top.
WINDOW = (-0.92, 0.92, -0.92, 0.92)
#: Of 1 to 100 [JPEG].
SHARPNESS = 85
#: Dots that an atlas is drawn with, at most.
MOST_DOTS = 20_000
#: Pixels of the picture of an atlas are the mean of this many by this many.
SAMPLES = 2
#: Colours of the farthest and of the nearest dot, which stand out on white and on black.
FAR, NEAR = np.array([38.0, 84.0, 140.0]), np.array([92.0, 200.0, 99.0])
#: From where an atlas is seen: right, up and towards the viewer.
VIEW = np.array([[0.80, -0.60, 0.0], [0.24, 0.32, 0.917], [0.55, 0.733, -0.4]])

#: Meshes of problems that are still in use: most cards show grasps of one.
_SHAPES: WeakKeyDictionary[Problem, BodyShapes] = WeakKeyDictionary()


def picture_of_grasp(grasp: Grasp) -> str:
    """An image of hand, object, contact points and normals."""
    return picture(_address(lambda: _grasp(grasp)), f"a grasp of {grasp.problem.name}")


def picture_of_problem(problem: Problem) -> str:
    """An image of hand and object with patches and contacts, before the problem is solved."""
    return picture(_address(lambda: _problem(problem)), f"hand and object of {problem.name}")


def picture_of_atlas(atlas: Atlas) -> str:
    """An image of the charts' centres in three coordinates, the nearer the lighter."""
    return picture(_address(lambda: _atlas(atlas)), f"centres of {atlas.n_charts} charts")


def _address(draw: Callable[[], Image.Image]) -> str:
    """A picture as an address that holds it; empty where it cannot be drawn, since the table stands all the same."""
    try:
        image = draw()
    except Exception:  # whatever a mesh, a library or the machine's memory may be the reason of
        return ""
    stream, kind = io.BytesIO(), "png" if image.mode == "RGBA" else "jpeg"
    image.save(stream, kind.upper(), quality=SHARPNESS)
    return f"data:image/{kind};base64,{base64.b64encode(stream.getvalue()).decode()}"


def _shapes(problem: Problem) -> BodyShapes:
    """Meshes of a problem, read once."""
    if problem not in _SHAPES:
        _SHAPES[problem] = BodyShapes(problem)
    return _SHAPES[problem]


def _grasp(grasp: Grasp) -> Image.Image:
    shapes = _shapes(grasp.problem)
    size = size_of(body_parts(shapes, grasp))
    parts, _ = grasp_parts(shapes, grasp, size)
    direction = direction_to([subject_of(parts, size)], grasp.problem.object_joint_model)
    camera = fitted_camera(vertices_of(parts, ("hand", "object", "normal")), direction, WIDE / HIGH, WINDOW)
    return painted(parts, camera, WIDE, HIGH)


def _problem(problem: Problem) -> Image.Image:
    marked = marked_problem(problem, _shapes(problem))
    camera = fitted_camera(marked.points, marked.directions()[0], WIDE / HIGH, WINDOW)
    return painted(list(marked.parts), camera, WIDE, HIGH)


def _atlas(atlas: Atlas) -> Image.Image:
    step = -(-atlas.n_charts // MOST_DOTS)
    places = np.array([atlas.system.embed(x) for x in atlas.centers[::step]])
    places -= places.mean(axis=0)
    if places.shape[1] > 3:  # principal coordinates, as in the other pictures of an atlas
        _, directions = np.linalg.eigh(places.T @ places)
        places = places @ directions[:, :-4:-1]
    seen = places @ VIEW[:, : places.shape[1]].T
    return _dots(seen[np.argsort(seen[:, 2], kind="stable")])


def _dots(seen: Array) -> Image.Image:
    """Dots at right, up and depth (n, 3), the farthest first, on nothing."""
    wide, high = SAMPLES * WIDE, SAMPLES * HIGH
    radius = int(np.clip(0.3 * high / np.sqrt(len(seen)), 2.0, 12.0))
    low, span = seen.min(axis=0), np.maximum(np.ptp(seen, axis=0), 1e-12)
    scale = min((wide - 4 * radius) / span[0], (high - 4 * radius) / span[1])
    middle = low[:2] + span[:2] / 2.0
    at = (np.array([wide, high]) / 2.0 + (seen[:, :2] - middle) * [scale, -scale]).astype(np.int64)
    dx, dy = np.meshgrid(*2 * [np.arange(-radius, radius + 1)])
    disc = dx**2 + dy**2 <= radius**2
    columns, rows = at[:, :1] + dx[disc], at[:, 1:] + dy[disc]
    near = ((seen[:, 2] - low[2]) / span[2])[:, None]
    colours = np.column_stack([FAR + near * (NEAR - FAR), np.full(len(seen), 255.0)]).astype(np.uint8)
    sheet = np.zeros((high, wide, 4), np.uint8)
    sheet[rows.ravel(), columns.ravel()] = np.repeat(colours, int(disc.sum()), axis=0)
    return Image.fromarray(sheet).resize((WIDE, HIGH), Image.Resampling.BOX)
