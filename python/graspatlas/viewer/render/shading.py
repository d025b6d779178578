"""Light: how bright a surface looks from the camera, and what it keeps dark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from graspatlas.support.arrays import Array, Float32Array
from graspatlas.viewer.render.raster import nearest
from graspatlas.viewer.scene.camera import Camera

__all__ = ["FloorShadow", "Lamp", "Shadow", "crevices", "dots", "lamps", "shade", "to_linear", "to_screen"]


#: Points are lifted off their surface by this much before they are looked up in a shadow [m].
LIFT = 0.0015
#: Pixels of a shadow map along its longer side.
SHADOW_PIXELS = 1100
#: How far apart the points are that make a crevice dark [m].
CREVICE_REACH = (0.003, 0.007, 0.014)
#: Size of a pixel of the floor's shadow [m].
FLOOR_PIXEL = 0.0015


def dots(a: Float32Array, b: Float32Array) -> Float32Array:
    """Dot products of rows [n, 3] and [n, 3]: [n]."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


def to_linear(colour: Array) -> Array:
    """Light intensities of screen colours, both 0 to 1."""
    return np.asarray(np.power(colour, 2.2))


def to_screen(light: Array) -> Array:
    """Screen colours of light intensities; bright light saturates softly."""
    knee = 0.7
    over = np.maximum(light - knee, 0.0)
    soft = np.where(light > knee, knee + (1.0 - knee) * (1.0 - np.exp(-over / (1.0 - knee))), light)
    return np.asarray(np.power(np.maximum(soft, 0.0), 1.0 / 2.2))


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


def shade(
    colour: Float32Array, normals: Float32Array, to_camera: Float32Array, lit: Float32Array, lamps: tuple[Lamp, ...]
) -> Float32Array:
    """Light that surface points send to the camera.

    Args:
        colour: Linear colours [n, 3].
        normals: Unit normals on the camera's side [n, 3].
        to_camera: Unit vectors to the camera [n, 3].
        lit: How much of the key lamp reaches each point [n], 0 to 1.
        lamps: Key, fill and rim lamp.

    Returns:
        Linear light [n, 3].
    """
    facing = np.clip(dots(normals, to_camera), 0.0, 1.0)
    mirrored = 2.0 * facing[:, None] * normals - to_camera
    diffuse = 0.20 + 0.10 * normals[:, 2]
    gloss = np.zeros(len(colour), np.float32)
    for lamp in lamps:
        share = lit if lamp is lamps[0] else 1.0
        direction = lamp.direction.astype(np.float32)
        diffuse += lamp.intensity * share * np.maximum(normals @ direction, 0.0)
        gloss += lamp.intensity * share * _softbox(np.asarray(mirrored @ direction, np.float32))
    fresnel = 0.04 + 0.5 * (1.0 - facing) ** 5
    surroundings = 0.55 + 0.35 * mirrored[:, 2]
    shine = 0.42 * gloss + fresnel * surroundings
    return np.asarray(colour * diffuse[:, None] * (1.0 - 0.5 * fresnel[:, None]) + shine[:, None], np.float32)


def _softbox(cosine: Float32Array) -> Float32Array:
    """Mirror image of a lamp with a soft edge and a wide faint halo."""
    near = np.clip((cosine - 0.90) / 0.08, 0.0, 1.0)
    halo = np.maximum(cosine, 0.0) ** 12
    return np.asarray(0.55 * near * near * (3.0 - 2.0 * near) + 0.18 * halo, np.float32)


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
    return np.asarray(gaussian_filter(dark / (4 * len(CREVICE_REACH)), 1.5), np.float32)


def _shifted(padded: Float32Array, margin: int, x: int, y: int) -> Float32Array:
    height, width = padded.shape
    return padded[margin + y : height - margin + y, margin + x : width - margin + x]


class Shadow:
    """What one lamp does not reach.

    Args:
        triangles: Corners of everything that throws a shadow [f, 3, 3], metres.
        lamp: The lamp.
    """

    def __init__(self, triangles: Array, lamp: Lamp) -> None:
        self._axes = Camera(np.zeros(3), lamp.direction, 1.0).axes
        seen = triangles @ self._axes.T
        low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
        self._pixel = float((high - low)[:2].max()) / (SHADOW_PIXELS - 4)
        self._origin = low - 2.0 * self._pixel
        self._size = np.ceil((high - low)[:2] / self._pixel).astype(int) + 4
        corners = (seen - self._origin) / [self._pixel, self._pixel, 1.0]
        width, height = (int(s) for s in self._size)
        found = nearest(corners, width, height)
        self._map = np.full(width * height, -1.0, np.float32)
        self._map[found.pixels] = found.nearness

    def lit(self, points: Float32Array, normals: Float32Array) -> Float32Array:
        """How much of the lamp reaches points [n, 3] with unit normals [n, 3]: [n], 0 to 1, with a soft edge."""
        raised = (points + LIFT * normals) @ self._axes.T.astype(np.float32) - self._origin
        x, y = raised[:, 0] / self._pixel, raised[:, 1] / self._pixel
        width, height = self._size
        total = np.zeros(len(points), np.float32)
        taps = [(dx, dy) for dx in (-1.7, 0.0, 1.7) for dy in (-1.7, 0.0, 1.7)]
        for dx, dy in taps:
            column = np.clip((x + dx).astype(np.int64), 0, width - 1)
            row = np.clip((y + dy).astype(np.int64), 0, height - 1)
            total += self._map[row * width + column] < raised[:, 2]
        return np.asarray(total / len(taps), np.float32)


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
            dark += weight * gaussian_filter(layer.reshape(depth, width), blur / FLOOR_PIXEL)
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
