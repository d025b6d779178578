"""Light: how bright a surface looks from the camera, and what it keeps dark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspatlas import _core
from graspatlas.support.arrays import Array, Float32Array
from graspatlas.viewer.render.raster import nearest
from graspatlas.viewer.scene.camera import Camera

__all__ = ["FloorShadow", "Lamp", "Shadow", "crevices", "lamps", "to_linear"]


#: Pixels of a shadow map along its longer side.
SHADOW_PIXELS = 1100
#: How far apart the points are that make a crevice dark [m].
CREVICE_REACH = (0.003, 0.007, 0.014)
#: How soft its edge is [pixels].
CREVICE_BLUR = 1.5
#: Size of a pixel of the floor's shadow [m].
FLOOR_PIXEL = 0.0015


def to_linear(colour: Array) -> Array:
    """Light intensities of screen colours, both 0 to 1."""
    return np.asarray(np.power(colour, 2.2))


@dataclass(frozen=True)
class Lamp:
    """A lamp far away: unit vector towards it [3], and its intensity."""

    direction: Array
    intensity: float


def lamps(camera: Camera) -> tuple[Lamp, ...]:
    """Key, fill and rim lamp, as a photographer places them about a camera; the key lamp comes first."""
    places = (((-0.55, 0.75, 0.75), 0.78), ((0.9, 0.15, 0.6), 0.26), ((0.35, 0.75, -0.75), 0.32))
    return tuple(Lamp(_unit(np.asarray(place) @ camera.axes), intensity) for place, intensity in places)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))


def crevices(depth: Float32Array, metre: float) -> Float32Array:
    """How much light is lost where surfaces meet: [h, w], 0 to 1.

    A pixel is dark when the pixels on either side of it are nearer; a flat surface, however steep, is not.

    Args:
        depth: Distance from the camera [h, w], metres; infinite where there is nothing.
        metre: Length of a metre in pixels.
    """
    dark = np.zeros_like(depth)
    filled = np.where(np.isfinite(depth), depth, 1e3).astype(np.float32)
    for reach in CREVICE_REACH:
        step = max(1, round(reach * metre))
        padded = np.pad(filled, step, mode="edge")
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            x, y = round(dx * step / np.hypot(dx, dy)), round(dy * step / np.hypot(dx, dy))
            near, far = (_shifted(padded, step, x * sign, y * sign) for sign in (1, -1))
            rise = np.clip(filled - near, -reach, reach) + np.clip(filled - far, -reach, reach)
            dark += np.clip(rise / reach, 0.0, 1.0)
    return np.asarray(_core.blurred(dark / (4 * len(CREVICE_REACH)), CREVICE_BLUR), np.float32)


def _shifted(padded: Float32Array, margin: int, x: int, y: int) -> Float32Array:
    height, width = padded.shape
    return padded[margin + y : height - margin + y, margin + x : width - margin + x]


class Shadow:
    """What one lamp does not reach: a picture of depths, seen from the lamp.

    Args:
        triangles: Corners of everything that throws a shadow [f, 3, 3], metres.
        lamp: The lamp.

    Attributes:
        axes: Right, up and towards the lamp, as rows (3, 3).
        origin: Of the picture in these axes (3,), metres.
        pixel: Size of a pixel [m].
        depths: Along the third axis from the origin, -1 where there is nothing [h, w], metres.
    """

    def __init__(self, triangles: Array, lamp: Lamp) -> None:
        self.axes = Camera(np.zeros(3), lamp.direction, 1.0).axes
        seen = triangles @ self.axes.T
        low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
        self.pixel = float((high - low)[:2].max()) / (SHADOW_PIXELS - 4)
        self.origin = low - 2.0 * self.pixel
        width, height = (int(n) for n in np.ceil((high - low)[:2] / self.pixel) + 4)
        found = nearest((seen - self.origin) / [self.pixel, self.pixel, 1.0], width, height)
        self.depths = np.full((height, width), -1.0, np.float32)
        self.depths.flat[found.pixels] = found.nearness


class FloorShadow:
    """Soft shadow of things that stand on, or hang over, a floor at their lowest point.

    Args:
        triangles: Corners of the things [f, 3, 3], metres; z is up.
    """

    def __init__(self, triangles: Array) -> None:
        margin = 0.15
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        self.height = float(low[2])
        self._origin = low[:2] - margin
        width, depth = (int(np.ceil(n)) for n in ((high - low)[:2] + 2.0 * margin) / FLOOR_PIXEL)
        corners = triangles - [*self._origin, 0.0]
        corners = corners / [FLOOR_PIXEL, FLOOR_PIXEL, -1.0]
        found = nearest(corners, width, depth)
        above = -found.nearness - self.height
        dark = np.zeros((depth, width))
        for weight, reach, blur in ((0.50, 0.012, 0.006), (0.30, 0.05, 0.03)):
            layer = np.zeros(width * depth)
            layer[found.pixels] = np.exp(-above / reach)
            dark += weight * _core.blurred(layer.reshape(depth, width), blur / FLOOR_PIXEL)
        #: How dark the floor is, one pixel each `FLOOR_PIXEL` along y and x [h, w], 0 to 1.
        self.dark = np.clip(dark, 0.0, 1.0)

    @property
    def corners(self) -> tuple[Array, Array]:
        """Lowest and highest corner of the floor that may be dark [3], metres."""
        height, width = self.dark.shape
        low = np.array([*self._origin, self.height])
        size = FLOOR_PIXEL * np.array([width, height, 0.0])
        return low, low + size

    def at(self, points: Array) -> Array:
        """How dark the floor is at points x, y [n, 2]: [n], 0 to 1."""
        column, row = np.floor((points - self._origin) / FLOOR_PIXEL).astype(np.int64).T
        depth, width = self.dark.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < depth)
        dark = np.zeros(len(points))
        dark[inside] = self.dark[row[inside], column[inside]]
        return dark
