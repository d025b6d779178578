"""Manifolds whose points are known without any atlas: with near sheets, folds, necks, corridors and crossings."""

from __future__ import annotations

import numpy as np

import graspatlas as ga


class Known(ga.System):
    """A hypersurface of which points can be drawn at random, about evenly."""

    x0: np.ndarray

    def points(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Points of the manifold [count, n]."""
        raise NotImplementedError


class Ellipsoid(Known):
    """The sum of (x_i / a_i)^2 is 1: flat ones have two near sheets and a sharp rim."""

    def __init__(self, *axes: float, factor: float = 1.0) -> None:
        super().__init__(len(axes), 1)
        self.axes, self.factor = np.array(axes), factor
        self.x0 = np.eye(len(axes))[0] * axes[0]

    def residual(self, x):
        return [self.factor * (((x / self.axes) ** 2).sum() - 1.0)]

    def jacobian(self, x):
        return self.factor * (2.0 * x / self.axes**2)[None]

    def points(self, count, rng):
        directions = rng.normal(size=(40 * count, len(self.axes)))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        stretch = np.linalg.norm(directions / self.axes, axis=1)  # of the area
        kept = directions[rng.random(len(stretch)) * stretch.max() < stretch]
        assert len(kept) >= count
        return kept[:count] * self.axes


class Shells(Known):
    """Two spheres around one centre, the outer a little larger: only one of them holds x0."""

    def __init__(self, gap: float) -> None:
        super().__init__(3, 1)
        self.squares = 1.0, (1.0 + gap) ** 2
        self.x0 = np.array([0.0, 0.0, 1.0])

    def residual(self, x):
        a, b = self.squares
        return [(x @ x - a) * (x @ x - b)]

    def jacobian(self, x):
        a, b = self.squares
        return (2.0 * x * (2.0 * (x @ x) - a - b))[None]

    def points(self, count, rng):
        x = rng.normal(size=(count, 3))
        return x / np.linalg.norm(x, axis=1, keepdims=True)


class Neck(Known):
    """Two bulbs joined by a neck: the radius round the last axis is (neck + z^2) sqrt(1 - z^2), -1 < z < 1."""

    def __init__(self, neck: float, dimension: int = 2) -> None:
        super().__init__(dimension + 1, 1)
        self.neck = neck
        self.x0 = np.zeros(dimension + 1)
        self.x0[-1] = 1.0

    def squared(self, z):
        return (self.neck + z**2) ** 2 * (1.0 - z**2)

    def residual(self, x):
        return [x[:-1] @ x[:-1] - self.squared(x[-1])]

    def jacobian(self, x):
        z = x[-1]
        slope = 4.0 * z * (self.neck + z**2) * (1.0 - z**2) - 2.0 * z * (self.neck + z**2) ** 2
        return np.append(2.0 * x[:-1], -slope)[None]

    def points(self, count, rng):
        z = rng.uniform(-1.0, 1.0, count)
        around = rng.normal(size=(count, self.configuration_size - 1))
        around *= np.sqrt(self.squared(z))[:, None] / np.linalg.norm(around, axis=1, keepdims=True)
        return np.c_[around, z]


class Rooms(Known):
    """A flat floor z = g(x, y) where z <= 0 leaves two round rooms of radius 1, joined by a corridor.

    The walls are smooth: g is the product of what vanishes at the rooms' walls, less a ridge along the corridor.
    """

    def __init__(self, width: float) -> None:
        super().__init__(3, 1, upper=[np.inf, np.inf, 0.0])
        self.half = width / 2.0
        self.x0 = np.array([-1.5, 0.3, self.height(-1.5, 0.3)])

    def height(self, x, y):
        """Below zero in the rooms round (-1.5, 0) and (1.5, 0) and in the corridor; about a distance."""
        rooms = np.hypot(np.abs(x) - 1.5, y) - 1.0
        corridor = np.maximum(np.sqrt(y**2 + 1e-6) - self.half, np.abs(x) - 1.5)
        sharp = 0.02
        blend = np.clip(0.5 + 0.5 * (corridor - rooms) / sharp, 0.0, 1.0)
        return corridor * (1.0 - blend) + rooms * blend - sharp * blend * (1.0 - blend)

    def residual(self, x):
        return [x[2] - self.height(x[0], x[1])]

    def jacobian(self, x):
        h = 1e-7
        along = (self.height(x[0] + h, x[1]) - self.height(x[0] - h, x[1])) / (2.0 * h)
        across = (self.height(x[0], x[1] + h) - self.height(x[0], x[1] - h)) / (2.0 * h)
        return [[-along, -across, 1.0]]

    def points(self, count, rng):
        x, y = rng.uniform(-2.5, 2.5, 40 * count), rng.uniform(-1.0, 1.0, 40 * count)
        z = self.height(x, y)
        return np.c_[x, y, z][z < 0.0][:count]


class Spiral(Known):
    """A sheet rolled up round the last axes from the middle: its winding angle is the squared distance / pitch."""

    def __init__(self, pitch: float, dimension: int = 2) -> None:
        self.sides = np.array([1.0, 1.0] + [0.3] * (dimension - 1))
        super().__init__(dimension + 1, 1, lower=-self.sides, upper=self.sides)
        self.pitch = pitch
        self.x0 = np.zeros(dimension + 1)

    def residual(self, x):
        angle = (x[0] ** 2 + x[1] ** 2) / self.pitch
        return [x[1] * np.cos(angle) - x[0] * np.sin(angle)]

    def jacobian(self, x):
        angle = (x[0] ** 2 + x[1] ** 2) / self.pitch
        cosine, sine = np.cos(angle), np.sin(angle)
        turned = -2.0 * (x[0] * cosine + x[1] * sine) / self.pitch
        return np.append([turned * x[0] - sine, turned * x[1] + cosine], np.zeros(len(x) - 2))[None]

    def points(self, count, rng):
        distance = rng.uniform(-0.98, 0.98, count)
        angle = distance**2 / self.pitch
        along = rng.uniform(-0.98, 0.98, (count, len(self.x0) - 2)) * self.sides[2:]
        return np.c_[distance * np.cos(angle), distance * np.sin(angle), along]


class Helicoid(Known):
    """A spiral staircase round the z axis, its storeys pi pitch apart."""

    def __init__(self, pitch: float, dimension: int = 2) -> None:
        self.sides = np.array([1.0, 1.0, 0.5] + [0.3] * (dimension - 2))
        super().__init__(dimension + 1, 1, lower=-self.sides, upper=self.sides)
        self.pitch = pitch
        self.x0 = np.zeros(dimension + 1)

    def residual(self, x):
        return [x[0] * np.sin(x[2] / self.pitch) - x[1] * np.cos(x[2] / self.pitch)]

    def jacobian(self, x):
        cosine, sine = np.cos(x[2] / self.pitch), np.sin(x[2] / self.pitch)
        up = (x[0] * cosine + x[1] * sine) / self.pitch
        return np.append([sine, -cosine, up], np.zeros(len(x) - 3))[None]

    def points(self, count, rng):
        distance = rng.uniform(-0.98, 0.98, count)
        along = rng.uniform(-0.98, 0.98, (count, len(self.x0) - 2)) * self.sides[2:]
        angle = along[:, 0] / self.pitch
        return np.c_[distance * np.cos(angle), distance * np.sin(angle), along]


class Crossing(ga.System):
    """Two planes that cross along the z axis, within a box: the Jacobian is zero there."""

    def __init__(self) -> None:
        super().__init__(3, 1, lower=-1.0, upper=1.0)
        self.x0 = np.array([0.5, 0.5, 0.2])

    def residual(self, x):
        return [x[0] ** 2 - x[1] ** 2]

    def jacobian(self, x):
        return [[2.0 * x[0], -2.0 * x[1], 0.0]]


class Cone(ga.System):
    """x^2 + y^2 = z^2 within a box: two halves that meet in a point, where the Jacobian vanishes."""

    def __init__(self) -> None:
        super().__init__(3, 1, lower=-1.0, upper=1.0)
        self.x0 = np.array([0.5, 0.0, 0.5])

    def residual(self, x):
        return [x[0] ** 2 + x[1] ** 2 - x[2] ** 2]

    def jacobian(self, x):
        return [[2.0 * x[0], 2.0 * x[1], -2.0 * x[2]]]


def share_missing(atlas: ga.Atlas, points: np.ndarray) -> float:
    """Share of points that lie more than 0.15 r outside all charts."""
    return float(np.mean([atlas.locate(x)[1] > 0.15 * atlas.radius for x in points]))


def traced(system: Known | Crossing | Cone, radius: float, epsilon: float = 0.5, **limits: float) -> ga.Atlas:
    return ga.build_atlas(system, system.x0, radius=radius, epsilon=epsilon, progress=False, **limits)
