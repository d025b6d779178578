"""Which links of an MJCF may touch: what MuJoCo leaves out of its contacts, as SRDF."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from graspatlas.hand.mjcf.names import Names
from graspatlas.hand.mjcf.shapes import collides
from graspatlas.support.arrays import Array

if TYPE_CHECKING:
    import mujoco

__all__ = ["allowed_pairs"]

#: Bodies that overlap in all of so many postures do so by the way they are made.
POSTURES = 12


def allowed_pairs(model: mujoco.MjModel, library: Any, bodies: list[int], names: Names, robot: str) -> str:
    """Text of an SRDF with the pairs of links that may touch.

    These are the pairs that the MJCF excludes, bodies and the next ones that carry them, and bodies that overlap in
    each of some postures all over the joints' ranges.

    Args:
        model: The compiled model.
        library: The module ``mujoco``.
        bodies: Numbers of the bodies of the hand, the palm first.
        names: Their names.
        robot: Name of the hand.
    """
    geoms = {b: [g for g in _geoms(model, b) if collides(model, g)] for b in bodies}
    solid = [b for b in bodies if geoms[b]]
    pairs = {(a, b): "Adjacent" for b in solid if (a := _carrier(model, b, set(solid))) is not None}
    for signature in model.exclude_signature:
        a, b = sorted((int(signature) >> 16, int(signature) & 0xFFFF))
        if a in geoms and b in geoms:
            pairs.setdefault((a, b), "Excluded")
    left = [pair for pair in combinations(solid, 2) if pair not in pairs]
    pairs |= dict.fromkeys(_always_overlapping(model, library, geoms, left), "Always")
    root = Element("robot", name=robot)
    for (a, b), reason in sorted(pairs.items()):
        SubElement(root, "disable_collisions", link1=names.bodies[a], link2=names.bodies[b], reason=reason)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode")


def _geoms(model: mujoco.MjModel, body: int) -> range:
    first = int(model.body_geomadr[body])
    return range(first, first + int(model.body_geomnum[body]))


def _carrier(model: mujoco.MjModel, body: int, solid: set[int]) -> int | None:
    """The next body with a collision shape on the way to the palm."""
    while body > 0:
        body = int(model.body_parentid[body])
        if body in solid:
            return body
    return None


def _always_overlapping(
    model: mujoco.MjModel, library: Any, geoms: dict[int, list[int]], pairs: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    data, random = library.MjData(model), np.random.default_rng(0)
    low, high = _ranges(model)
    for posture in range(POSTURES):
        data.qpos[:] = model.qpos0
        if posture:
            places = low + (high - low) * random.random(len(low))
            moving = np.isfinite(places)
            data.qpos[model.jnt_qposadr[moving]] = places[moving]
        library.mj_kinematics(model, data)
        pairs = [
            (a, b)
            for a, b in pairs
            if any(library.mj_geomDistance(model, data, g, h, 1e-3, None) <= 0.0 for g in geoms[a] for h in geoms[b])
        ]
    return pairs


def _ranges(model: mujoco.MjModel) -> tuple[Array, Array]:
    """Limits of all joints, NaN of those that are neither hinges nor slides with a range."""
    ends = np.where(model.jnt_limited.astype(bool)[:, None], model.jnt_range, np.nan)
    return ends[:, 0].astype(float), ends[:, 1].astype(float)
