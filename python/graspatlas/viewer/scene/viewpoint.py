"""From where the object and the contacts are seen best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas.support.arrays import Array, IntArray
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.meshes import Mesh

__all__ = ["Subject", "best_direction"]

#: Directions that are tried: round the palm's z axis, and above its horizon [rad].
AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 12.0))
ELEVATIONS = np.radians([12.0, 22.0, 34.0])
#: Points that stand for the surface of hand and object, and the cell in which a point hides others [m].
SAMPLES = 5000
CELL = 0.005
#: A point this far behind another is hidden by it [m].
BEHIND = 0.008
#: What a visible contact counts, compared with a visible object.
CONTACT_WEIGHT = 0.6


@dataclass(frozen=True, eq=False)
class Subject:
    """What shall be seen of one grasp, in the palm's frame.

    Attributes:
        hand: Points of the hand's surface (n, 3), metres.
        object: Points of the object's surface (m, 3).
        object_normals: Its unit normals there (m, 3).
        contacts: Contact points (c, 3).
    """

    hand: Array
    object: Array
    object_normals: Array
    contacts: Array

    @classmethod
    def of(cls, hand: Mesh, body: Mesh, contacts: Array) -> Subject:
        """The subject of a hand and an object in place, and contact points (c, 3)."""
        points, normals = _spread(body)
        return cls(_spread(hand)[0], points, normals, contacts)


def best_direction(subjects: Sequence[Subject]) -> Array:
    """Unit vector (3,) towards the camera that sees most of the objects and of the contacts of all subjects."""
    directions = [
        np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)]) for e in ELEVATIONS for a in AZIMUTHS
    ]

    seen = np.array([[_visible(subject, direction) for subject in subjects] for direction in directions])
    value = (seen / np.maximum(seen.max(axis=0), 1e-12)) @ [1.0, CONTACT_WEIGHT]  # (directions, subjects)
    return directions[int(np.argmax(value.min(axis=1) + value.mean(axis=1)))]


def _visible(subject: Subject, direction: Array) -> tuple[float, float]:
    """Size of the object's outline that no part of the hand hides, and share of contacts that nothing hides."""
    axes = Camera(np.zeros(3), direction, 1.0).axes
    hand, body, contacts = (points @ axes.T for points in (subject.hand, subject.object, subject.contacts))
    low = np.minimum(hand.min(axis=0), body.min(axis=0))[:2] - 2.0 * CELL
    size = ((np.maximum(hand.max(axis=0), body.max(axis=0))[:2] - low) / CELL).astype(int) + 3
    front = np.full(size[0] * size[1], -np.inf)

    def cells(points: Array) -> IntArray:
        column, row = ((points[:, :2] - low) / CELL).astype(np.int64).T
        return np.asarray(column * size[1] + row)

    np.maximum.at(front, cells(hand), hand[:, 2])
    turned = subject.object_normals @ direction
    clear = front[cells(body)] < body[:, 2] + BEHIND
    outline = np.maximum(turned, 0.0)
    shown = float(outline[clear].sum())
    np.maximum.at(front, cells(body), body[:, 2])
    touching = front[cells(contacts)] < contacts[:, 2] + BEHIND
    return shown, float(touching.mean())


def _spread(mesh: Mesh) -> tuple[Array, Array]:
    """Points spread evenly over a surface (SAMPLES, 3), and its unit normals there; the same ones each time."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    random = np.random.default_rng(0)
    faces = random.choice(len(areas), SAMPLES, p=areas / areas.sum())
    u, v = random.random((2, SAMPLES, 1))
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u), np.where(folded, 1.0 - v, v)
    a, b, c = (corners[faces, k] for k in range(3))
    return a + u * (b - a) + v * (c - a), normals[faces] / areas[faces, None]
