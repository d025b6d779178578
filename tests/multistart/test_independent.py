"""Nothing that another optimiser finds from its own random starts is better than the best of all feasible grasps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from oracles.random_climbs import RandomClimbs

import graspatlas as ga

#: By what share another grasp may be better: climbs of the package keep a little away from what they must not hit.
SHARE = 1e-3


def best_value(problem: ga.Problem) -> float:
    return ga.optimize(problem, motions="all").refined_best.quality


def values(climbs: RandomClimbs, seeds: Sequence[int], draws: int) -> np.ndarray:
    """The index where climbs from random starts ended at grasps."""
    ends = [climbs.climb(climbs.start(np.random.default_rng(seed), draws)) for seed in seeds]
    return np.array([end[1] for end in ends if end is not None])


@pytest.fixture(scope="module")
def planar() -> RandomClimbs:
    return RandomClimbs(ga.load_problem("planar_hand"), "inverse_condition_number", ())


def test_no_other_climb_in_the_planar_hand_is_better(planar: RandomClimbs) -> None:
    best = best_value(planar.problem)
    found = values(planar, range(35), draws=1)
    assert len(found) > 20
    assert found.max() == pytest.approx(best, rel=SHARE)
    assert len(np.unique(found.round(4))) > 5  # so many maxima lie beside the best


def test_the_other_optimiser_climbs_to_grasps(planar: RandomClimbs) -> None:
    start = planar.start(np.random.default_rng(12), draws=1)
    end = planar.climb(start)
    assert end is not None
    assert planar.accepted(end[0])
    assert end[1] > 1.1 * planar.index(start[None])[0]


@pytest.fixture(scope="module")
def round_the_can(can: ga.Problem) -> ga.Result:
    return ga.optimize(can, motions="all")


@pytest.mark.slow
def test_no_other_climb_round_the_can_is_better(can: ga.Problem, round_the_can: ga.Result) -> None:
    climbs = RandomClimbs(can, "manipulability_volume", can.requirements)
    best = round_the_can.refined_best.quality
    found = values(climbs, range(24), draws=12)
    assert len(found) > 8
    assert found.max() <= (1.0 + SHARE) * best
    assert found.max() > 0.8 * best  # else this would be no match


@pytest.mark.slow
def test_no_other_climb_from_the_maxima_round_the_can_is_better(can: ga.Problem, round_the_can: ga.Result) -> None:
    climbs = RandomClimbs(can, "manipulability_volume", can.requirements)
    refinement = round_the_can.refinement
    assert refinement is not None
    random = np.random.default_rng(0)
    found = []
    for x in refinement.x[:2]:
        for length in (0.0, 0.1, 0.5):
            v = random.normal(size=climbs.system.tangent_size)
            near = climbs.system.integrate(x, length * v / np.linalg.norm(v))
            end = climbs.climb(climbs.repair(climbs.touching(near)))
            found += [] if end is None else [end[1]]
    assert len(found) > 3
    assert max(found) == pytest.approx(refinement.qualities[0], rel=SHARE)
