"""Planes and round surfaces that a piece of surface holds beside other things."""

from __future__ import annotations

import numpy as np

from graspatlas.regions.fitting import SAME_NORMAL, Samples, fitted_flat, fitted_round, rough_round
from graspatlas.regions.sampling import connected, neighbours
from graspatlas.regions.surfaces import Surface
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["extracted"]

#: Places at which surfaces are tried, and the shares of the samples that are their surroundings.
SEEDS, SURROUNDINGS = 20, (0.02, 0.06, 0.18)
#: Normals of the surroundings make at most this angle with the seed's, in cosines: 70 degrees.
FACING = 0.34
#: Kinds of round surfaces that are tried, the simplest first.
KINDS = ("cylinder", "sphere", "cone", "torus", "revolution")
#: How many of these are tried on the surroundings of seeds; the others on all samples.
LOCAL = 3
#: Candidates that are fitted well.
SHORT_LIST = 6
#: A surface is really there when this share of what lies within the tolerance lies within half of it.
GENUINE = 0.8
#: A simpler surface is taken if it has this share of what the largest one has.
NEARLY = 0.9
#: Most surfaces of one piece.
MOST = 16


def extracted(samples: Samples, tolerance: float, least: float) -> list[Surface]:
    """Surfaces that large parts of the samples lie on, the largest first.

    Candidates come from the surroundings of seeds far from one another in place and normal, as in RANSAC but without
    chance; the best are fitted again to all that agrees with them and hangs together.

    Args:
        samples: Points with normals.
        tolerance: Largest distance from a surface [m].
        least: Least share of the samples that a surface has.

    Source: after R. Schnabel, R. Wahl, R. Klein, "Efficient RANSAC for point-cloud shape detection", CGF 26(2), 2007.
    """
    found: list[Surface] = []
    rest = samples
    least_count = max(least * len(samples), 25.0)
    while len(found) < MOST and len(rest) > least_count:
        best = _largest(rest, tolerance, least_count)
        if best is None:
            break
        surface, inside = best
        found.append(surface)
        rest = rest[~inside]
    return found


def _largest(samples: Samples, tolerance: float, least: float) -> tuple[Surface, BoolArray] | None:
    """The largest genuine surface among the samples, or a simpler one nearly as large, and its samples."""
    pairs = neighbours(samples)
    rated = [(int(_inside(s, samples, tolerance).sum()), kind, s) for kind, s in _candidates(samples, tolerance)]
    rated.sort(key=lambda item: -item[0])
    short = [r for kind in range(len(KINDS) + 1) for r in [r for r in rated if r[1] == kind][:SHORT_LIST]]
    short = [item for item in short if item[0] >= least]
    final = []
    for _, kind, surface in short:
        better = _settled(kind, surface, samples, pairs, tolerance)
        if better is not None and better[1].sum() >= least:
            final.append((kind, *better))
    if not final:
        return None
    most = max(int(inside.sum()) for _, _, inside in final)
    large = [item for item in final if item[2].sum() >= NEARLY * most]
    simplest = min(kind for kind, _, _ in large)
    _, surface, inside = max((item for item in large if item[0] == simplest), key=lambda item: int(item[2].sum()))
    return surface, inside


def _candidates(samples: Samples, tolerance: float) -> list[tuple[int, Surface]]:
    """Surfaces of the surroundings of seeds, with the number of their kind, 0 for planes."""
    from scipy.spatial import cKDTree  # slow to import

    features = np.column_stack([2.0 * samples.points / max(samples.size, 1e-12), samples.normals])
    tree = cKDTree(samples.points)
    found: list[tuple[int, Surface]] = []
    for seed in _far_apart(features, SEEDS):
        for share in SURROUNDINGS:
            count = min(max(15, round(share * len(samples))), len(samples))
            near = np.atleast_1d(tree.query(samples.points[seed], count)[1])
            near = near[samples.normals[near] @ samples.normals[seed] > FACING]
            if len(near) < 8:
                continue
            part = samples[near]
            found.append((0, fitted_flat(part)))
            for number, kind in enumerate(KINDS[:LOCAL], 1):
                surface = rough_round(kind, part)
                if surface is not None:
                    found.append((number, surface))
    for number, kind in enumerate(KINDS[LOCAL:], LOCAL + 1):
        surface = fitted_round(kind, samples, tolerance)
        if surface is not None:
            found.append((number, surface))
    return found


def _far_apart(features: Array, count: int) -> list[int]:
    """Rows far from one another: each is the farthest from those before."""
    chosen = [int(np.argmin(((features - features.mean(axis=0)) ** 2).sum(axis=1)))]
    gaps = np.full(len(features), np.inf)
    while len(chosen) < min(count, len(features)):
        gaps = np.minimum(gaps, ((features - features[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(gaps)))
    return chosen


def _inside(surface: Surface, samples: Samples, tolerance: float) -> BoolArray:
    """Which samples lie on a surface, with their normals."""
    near = np.abs(surface.distances(samples.points)) <= tolerance
    cosines = np.einsum("nk,nk->n", surface.normals(samples.points), samples.normals)
    return np.asarray(near & (cosines >= np.cos(SAME_NORMAL)))


def _settled(
    kind: int, surface: Surface, samples: Samples, pairs: IntArray, tolerance: float
) -> tuple[Surface, BoolArray] | None:
    """A surface fitted to all that lies on it and hangs together, and its samples; None if it is not genuine."""
    inside = connected(_inside(surface, samples, tolerance), pairs)
    for _ in range(2):
        if inside.sum() < 20:
            return None
        part = samples[inside]
        again = fitted_flat(part) if kind == 0 else fitted_round(KINDS[kind - 1], part, tolerance)
        if again is None:
            return None
        surface, inside = again, connected(_inside(again, samples, tolerance), pairs)
    close = np.abs(surface.distances(samples.points[inside])) <= 0.5 * tolerance
    return (surface, inside) if inside.any() and close.mean() >= GENUINE else None
