"""A picture of the best grasp, or of the best and another, drawn without browser, graphics card or display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from PIL import Image

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, Float32Array
from graspatlas.viewer.render.raster import Fragments, in_front_of, nearest
from graspatlas.viewer.render.shading import FloorShadow, Shadow, crevices, lamps, to_linear
from graspatlas.viewer.render.text_images import GREY, LINE, SMALL, caption_image, legend_image, text_image
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.captions import Caption, caption, scene_legend, subtitle
from graspatlas.viewer.scene.meshes import Mesh
from graspatlas.viewer.scene.scene import SHOW_THROUGH, Part, Scene

__all__ = ["check_size", "draw", "painted"]


#: Smallest picture [pixels].
MIN_WIDTH, MIN_HEIGHT = 320, 180
#: Largest side of a picture [pixels]: each takes a kilobyte while it is drawn.
MAX_SIDE = 8192
#: Widths of the legend and of a caption, as multiples of the height of the caption's title, with room beside them.
LEGEND_LETTERS, CAPTION_LETTERS = 32.0, 20.0
#: Each pixel is the mean of this many by this many.
SAMPLES = 2
#: The background is computed for one in so many samples each way.
COARSE = 4
#: Where the grasps are in the picture, which spans -1 to 1: left, right, bottom, top.
WINDOW = (-0.88, 0.88, -0.54, 0.86)
#: Where captions begin, from the top, as a share of the height.
CAPTION_TOP = 0.782
#: Screen colours of the background, at the top and at the bottom.
BACKGROUND = ((0.985, 0.988, 0.992), (0.855, 0.868, 0.885))
#: Share of the light that the darkest crevice loses.
CREVICE = 0.75
#: How much less see-through a surface is where it is seen edge on.
RIM = 0.75


def check_size(width: int, height: int) -> None:
    """Make sure that a picture of this size has room for its captions.

    Raises:
        GraspAtlasError: If it has not.
    """
    whole = all(isinstance(side, int) and not isinstance(side, bool) for side in (width, height))
    if not whole or width < MIN_WIDTH or height < MIN_HEIGHT or max(width, height) > MAX_SIDE:
        raise GraspAtlasError(
            f"a picture needs at least {MIN_WIDTH} by {MIN_HEIGHT} pixels and at most {MAX_SIDE} a side, "
            f"got {width!r} by {height!r}"
        )


def draw(scene: Scene, width: int, height: int) -> Image.Image:
    """The picture of a scene, with captions."""
    words = [caption(scene.result, exhibit) for exhibit in scene.exhibits]
    size = min(height / 22.0, width / max(LEGEND_LETTERS, CAPTION_LETTERS * len(words)))
    more = (max(w.rows for w in words) - 1) * LINE * SMALL * size  # pixels of lines that captions usually have not
    left, right, bottom, top = WINDOW
    camera = scene.camera(width / height, (left, right, bottom + 2.0 * more / height, top))
    image = painted([part for exhibit in scene.exhibits for part in exhibit.parts], camera, width, height)
    _write_captions(image, scene, camera, words, size, CAPTION_TOP * height - more)
    _write_legend(image, scene, size)
    return image


def painted(parts: list[Part], camera: Camera, width: int, height: int) -> Image.Image:
    """Parts as a camera sees them, without words."""
    painter = _Painter(parts, camera, width * SAMPLES, height * SAMPLES)
    return Image.fromarray(_core.developed(painter.paint(), width, height, SAMPLES))


def _write_captions(
    image: Image.Image, scene: Scene, camera: Camera, words: Sequence[Caption], size: float, top: float
) -> None:
    """Put captions under the grasps, from a row of pixels on."""
    width, height = image.size
    seen = [camera.project(exhibit.points, width / height)[:, 0] for exhibit in scene.exhibits]
    middles = [width * float(x.min() + x.max() + 2.0) / 4.0 for x in seen]
    room = min([*np.diff(middles), 2.0 * middles[0], 2.0 * (width - middles[-1])]) - size
    widest = max(caption_image(w, size).width for w in words)
    for middle, w in zip(middles, words, strict=True):
        text = caption_image(w, size * min(1.0, room / widest))
        image.paste(text, (int(middle - text.width / 2.0), int(top)), text)


def _write_legend(image: Image.Image, scene: Scene, size: float) -> None:
    """Put the legend at the foot and the subtitle at the head."""
    width, height = image.size
    entries, letters = scene_legend(scene), 0.54 * size
    foot = legend_image(entries, letters * min(1.0, 0.96 * width / legend_image(entries, letters).width))
    image.paste(foot, ((width - foot.width) // 2, int(height - 1.72 * letters - 0.5 * foot.height)), foot)
    head = text_image([(subtitle(scene.result), 0.58 * size, GREY)])
    image.paste(head, (int(0.8 * size), int(0.7 * size)), head)


class _Triangles:
    """Triangles of several parts, placed in the world and on the screen."""

    def __init__(self, parts: list[Part], camera: Camera, width: int, height: int) -> None:
        placed = [part.mesh.moved(part.T) for part in parts]
        none = np.zeros((0, 3, 3))
        self.points = np.concatenate([none, *(m.vertices[m.faces] for m in placed)])
        self.normals = np.concatenate([none, *(m.normals[m.faces] for m in placed)]).astype(np.float32)
        owner = np.repeat(np.arange(len(parts)), [len(m.faces) for m in placed])
        colours = np.array([part.colour for part in parts]).reshape(-1, 4)
        self.colours = np.column_stack([to_linear(colours[:, :3]), colours[:, 3]]).astype(np.float32)[owner]
        seen = np.concatenate([none, *(_on_screen(m, camera, width, height)[m.faces] for m in placed)])
        self.screen = seen.reshape(-1, 3, 3)


def _on_screen(mesh: Mesh, camera: Camera, width: int, height: int) -> Array:
    """Vertices of a placed mesh on the screen (n, 3): right and down in pixels, and their nearness [1/m]."""
    seen = camera.project(mesh.vertices, width / height)
    return np.column_stack([(seen[:, 0] + 1.0) * width / 2.0, (1.0 - seen[:, 1]) * height / 2.0, seen[:, 2]])


def _corners(parts: list[Part]) -> Array:
    """Corners of the triangles of parts, placed in the world (f, 3, 3), metres."""
    placed = (part.mesh.moved(part.T) for part in parts)
    return np.concatenate([np.zeros((0, 3, 3)), *(mesh.vertices[mesh.faces] for mesh in placed)])


class _Painter:
    """Paints parts into an array of linear light, from back to front."""

    def __init__(self, parts: list[Part], camera: Camera, width: int, height: int) -> None:
        self.camera, self.width, self.height = camera, width, height
        self.lamps = lamps(camera)
        marks = [p for p in parts if p.group in SHOW_THROUGH]
        bodies = [p for p in parts if p.group in ("hand", "object")]
        self.solid = self._triangles([p for p in parts if p.colour[3] >= 1.0])
        self.clear = self._triangles([p for p in parts if p.colour[3] < 1.0])
        self.marks = self._triangles([replace(p, colour=(*p.colour[:3], SHOW_THROUGH[p.group])) for p in marks])
        self.shadow = Shadow(_corners([p for p in bodies if p.colour[3] >= 1.0]), self.lamps[0])
        self.floor = FloorShadow(_corners(bodies))
        self.nearness = np.zeros(width * height, np.float32)

    def _triangles(self, parts: list[Part]) -> _Triangles:
        return _Triangles(parts, self.camera, self.width, self.height)

    def paint(self) -> Float32Array:
        """Linear light [height * width, 3]."""
        light = self._background()
        found = nearest(self.solid.screen, self.width, self.height)
        light[found.pixels] = self._shaded(self.solid, found, shadow=self.shadow)[0]
        self.nearness[found.pixels] = found.nearness
        self._darken_crevices(light)
        self._paint_clear(light)
        self._paint_marks(light)
        return light

    def _background(self) -> Float32Array:
        """A soft gradient, and the shadow on the floor; smooth, so that few pixels do."""
        rows, columns = self.height // COARSE, self.width // COARSE
        x, y = np.meshgrid(np.linspace(-1.0, 1.0, columns), np.linspace(1.0, -1.0, rows))
        half = np.tan(self.camera.field_of_view / 2.0)
        screen = np.stack([x * half * self.width / self.height, y * half, -np.ones_like(x)], axis=-1)
        rays = screen @ self.camera.axes
        steps = (self.floor.height - self.camera.position[2]) / np.minimum(rays[..., 2:], -1e-9)
        dark = self.floor.at((self.camera.position + steps * rays)[..., :2].reshape(-1, 2))
        top, bottom = (to_linear(np.array(colour)) for colour in BACKGROUND)
        light = top + (bottom - top) * (0.5 - 0.5 * y[..., None]) ** 1.5
        light *= (1.0 - dark.reshape(rows, columns, 1)) * (1.0 - 0.10 * x[..., None] ** 4)
        return np.asarray(_core.enlarged(light, self.width, self.height)).reshape(-1, 3)

    def _shaded(
        self, triangles: _Triangles, found: Fragments, *, shadow: Shadow | None
    ) -> tuple[Float32Array, Float32Array]:
        """Light [n, 3] of fragments, and how squarely they face the camera [n]."""
        return _core.shaded(
            triangles.points,
            triangles.normals,
            triangles.screen[:, :, 2],
            triangles.colours,
            found.triangles,
            found.weights,
            self.camera.position,
            [(lamp.direction, lamp.intensity) for lamp in self.lamps],
            None if shadow is None else (shadow.axes, shadow.origin, shadow.pixel, shadow.depths),
        )

    def _darken_crevices(self, light: Float32Array) -> None:
        near = self.nearness.reshape(self.height, self.width)[::SAMPLES, ::SAMPLES]
        with np.errstate(divide="ignore"):
            depth = 1.0 / near
        metre = near.shape[0] / (2.0 * np.tan(self.camera.field_of_view / 2.0) * self.camera.distance)
        kept = np.where(near > 0.0, 1.0 - CREVICE * crevices(depth, metre), 1.0).astype(np.float32)
        light *= kept.repeat(SAMPLES, axis=0).repeat(SAMPLES, axis=1).reshape(-1, 1)

    def _paint_clear(self, light: Float32Array) -> None:
        """Lay see-through surfaces over what is behind them, the farthest first."""
        found = in_front_of(self.nearness, self.clear.screen, self.width, self.height)
        shaded, facing = self._shaded(self.clear, found, shadow=self.shadow)
        opacity = self.clear.colours[found.triangles, 3]
        opacity = opacity + (1.0 - opacity) * RIM * (1.0 - facing) ** 3
        _core.lay_over(light, found.pixels, opacity, shaded)

    def _paint_marks(self, light: Float32Array) -> None:
        """Let contact points and normals show through what hides them."""
        found = nearest(self.marks.screen, self.width, self.height)
        found = found[found.nearness < self.nearness[found.pixels] - 1e-6]
        shaded = self._shaded(self.marks, found, shadow=None)[0]
        _core.lay_over(light, found.pixels, self.marks.colours[found.triangles, 3], shaded)
