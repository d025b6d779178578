"""The largest rectangle of full cells, against all rectangles."""

from __future__ import annotations

import numpy as np
import pytest

from graspatlas.regions.covering import ABOUT_LARGEST, largest_rectangle


def all_rectangles(full, wraps_u, wraps_v):
    """Sizes of all full rectangles."""
    n, m = full.shape
    for i in range(n):
        for height in range(1, n + 1):
            if not wraps_u and i + height > n:
                break
            rows = full[np.arange(i, i + height) % n]
            for j in range(m):
                for width in range(1, m + 1):
                    if not wraps_v and j + width > m:
                        break
                    if rows[:, np.arange(j, j + width) % m].all():
                        yield height * width


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("wraps_u", "wraps_v"), [(False, False), (True, False), (True, True)])
def test_the_rectangle_is_full_and_about_the_largest(seed, wraps_u, wraps_v):
    full = np.random.default_rng(seed).uniform(size=(7, 9)) < 0.75
    (i0, i1), (j0, j1) = largest_rectangle(full, wraps_u, wraps_v)
    assert full[np.ix_(np.arange(i0, i1) % 7, np.arange(j0, j1) % 9)].all()
    largest = max(all_rectangles(full, wraps_u, wraps_v))
    assert (i1 - i0) * (j1 - j0) >= ABOUT_LARGEST * largest
    assert wraps_u or i1 <= 7
    assert wraps_v or j1 <= 9
    assert i1 - i0 <= 7
    assert j1 - j0 <= 9


def test_a_disc_has_a_square_in_its_middle():
    x, y = np.meshgrid(np.linspace(-1, 1, 24), np.linspace(-1, 1, 24))
    (i0, i1), (j0, j1) = largest_rectangle(x**2 + y**2 < 1.0)
    assert abs(i0 + i1 - 24) <= 1
    assert abs(j0 + j1 - 24) <= 1
    assert abs((i1 - i0) - (j1 - j0)) <= 2
