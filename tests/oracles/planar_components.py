"""The connected components of the planar hand's grasps, counted by brute force.

Given a finger's two angles and where it touches its arc, the object's pose is known, and the other two fingers have two
elbows each in closed form. So a grid over these three numbers holds all feasible grasps, and R is where the frozen hand
motion changes its sign between neighbours. No solver, chart or kinematics of the package is used.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from oracles.planar_hand import PlanarHand
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

#: Grid points to a turn. The larger component has a narrow neck: with 120 points it falls in two.
GRID = 160
#: Points of R nearer than this in joint angles belong together [rad]; with 0.15 or 0.4 the count is the same.
LINK = 0.25
#: Elbows turn by more than half a turn from x1, and so may come back with another frozen hand motion.
ELBOWS = (1, 3, 5)
#: How far the other joints may turn [rad].
BASES_REACH = 3.0


def unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def elbows_of(hand: PlanarHand, i: int, center: Array, phi: Array, sign: int) -> tuple[Array, Array]:
    """Both joint angles of finger i [..., 2] that reach the arc's centre, and whether it touches within the arc."""
    upper, lower = hand.lengths[i, 0], hand.lengths[i, 1] + hand.radii[i]
    to = center - hand.anchors[i]
    far = np.linalg.norm(to, axis=-1)
    cosine = (upper**2 + far**2 - lower**2) / (2.0 * upper * far)
    base = np.arctan2(to[..., 1], to[..., 0]) + sign * np.arccos(np.clip(cosine, -1.0, 1.0))
    rest = to - upper * unit(base)
    distal = np.arctan2(rest[..., 1], rest[..., 0])
    off = np.abs(wrapped(distal + np.pi - phi - hand.arcs[i].mean()))
    return np.stack([base, distal - base], axis=-1), (np.abs(cosine) <= 1.0) & (off <= np.ptp(hand.arcs[i]) / 2.0)


def sheets_of(hand: PlanarHand, f: int) -> list[tuple[Array, Array]]:
    """Joint angles from x1 [grid, 6], and where they are those of a feasible grasp: a sheet for each pair of elbows."""
    turn = 2.0 * np.pi * np.arange(GRID) / GRID
    arc = np.linspace(*hand.arcs[f], int(np.ptp(hand.arcs[f]) * GRID / (2.0 * np.pi)) + 2)
    base, distal, u = np.meshgrid(turn, turn + 0.01, arc, indexing="ij")
    phi = distal + np.pi - u
    turned = unit(phi)

    def in_palm(p: Array) -> Array:
        return np.stack([turned @ (p * [1.0, -1.0]), turned @ p[::-1]], axis=-1)

    reach = hand.lengths[f, 1] + hand.radii[f]
    t = hand.anchors[f] + hand.lengths[f, 0] * unit(base) + reach * unit(distal) - in_palm(hand.centers[f])
    others = [i for i in range(3) if i != f]
    found = {(i, s): elbows_of(hand, i, t + in_palm(hand.centers[i]), phi, s) for i in others for s in (1, -1)}
    sheets = []
    for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        angles, feasible = np.empty((*base.shape, 3, 2)), np.ones(base.shape, bool)
        angles[..., f, :] = np.stack([base, distal - base], axis=-1)
        for i, sign in zip(others, signs, strict=True):
            angles[..., i, :] = found[i, sign][0]
            feasible &= found[i, sign][1]
        sheets.append((wrapped(angles - hand.theta_1).reshape(*base.shape, 6), feasible))
    return sheets


def crossings(hand: PlanarHand, steps: Array, feasible: Array) -> list[Array]:
    """Where the frozen hand motion is zero between neighbours of a sheet, joints that went round included [n, 6]."""
    found = []
    for axis in range(3):
        first = tuple(slice(0, -1) if a == axis else slice(None) for a in range(3))
        second = tuple(slice(1, None) if a == axis else slice(None) for a in range(3))
        both = feasible[first] & feasible[second]
        start = steps[first][both]
        change = wrapped(steps[second][both] - start)
        near = np.abs(change).max(axis=1) < 1.0
        start, change = start[near], change[near]
        before, slope = start @ hand.frozen, change @ hand.frozen
        for rounds in np.ndindex(3, 3, 3):
            turns = np.zeros(6)
            turns[list(ELBOWS)] = 2.0 * np.pi * (np.array(rounds) - 1)
            g = before + turns @ hand.frozen
            hit = g * (g + slope) <= 0.0
            found.append(start[hit] + turns - (g[hit] / slope[hit])[:, None] * change[hit])
    return found


def count_components(hand: PlanarHand) -> list[Array]:
    """Points of each component of R by joint angles from x1 [n, 6]; of those that come within half a turn of x1."""
    sheets = [sheet for f in range(3) for sheet in sheets_of(hand, f)]
    points = np.concatenate([part for sheet in sheets for part in crossings(hand, *sheet)])
    assert np.abs(points[:, ::2]).max() < BASES_REACH
    pairs = cKDTree(points).query_pairs(LINK, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    n, label = connected_components(graph, directed=False)
    components = [points[label == i] for i in range(n)]
    return [c for c in components if (np.abs(c).max(axis=1) <= np.pi).any()]
