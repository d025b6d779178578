"""What rounds of climbs have found: maxima, how often each, and the share that may be missing."""

from __future__ import annotations

import numpy as np
import pytest

from graspatlas.multistart.census import Census
from graspatlas.multistart.rounds import Round, RoundKind


def round_of(values: list[float], places: list[float], *, converged: bool = True, number: int = 1) -> Round:
    """A round whose climbs ended at these places of a line with these values; -inf for one that met nothing."""
    value = np.array(values)
    met = np.isfinite(value)
    n = len(value)
    return Round(
        number=number,
        kind=RoundKind.RANDOM if number else RoundKind.STATED,
        x=np.array(places)[:, None],
        value=value,
        kkt=np.full(n, 1e-8),
        met=met,
        converged=met & converged,
        stalled=met & (not converged),
        missed=np.where(met, 0.0, 0.3),
        tries=n,
        seconds=0.0,
    )


def census(*rounds: Round) -> Census:
    counted = Census(lambda x: x)
    for one in rounds:
        counted.add(one)
    return counted


def test_ends_at_one_place_or_of_one_value_are_one_maximum() -> None:
    found = census(round_of([1.0, 1.00001, 2.0, 2.0, 2.5], [0.0, 0.01, 5.0, 9.0, 20.0]))
    assert [(peak.value, peak.hits) for peak in found.ranked()] == [(2.5, 1), (2.0, 2), (1.00001, 2)]
    assert found.climbs == found.met == 5


def test_the_highest_stands_for_its_maximum_unless_only_another_has_converged() -> None:
    first = round_of([1.0], [0.0], converged=False)
    second = round_of([1.0 - 1e-6], [0.01])
    third = round_of([1.0 + 1e-6], [0.02])
    peak = census(first, second, third).best
    assert peak is not None
    assert peak.converged
    assert peak.value == 1.0 + 1e-6
    much_higher = round_of([1.5], [0.03], converged=False)
    peak = census(first, second, much_higher).best
    assert peak is not None
    assert (peak.value, peak.converged) == (1.5, False)


def test_the_share_that_may_be_missing_is_that_of_boender_and_rinnooy_kan() -> None:
    found = census(round_of([1.0, 2.0, 2.0, 3.0, 3.0, 3.0], [0.0, 5.0, 5.0, 9.0, 9.0, 9.0]))
    assert found.share_missing == pytest.approx(3 * 4 / (6 * 5))
    assert census().share_missing == 1.0
    assert census(round_of([1.0], [0.0])).share_missing == 1.0


def test_starts_that_were_stated_are_no_sample() -> None:
    stated = round_of([1.0] * 20, [0.0] * 20, number=0)
    assert census(stated).share_missing == 1.0
    drawn = round_of([1.0] * 5, [0.0] * 5)
    assert census(stated, drawn).share_missing == pytest.approx(2 / 20)


def test_the_share_holds_for_what_is_drawn_from_known_basins() -> None:
    """Over many searches the climbs that go on to new maxima have the share that was expected of them."""
    rng = np.random.default_rng(0)
    sizes = np.array([0.5, 0.2, 0.1, 0.1, 0.05, 0.03, 0.02])
    expected, true = [], []
    for _ in range(400):
        drawn = rng.choice(len(sizes), 60, p=sizes)
        found = census(round_of((1.0 + drawn).tolist(), (10.0 * drawn).tolist()))
        expected.append(found.share_missing)
        true.append(1.0 - sizes[np.unique(drawn)].sum())
    assert np.mean(true) == pytest.approx(np.mean(expected), abs=0.02)


def test_what_misses_the_requirements_is_remembered_until_something_meets_them() -> None:
    nothing = census(round_of([-np.inf, -np.inf], [0.0, 1.0]))
    assert nothing.met == 0
    assert nothing.best is None
    assert nothing.least_missed is not None
    assert nothing.least_missed[0] == 0.3
    nothing.add(round_of([1.0], [2.0]))
    assert nothing.least_missed is None
