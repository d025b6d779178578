"""Meshes of five things to grasp: a mug, a bottle, a drill, a banana and a book; millimetres are not used, but metres.

Run it with ``python examples/things/make_meshes.py``; it needs ``pip install trimesh manifold3d`` and writes the meshes
beside itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

Array = np.ndarray
#: Corners round a body of revolution.
ROUND = 48


def turned(outline: list[tuple[float, float]]) -> trimesh.Trimesh:
    """A body of revolution about z, from radii and heights of its outline [m]."""
    return trimesh.creation.revolve(np.array(outline), sections=ROUND)


def tube(middle: Array, radii: Array, squash: float = 1.0) -> trimesh.Trimesh:
    """A closed tube round a curve in the plane of x and z.

    Args:
        middle: The curve (n, 3) [m].
        radii: Its radius at each point (n,) [m].
        squash: Its width along y, as a multiple of that in the plane.
    """
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.array([0.0, squash, 0.0])
    angles = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    normals = np.cross(along, [0.0, 1.0, 0.0])
    rings = middle[:, None] + radii[:, None, None] * (
        np.cos(angles)[None, :, None] * normals[:, None] + np.sin(angles)[None, :, None] * across
    )
    n = len(middle)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(ROUND), indexing="ij")
    a, b = ROUND * i + j, ROUND * i + (j + 1) % ROUND
    sides = np.concatenate(
        [np.stack([a, b, b + ROUND], -1).reshape(-1, 3), np.stack([a, b + ROUND, a + ROUND], -1).reshape(-1, 3)]
    )
    first, last = n * ROUND, n * ROUND + 1
    k = np.arange(ROUND)
    caps = np.concatenate(
        [
            np.stack([np.full(ROUND, first), (k + 1) % ROUND, k], -1),
            np.stack([np.full(ROUND, last), (n - 1) * ROUND + k, (n - 1) * ROUND + (k + 1) % ROUND], -1),
        ]
    )
    mesh = trimesh.Trimesh(np.concatenate([rings.reshape(-1, 3), middle[[0, -1]]]), np.concatenate([sides, caps]))
    mesh.fix_normals()
    return mesh


def mug() -> trimesh.Trimesh:
    """A mug of 8 cm across with a handle."""
    outer = turned([(0.0, 0.0), (0.036, 0.0), (0.040, 0.004), (0.040, 0.095), (0.0, 0.095)])
    inner = turned([(0.0, 0.006), (0.036, 0.006), (0.036, 0.12), (0.0, 0.12)])
    t = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 24)
    bow = np.c_[0.037 + 0.032 * np.cos(t), np.zeros_like(t), 0.0475 + 0.032 * np.sin(t)]
    handle = tube(bow, np.full(len(t), 0.0055), 1.3)
    return trimesh.boolean.difference([trimesh.boolean.union([outer, handle]), inner])


def bottle() -> trimesh.Trimesh:
    """A bottle of 6 cm across and 20 cm high, with shoulders and a cap."""
    t = np.linspace(0.0, 1.0, 12)
    shoulder = [(0.030 - 0.018 * (3 * s**2 - 2 * s**3), 0.130 + 0.035 * s) for s in t]
    return turned(
        [
            (0.0, 0.0),
            (0.027, 0.0),
            (0.030, 0.003),
            *shoulder,
            (0.012, 0.175),
            (0.0145, 0.176),
            (0.0145, 0.199),
            (0.0, 0.2),
        ]
    )


def drill() -> trimesh.Trimesh:
    """A thing like a cordless drill: a body with a nose, a grip and a foot."""
    t = np.linspace(-0.06, 0.06, 12)
    body = tube(np.c_[t, np.zeros_like(t), np.zeros_like(t)], np.full(len(t), 0.026))
    t = np.linspace(0.05, 0.105, 8)
    nose = tube(np.c_[t, np.zeros_like(t), np.zeros_like(t)], np.linspace(0.020, 0.010, 8))
    t = np.linspace(0.0, 1.0, 12)
    grip = tube(np.c_[-0.02 - 0.02 * t, np.zeros_like(t), -0.11 * t], np.full(len(t), 0.019), 0.8)
    foot = trimesh.creation.box((0.085, 0.055, 0.022), trimesh.transformations.translation_matrix((-0.03, 0.0, -0.115)))
    return trimesh.boolean.union([body, nose, grip, foot])


def banana() -> trimesh.Trimesh:
    """A curved body that tapers at both ends."""
    t = np.linspace(-0.85, 0.85, 48)
    middle = 0.1 * np.c_[np.sin(t), np.zeros_like(t), np.cos(t) - 1.0]
    return tube(middle, 0.018 * np.sqrt(np.clip(1.0 - (t / 0.88) ** 2, 0.04, 1.0)))


def book() -> trimesh.Trimesh:
    """A book of 15 by 10 by 3 cm."""
    return trimesh.creation.box((0.15, 0.10, 0.03))


def main() -> None:
    """Write all meshes."""
    folder = Path(__file__).parent
    for make in (mug, bottle, drill, banana, book):
        mesh = make()
        assert mesh.is_watertight, make.__name__
        mesh.export(folder / f"{make.__name__}.stl")


if __name__ == "__main__":
    main()
