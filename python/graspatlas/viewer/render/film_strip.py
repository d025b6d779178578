"""A path as a strip of pictures, drawn without browser, graphics card or display."""

from __future__ import annotations

from dataclasses import dataclass

from PIL import Image

from graspatlas.support.progress import counted
from graspatlas.viewer.render.picture import painted
from graspatlas.viewer.render.text_images import DARK, GREY, legend_image, text_image
from graspatlas.viewer.scene.animation import Film
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.captions import film_title, index_name, legend

__all__ = ["FRAMES", "draw_strip"]

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
        picture = painted(film.frame(i), best.camera, best.wide, best.high)
        words = _words(film, i, min(best.high / 15.0, best.wide / 13.0))
        picture.paste(words, ((best.wide - words.width) // 2, int(WORDS * best.high) - words.height // 2), words)
        sheet.paste(picture, (column * (best.wide + SEAM), head + row * (best.high + SEAM)))
    title = text_image([(film_title(film.path), 0.52 * head, GREY)])
    sheet.paste(title, (int(0.4 * head), (head - title.height) // 2), title)
    colours = legend_image(legend()[:2], 0.5 * foot)
    sheet.paste(colours, ((width - colours.width) // 2, height - (foot + colours.height) // 2), colours)
    return sheet


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

    @property
    def magnification(self) -> float:
        """Size of the hand in pixels, but for a factor."""
        return self.high / self.camera.distance


def _words(film: Film, frame: int, size: float) -> Image.Image:
    """What is written below a frame."""
    path, point = film.path, int(film.points[frame])
    name = "start" if point == 0 else "end" if point == len(path) - 1 else f"point {point}"
    lines = [(f"{name}, at {path.arc_length[point]:.2f} of {path.length:.2f}", size, DARK)]
    if path.knows_quality:
        lines.append((f"{index_name(path.result)} {path.qualities[point]:.3g}", 0.82 * size, GREY))
    return text_image(lines)
