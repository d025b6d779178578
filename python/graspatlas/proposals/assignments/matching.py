"""Which assignments of fingertips to regions some posture of the hand could bring about, and where to start from.

What contact points and their normals look like from one another, distances and angles, is the same in the palm's frame
and in the object's. So postures in which the pads could hold anything at all are compared with points that are drawn on
the regions: the nearer the nearest two are to each other, the more likely the assignment has grasps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from graspatlas.proposals.assignments.closure import imbalance
from graspatlas.proposals.assignments.fingers import Fingers
from graspatlas.proposals.assignments.planes import Planes
from graspatlas.regions.region import Region
from graspatlas.support.arrays import Array
from graspatlas.support.words import Word

__all__ = ["Assignment", "Counts", "assignments_of"]

#: Postures that are drawn, and sets of points on each tuple of regions.
POSTURES, SETS = 12_000, 40
#: Friction at which pads could hold anything, more than there will be, and the largest imbalance that counts as none.
FRICTION, BALANCED = 0.8, 0.15
#: Length that counts as much as an angle whose cosine differs by this, as a share of the hand's size.
LENGTH, COSINE = 0.06, 0.35
#: Assignments farther from all postures than this are out of reach.
OUT_OF_REACH = 4.0
#: Starts that each keeps.
STARTS = 24
#: Tuples of regions that are looked at, at most: those of the largest regions.
MOST_TUPLES = 4096


@dataclass(frozen=True, eq=False)
class Assignment:
    """Fingertips and the regions that they touch.

    Attributes:
        fingers: The hand and its pads.
        regions: Region of each pad.
        score: How far the nearest posture is from the nearest points; small is promising.
        postures: Postures to start from, the nearest first (s, nq).
        points: Points on the regions that go with them (s, m, 3), in the object's frame [m].
    """

    fingers: Fingers
    regions: tuple[Region, ...]
    score: float
    postures: Array
    points: Array

    @property
    def name(self) -> str:
        """Which link touches which region."""
        pairs = zip(self.fingers.grip.pads, self.regions, strict=True)
        return ", ".join(f"{pad.frame} on {region.name}" for pad, region in pairs)


class Pruned(Word):
    """Why an assignment is left out before a grasp of it is looked for."""

    HIDDEN = "behind an obstacle"
    SYMMETRIC = "the same as others by symmetry"
    UNREACHABLE = "out of reach of all postures that could hold anything"


@dataclass
class Counts:
    """How many assignments there are, and why some were left out.

    Attributes:
        all: All of them.
        hidden: With a region that lies behind a plane that is an obstacle, such as the table.
        symmetric: The same as others by a symmetry of the object.
        unreachable: Such that no posture drawn could hold the object there, or comes near.
    """

    all: int = 0
    hidden: int = 0
    symmetric: int = 0
    unreachable: int = 0

    @property
    def left(self) -> int:
        """Those that are looked at."""
        return self.all - self.hidden - self.symmetric - self.unreachable

    def __str__(self) -> str:
        hidden = f"{self.hidden} {Pruned.HIDDEN}, " if self.hidden else ""
        return (
            f"{self.all} assignments: {hidden}{self.symmetric} {Pruned.SYMMETRIC}, "
            f"{self.unreachable} {Pruned.UNREACHABLE}, {self.left} left"
        )


def assignments_of(
    grips: Sequence[Fingers],
    regions: Sequence[Region],
    symmetries: Sequence[tuple[int, ...]],
    planes: Planes,
    rng: np.random.Generator,
) -> tuple[list[Assignment], Counts]:
    """All assignments worth a try, the most promising first.

    Args:
        grips: The sets of fingertips.
        regions: The regions, the largest first.
        symmetries: See :func:`graspatlas.proposals.assignments.symmetry.region_symmetries`.
        planes: Behind which no finger can be.
        rng: Random numbers.
    """
    counts, found = Counts(), []
    hidden = {i for i, region in enumerate(regions) if planes.hides(region)}
    for fingers in grips:
        m = len(fingers.grip.pads)
        usable = list(range(min(len(regions), len(hidden) + int(MOST_TUPLES ** (1.0 / m)))))
        counts.all += len(usable) ** m
        tuples = list(product([i for i in usable if i not in hidden], repeat=m))
        counts.hidden += len(usable) ** m - len(tuples)
        kept = [each for each in tuples if each == min(tuple(s[i] for i in each) for s in symmetries)]
        counts.symmetric += len(tuples) - len(kept)
        matched = _matched(fingers, regions, kept, planes, rng)
        counts.unreachable += len(kept) - len(matched)
        found += matched
    return sorted(found, key=lambda each: each.score), counts


def _matched(
    fingers: Fingers,
    regions: Sequence[Region],
    tuples: Sequence[tuple[int, ...]],
    planes: Planes,
    rng: np.random.Generator,
) -> list[Assignment]:
    from scipy.spatial import cKDTree  # slow to import

    q = fingers.postures(POSTURES, rng)
    points, normals = fingers.pads_at(q)
    size = float(np.linalg.norm(points.reshape(-1, 3), axis=1).max())
    holding = imbalance(points, normals, FRICTION) < BALANCED
    if not holding.any() or not tuples:
        return []
    q, points = q[holding], points[holding]
    tree = cKDTree(_features(points, -normals[holding], LENGTH * size))
    on = [_drawn(region, planes, rng) for region in regions]
    drawn, outward = [], []
    for each in tuples:
        orders = [rng.permutation(SETS) for _ in each]
        drawn.append(np.stack([on[i][0][order] for i, order in zip(each, orders, strict=True)], axis=1))
        outward.append(np.stack([on[i][1][order] for i, order in zip(each, orders, strict=True)], axis=1))
    features = _features(np.concatenate(drawn), np.concatenate(outward), LENGTH * size)
    distances, nearest = tree.query(features)
    distances, nearest = distances.reshape(len(tuples), SETS), nearest.reshape(len(tuples), SETS)
    palms = _palms(points[nearest.ravel()], np.concatenate(drawn))
    buried = planes.behind(palms).reshape(distances.shape)
    found = []
    for i, each in enumerate(tuples):
        order = np.lexsort([distances[i], buried[i]])[:STARTS]
        score = float(distances[i, order[0]])
        if score < OUT_OF_REACH:
            chosen = tuple(regions[r] for r in each)
            found.append(Assignment(fingers, chosen, score, q[nearest[i, order]], drawn[i][order]))
    return found


def _drawn(region: Region, planes: Planes, rng: np.random.Generator) -> tuple[Array, Array]:
    """Points drawn on a region (SETS, 3), where fingertips have room if there is any, and their outward normals."""
    points, outward = region.sample(SETS, rng)
    room = np.flatnonzero(planes.touchable(points, outward))
    if len(room) in (0, SETS):
        return points, outward
    chosen = rng.choice(room, SETS)
    return points[chosen], outward[chosen]


def _palms(pads: Array, points: Array) -> Array:
    """Where the palm's origin is in the object's frame when pads (n, m, 3) in the palm's frame lie on points of it."""
    at, on = pads.mean(axis=1, keepdims=True), points.mean(axis=1, keepdims=True)
    U, _, Vt = np.linalg.svd(np.einsum("nma,nmb->nab", points - on, pads - at))
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    return np.asarray(on[:, 0] - np.einsum("nab,nb->na", U @ Vt, at[:, 0]))


def _features(points: Array, outward: Array, length: float) -> Array:
    """Distances and angles of contact points and outward normals of the object (n, m, 3) among each other (n, f)."""
    columns = []
    pairs = list(combinations(range(points.shape[1]), 2))
    for i, j in pairs:
        line = points[:, j] - points[:, i]
        distance = np.linalg.norm(line, axis=1)
        along = line / np.where(distance > 0.0, distance, 1.0)[:, None]
        columns.append(distance / length)
        columns.append(np.einsum("nc,nc->n", outward[:, i], outward[:, j]) / COSINE)
        columns.append(np.einsum("nc,nc->n", outward[:, i], along) / COSINE)
        columns.append(np.einsum("nc,nc->n", outward[:, j], along) / COSINE)
        if len(pairs) > 1:  # a mirror image differs in this alone
            other = outward[:, next(k for k in range(points.shape[1]) if k not in (i, j))]
            columns.append(np.einsum("nc,nc->n", np.cross(outward[:, i], outward[:, j]), other) / COSINE)
    return np.column_stack(columns)
