"""A film as a strip of pictures, drawn without browser, graphics card or display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from graspatlas.support.progress import counted
from graspatlas.viewer.films.animation import Film, Readout
from graspatlas.viewer.render.picture import painted
from graspatlas.viewer.render.text_images import ALARM, DARK, GREY, legend_image, text_image
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.scene import fitted_camera

__all__ = ["FRAMES", "draw_rows", "draw_strip"]

#: Pictures of a strip.
FRAMES = 6
#: Where the grasps are in each picture, which spans -1 to 1: left, right, bottom, top.
WINDOW = (-0.86, 0.86, -0.60, 0.90)
#: Pixels between pictures, and the colour there.
SEAM, PAPER = 4, (255, 255, 255)
#: Share of the height that the words at the head and at the foot have.
HEAD, FOOT = 0.055, 0.05
#: Where the words are in each picture, from its top.
WORDS = 0.88


def draw_strip(film: Film, width: int, height: int) -> Image.Image:
    """The frames of a film, one picture each, row by row; as many side by side as make them largest."""
    head, foot = int(HEAD * height), int(FOOT * height)
    layouts = [_Layout.of(film, columns, width, height - head - foot) for columns in range(1, len(film) + 1)]
    best = max(layouts, key=lambda layout: layout.magnification)
    sheet = Image.new("RGB", (width, height), PAPER)
    for i in counted(range(len(film)), "picture", "grasps"):
        row, column = divmod(i, best.columns)
        picture = best.picture(film, i)
        sheet.paste(picture, (column * (best.wide + SEAM), head + row * (best.high + SEAM)))
    _write_title(sheet, _titles([film], head, width)[0], head, 0)
    _write_legend(sheet, film, foot)
    return sheet


def draw_rows(films: Sequence[Film], width: int, height: int) -> Image.Image:
    """Films below each other, one picture a frame and one row a film with its title above; seen by one camera."""
    head, foot = int(HEAD * height), int(FOOT * height)
    most = max(len(film) for film in films)
    room = (height - foot) // len(films)
    wide, high = (width - (most - 1) * SEAM) // most, room - head
    points = np.concatenate([film.outline for film in films])
    layout = _Layout(most, wide, high, fitted_camera(points, films[0].direction, wide / high, WINDOW))
    sheet = Image.new("RGB", (width, height), PAPER)
    titles = _titles(films, head, width)
    for row, film in enumerate(films):
        for i in counted(range(len(film)), "picture", "grasps"):
            sheet.paste(layout.picture(film, i), (i * (layout.wide + SEAM), row * room + head))
        _write_title(sheet, titles[row], head, row * room)
    _write_legend(sheet, films[0], foot)
    return sheet


def _titles(films: Sequence[Film], head: int, width: int) -> list[Image.Image]:
    """What stands at the head of each film, in letters of one size, as small as they must be."""
    texts, size = [f"{film.name}: {film.text}" for film in films], 0.52 * head
    widest = max(text_image([(text, size, GREY)]).width for text in texts)
    size *= min(1.0, (width - head) / widest)
    return [text_image([(text, size, GREY)]) for text in texts]


def _write_title(sheet: Image.Image, title: Image.Image, head: int, top: int) -> None:
    sheet.paste(title, (int(0.4 * head), top + (head - title.height) // 2), title)


def _write_legend(sheet: Image.Image, film: Film, foot: int) -> None:
    colours = legend_image(list(film.legend), 0.5 * foot)
    sheet.paste(colours, ((sheet.width - colours.width) // 2, sheet.height - (foot + colours.height) // 2), colours)


@dataclass(frozen=True)
class _Layout:
    """Pictures so many side by side, of one size in pixels, and the camera that fills them."""

    columns: int
    wide: int
    high: int
    camera: Camera

    @classmethod
    def of(cls, film: Film, columns: int, width: int, height: int) -> _Layout:
        """The layout of a film on a sheet of this size."""
        rows = -(-len(film) // columns)
        wide, high = (width - (columns - 1) * SEAM) // columns, (height - (rows - 1) * SEAM) // rows
        return cls(columns, wide, high, film.camera(wide / high, WINDOW))

    def picture(self, film: Film, i: int) -> Image.Image:
        """A frame of the film with the words below it."""
        picture = painted(film.frame(i), self.camera, self.wide, self.high)
        words = _words(film.readouts[i], min(self.high / 15.0, self.wide / 13.0))
        picture.paste(words, ((self.wide - words.width) // 2, int(WORDS * self.high) - words.height // 2), words)
        return picture

    @property
    def magnification(self) -> float:
        """Size of the hand in pixels, but for a factor."""
        return self.high / self.camera.distance


def _words(readout: Readout, size: float) -> Image.Image:
    """What is written below a frame."""
    value = readout.value if readout.value != readout.name else ""
    below = (readout.alarm, 0.82 * size, ALARM) if readout.alarm else (value, 0.82 * size, GREY)
    return text_image([(readout.name, size, DARK), below])
