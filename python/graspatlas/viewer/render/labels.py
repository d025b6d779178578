"""Two views of marked bodies side by side, with a label and a line to each mark."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from graspatlas.support.arrays import Array
from graspatlas.viewer.render.picture import painted
from graspatlas.viewer.render.text_images import DARK, GREY, legend_image, text_image
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.marks import Mark, Marked
from graspatlas.viewer.scene.scene import fitted_camera

__all__ = ["draw_marked"]

#: Where the bodies are in each view, which spans -1 to 1: left, right, bottom, top. Labels stand beside them.
WINDOW = (-0.48, 0.48, -0.84, 0.80)
#: Height of letters as shares of the picture's: labels, what stands below them, title, legend.
NAME, DETAIL, TITLE, LEGEND = 0.024, 0.019, 0.028, 0.021
#: Space between labels, as a share of their height, and between them and the edge, as one of the view's width.
SPACE, EDGE = 0.45, 0.02
#: Colour and thickness of the lines, drawn this much larger and then made smaller [pixels].
LINE, THICK, LARGE = (70, 78, 90), 1.4, 3
#: A label is at most this share of the view's width.
WIDEST = 0.24


@dataclass(frozen=True, eq=False)
class _Label:
    """A label's picture, the pixel that it is about, and its own corner."""

    image: Image.Image
    anchor: tuple[float, float]
    left: bool
    y: float = 0.0


def draw_marked(marked: Marked, width: int, height: int) -> Image.Image:
    """The picture of marked bodies, seen from two sides."""
    sheet = Image.new("RGB", (width, height))
    half = width // 2
    for i, direction in enumerate(marked.directions()):
        camera = fitted_camera(marked.points, direction, half / height, WINDOW)
        view = painted(list(marked.parts), camera, half, height)
        _write_labels(view, marked.marks, camera)
        sheet.paste(view, (i * half, 0))
    title = _narrowed(text_image([(marked.title, TITLE * height, DARK)]), width - int(0.04 * width))
    sheet.paste(title, (int(0.02 * width), int(0.025 * height)), title)
    legend = _narrowed(legend_image(list(marked.legend), LEGEND * height), width - int(0.04 * width))
    sheet.paste(legend, ((width - legend.width) // 2, int(height - 1.9 * legend.height)), legend)
    return sheet


def _write_labels(view: Image.Image, marks: Sequence[Mark], camera: Camera) -> None:
    """Labels in two columns beside the bodies, in the order of their marks, and lines between them."""
    width, height = view.size
    seen = camera.project(np.array([mark.point for mark in marks]).reshape(-1, 3), width / height)
    anchors = np.column_stack([(seen[:, 0] + 1.0) * width / 2.0, (1.0 - seen[:, 1]) * height / 2.0])
    middle = float(np.median(anchors[:, 0])) if len(anchors) else 0.0
    order = np.argsort(anchors[:, 0], kind="stable")
    lefts = {int(i) for i in order[: (len(order) + 1) // 2]} if len(order) > 1 else set()
    lefts |= {i for i in range(len(marks)) if len(order) == 1 and anchors[i, 0] <= middle}
    images = [_image(mark, width, height) for mark in marks]
    labels = [_Label(images[i], (float(x), float(y)), i in lefts) for i, (x, y) in enumerate(anchors)]
    for left in (True, False):
        _write_column(view, _spread([label for label in labels if label.left == left], height))


def _image(mark: Mark, width: int, height: int) -> Image.Image:
    lines = [(mark.name, NAME * height, DARK), *([(mark.detail, DETAIL * height, GREY)] if mark.detail else [])]
    return _narrowed(text_image(lines), int(WIDEST * width))


def _narrowed(image: Image.Image, width: int) -> Image.Image:
    """A picture that is no wider than this."""
    if image.width <= width:
        return image
    return image.resize((width, max(1, image.height * width // image.width)), Image.Resampling.LANCZOS)


def _spread(labels: list[_Label], height: int) -> list[_Label]:
    """Labels beside their marks, moved up and down until none covers another."""
    labels = sorted(labels, key=lambda label: label.anchor[1])
    if not labels:
        return []
    tall = np.array([(1.0 + SPACE) * label.image.height for label in labels])
    before = np.concatenate([[0.0], np.cumsum(tall)[:-1]])
    wanted = np.array([label.anchor[1] - label.image.height / 2.0 for label in labels]) - before
    places = _ascending(wanted) + before
    # In the picture all the same: from the top down, and from the bottom up.
    low, high = 0.11 * height + before, 0.9 * height - (before[-1] + tall[-1] - before)
    places = np.maximum(np.minimum(places, high), low)
    return [_Label(label.image, label.anchor, label.left, float(y)) for label, y in zip(labels, places, strict=True)]


def _ascending(values: Array) -> Array:
    """The ascending numbers nearest to some, by least squares: neighbours that descend become their mean."""
    groups: list[list[float]] = []
    for value in values:
        groups.append([float(value)])
        while len(groups) > 1 and np.mean(groups[-2]) > np.mean(groups[-1]):
            last = groups.pop()
            groups[-1] += last
    return np.concatenate([np.full(len(group), np.mean(group)) for group in groups])


def _write_column(view: Image.Image, labels: Sequence[_Label]) -> None:
    width, height = view.size
    lines = Image.new("RGBA", (LARGE * width, LARGE * height), (*LINE, 0))
    pen = ImageDraw.Draw(lines)
    for label in labels:
        x = EDGE * width if label.left else (1.0 - EDGE) * width - label.image.width
        start = (x + label.image.width + 4 if label.left else x - 4, label.y + 0.28 * label.image.height)
        ends = [(LARGE * a, LARGE * b) for a, b in (start, label.anchor)]
        pen.line(ends, fill=(*LINE, 200), width=round(LARGE * THICK))
        view.paste(label.image, (int(x), int(label.y)), label.image)
    thin = lines.resize(view.size, Image.Resampling.LANCZOS)
    view.paste(thin, (0, 0), thin)
