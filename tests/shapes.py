"""Meshes of everyday things, made here: as a designer makes them, and as a scanner sees them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

trimesh = pytest.importorskip("trimesh")

Array = NDArray[np.float64]


def outwards(mesh):
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def tube(path: ArrayLike, radius: ArrayLike, sides: int = 24):
    """A closed tube about a path in the x-z plane."""
    path = np.asarray(path, float)
    radii = np.broadcast_to(radius, len(path))
    tangents = np.gradient(path, axis=0)
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    rings = []
    for place, tangent, r in zip(path, tangents, radii, strict=True):
        across = np.array([0.0, 1.0, 0.0])
        other = np.cross(tangent, across) / np.linalg.norm(tangent)
        rings.append(place + r * (np.outer(np.cos(angles), across) + np.outer(np.sin(angles), other)))
    return outwards(_closed(np.concatenate(rings), len(path), sides, path[0], path[-1]))


def _closed(rings: Array, count: int, sides: int, first: Array, last: Array):
    """Rings of vertices joined, with a fan at either end."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(count - 1), np.arange(sides), indexing="ij"))
    a, b = i * sides + j, i * sides + (j + 1) % sides
    k = np.arange(sides)
    m, end = len(rings), (count - 1) * sides
    faces = [
        np.column_stack([a, b, b + sides]),
        np.column_stack([a, b + sides, a + sides]),
        np.column_stack([np.full(sides, m), (k + 1) % sides, k]),
        np.column_stack([np.full(sides, m + 1), end + k, end + (k + 1) % sides]),
    ]
    return trimesh.Trimesh(np.vstack([rings, first, last]), np.concatenate(faces), process=False)


def can(sections: int = 32):
    """Radius 33 mm, height 120 mm: long thin triangles."""
    return trimesh.creation.cylinder(radius=0.033, height=0.12, sections=sections)


def box(extents: ArrayLike = (0.2, 0.14, 0.05)):
    return trimesh.creation.box(extents)


def book(width: float = 0.15, height: float = 0.21, thickness: float = 0.03):
    """Two covers and a round spine that goes on from them without an edge."""
    a = np.linspace(np.pi / 2, 3 * np.pi / 2, 12)
    round_back = 0.5 * thickness * np.column_stack([np.cos(a), np.sin(a)])
    outline = np.vstack([[width, -thickness / 2], [width, thickness / 2], round_back])
    rings = np.vstack([np.column_stack([outline, np.full(len(outline), z)]) for z in (0.0, height)])
    return outwards(_closed(rings, 2, len(outline), np.array([width / 2, 0, 0]), np.array([width / 2, 0, height])))


def mug():
    """A cylinder with a wall of 4 mm, and a handle that is half a ring."""
    R, h, wall = 0.04, 0.1, 0.004
    outline = np.array([[0, 0], [R, 0], [R, h], [R - wall, h], [R - wall, wall], [0, wall]])
    body = trimesh.creation.revolve(outline, sections=64)
    a = np.linspace(-1.35, 1.35, 30)
    path = np.column_stack([R - 0.006 + 0.03 * np.cos(a), 0.0 * a, h / 2 + 0.03 * np.sin(a)])
    return trimesh.util.concatenate([body, tube(path, 0.006, 16)])


def banana():
    """A tube that bends and tapers."""
    s = np.linspace(-1.0, 1.0, 60)
    path = 0.1 * np.column_stack([np.sin(0.9 * s), 0.0 * s, 1.0 - np.cos(0.9 * s)])
    return tube(path, 0.018 * np.sqrt(np.clip(1.0 - np.abs(s) ** 3, 0.03, 1.0)), 32)


def bottle_outline(z: Array) -> Array:
    return 0.033 - 0.021 / (1.0 + np.exp(-(z - 0.15) / 0.008)) + 0.002 * np.sin(60.0 * z)


def bottle(rings: int = 48, sections: int = 64):
    z = np.linspace(0.0, 0.2, rings)
    outline = np.column_stack([np.r_[0.0, bottle_outline(z), 0.0], np.r_[0.0, z, 0.2]])
    return trimesh.creation.revolve(outline, sections=sections)


def drill():
    """A body, a nose, a slanted handle and a battery, pushed into one another."""
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0))
    body = trimesh.creation.cylinder(radius=0.025, height=0.15, sections=48, transform=turn)
    nose = trimesh.creation.cone(radius=0.02, height=0.05, sections=48, transform=turn)
    nose.apply_translation((0.07, 0, 0))
    s = np.linspace(0.0, 1.0, 20)
    handle = tube(np.column_stack([-0.03 - 0.02 * s, 0.0 * s, -0.015 - 0.11 * s]), 0.016, 32)
    battery = trimesh.creation.box((0.08, 0.06, 0.03))
    battery.apply_translation((-0.05, 0.0, -0.135))
    return trimesh.util.concatenate([body, nose, handle, battery])


def rounded_box(radius: float = 0.01):
    """A box whose edges are round: no crease anywhere."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    corners = np.where(ball.vertices >= 0.0, 1.0, -1.0) * [0.05, 0.035, 0.02]
    return trimesh.Trimesh(ball.vertices + corners, ball.faces, process=False)


def scanned(mesh, edge: float = 0.003, noise: float = 0.0002, seed: int = 0):
    """A mesh as a scanner sees it: small triangles, each corner off by noise."""
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, edge)
    fine = trimesh.Trimesh(vertices, faces, process=False)
    fine.merge_vertices()
    shift = np.random.default_rng(seed).normal(scale=noise, size=fine.vertices.shape)
    return trimesh.Trimesh(fine.vertices + shift, fine.faces, process=False)


def with_turned_faces(mesh, which: ArrayLike):
    faces = np.array(mesh.faces)
    faces[which] = faces[which][:, ::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)
