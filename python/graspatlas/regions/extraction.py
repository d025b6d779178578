"""Planes and round surfaces that a piece of surface holds beside other things."""

from __future__ import annotations

import numpy as np

from graspatlas.regions.covering import FILLED_PART, filled
from graspatlas.regions.fitting import Samples, fitted_flat, fitted_round, lying_on, rough_round
from graspatlas.regions.sampling import connected, neighbours
from graspatlas.regions.surfaces import Surface
from graspatlas.support.arrays import Array, BoolArray, IntArray

__all__ = ["extracted"]

#: Fewest and most places at which surfaces are tried, as many as there is room for regions, and the shares of the
#: samples that are their surroundings.
SEEDS, SURROUNDINGS = (6, 20), (0.02, 0.06, 0.18)
#: Normals of the surroundings make at most this angle with the seed's, in cosines: 70 degrees.
FACING = 0.34
#: Kinds of round surfaces that are tried, the simplest first.
KINDS = ("cylinder", "sphere", "cone", "torus", "revolution")
#: How many of these are tried on the surroundings of seeds; the others on all samples.
LOCAL = 3
#: Candidates of each kind that are fitted to all that lies on them, and the share of the best that these have.
SHORT_LIST, PROMISING = 3, 0.5
#: A surface is really there when this share of what lies within the tolerance lies within half of it.
GENUINE = 0.8
#: A simpler surface is taken if it has this share of what the largest one has.
NEARLY = 0.9
#: Fewest samples of a surface.
FEWEST = 25
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
    seeds = int(np.clip(1.0 / least, *SEEDS))
    rest, candidates, fresh = samples, _candidates(samples, tolerance, seeds), True
    least_count = max(least * len(samples), FEWEST)
    while len(found) < MOST and len(rest) > least_count:
        best = _largest(rest, candidates, tolerance, least_count)
        if best is None:
            if fresh:
                break
            candidates, fresh = _candidates(rest, tolerance, seeds), True
            continue
        fresh = False
        surface, inside = best
        found.append(surface)
        rest = rest[~inside]
    return found


def _largest(
    samples: Samples, candidates: list[tuple[int, Surface]], tolerance: float, least: float
) -> tuple[Surface, BoolArray] | None:
    """The largest genuine surface among the samples, or a simpler one nearly as large, and its samples."""
    pairs = neighbours(samples)
    rated = [(int(lying_on(s, samples, tolerance).sum()), kind, s) for kind, s in candidates]
    enough = max(least, PROMISING * max(count for count, _, _ in rated))
    rated = sorted((item for item in rated if item[0] >= enough), key=lambda item: -item[0])
    final = []
    for number in range(len(KINDS) + 1):
        for _, _, surface in [item for item in rated if item[1] == number][:SHORT_LIST]:
            settled = _settled(number, surface, samples, pairs, tolerance)
            if settled is not None and settled[1].sum() >= least:
                final.append((number, *settled))
    if not final:
        return None
    most = max(int(inside.sum()) for _, _, inside in final)
    large = [item for item in final if item[2].sum() >= NEARLY * most]
    simplest = min(number for number, _, _ in large)
    number, surface, inside = max((item for item in large if item[0] == simplest), key=lambda item: int(item[2].sum()))
    if number > 0:
        better = fitted_round(KINDS[number - 1], samples[inside], tolerance)
        if better is not None:
            again = connected(lying_on(better, samples, tolerance), pairs)
            surface, inside = (better, again) if again.sum() >= inside.sum() else (surface, inside)
    return surface, inside


def _candidates(samples: Samples, tolerance: float, seeds: int) -> list[tuple[int, Surface]]:
    """Surfaces that are tried, with the number of their kind, 0 for planes."""
    return [*_of_surroundings(samples, seeds), *_of_all(samples, tolerance)]


def _of_surroundings(samples: Samples, seeds: int) -> list[tuple[int, Surface]]:
    """Surfaces of the surroundings of seeds."""
    from scipy.spatial import cKDTree  # slow to import

    features = np.column_stack([2.0 * samples.points / max(samples.size, 1e-12), samples.normals])
    tree = cKDTree(samples.points)
    found: list[tuple[int, Surface]] = []
    for seed in _far_apart(features, seeds):
        for share in SURROUNDINGS:
            count = min(max(15, round(share * len(samples))), len(samples))
            near = np.atleast_1d(tree.query(samples.points[seed], count)[1])
            near = near[samples.normals[near] @ samples.normals[seed] > FACING]
            if len(near) < 8:
                continue
            part = samples[near]
            found.append((0, fitted_flat(part)))
            rounds = ((number, rough_round(kind, part)) for number, kind in enumerate(KINDS[:LOCAL], 1))
            found += [(number, surface) for number, surface in rounds if surface is not None]
    return found


def _of_all(samples: Samples, tolerance: float) -> list[tuple[int, Surface]]:
    """Surfaces of all samples, without those far off a first fit."""
    rounds = (
        (number, fitted_round(kind, samples, tolerance)) for number, kind in enumerate(KINDS, 1) if number > LOCAL
    )
    return [(number, surface) for number, surface in rounds if surface is not None]


def _far_apart(features: Array, count: int) -> list[int]:
    """Rows far from one another: each is the farthest from those before."""
    chosen = [int(np.argmin(((features - features.mean(axis=0)) ** 2).sum(axis=1)))]
    gaps = np.full(len(features), np.inf)
    while len(chosen) < min(count, len(features)):
        gaps = np.minimum(gaps, ((features - features[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(gaps)))
    return chosen


def _settled(
    number: int, surface: Surface, samples: Samples, pairs: IntArray, tolerance: float
) -> tuple[Surface, BoolArray] | None:
    """A surface fitted to all that lies on it and hangs together, and its samples; None if it is not genuine."""
    inside = connected(lying_on(surface, samples, tolerance), pairs)
    for _ in range(2):
        if inside.sum() < FEWEST:
            return None
        part = samples[inside]
        again = fitted_flat(part) if number == 0 else rough_round(KINDS[number - 1], part, surface)
        if again is None:
            return None
        surface, inside = again, connected(lying_on(again, samples, tolerance), pairs)
    if inside.sum() < FEWEST:
        return None
    points = samples.points[inside]
    if np.mean(np.abs(surface.distances(points)) <= 0.5 * tolerance) < GENUINE:
        return None
    return (surface, inside) if number == 0 or filled(surface, points) >= FILLED_PART else None
