"""Names that were given up for clearer ones still work, and say so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import graspatlas as ga


def test_attributes(small_result: ga.Result) -> None:
    with pytest.warns(DeprecationWarning, match="'feasible' is now called 'accepted'"):
        np.testing.assert_array_equal(small_result.feasible, small_result.accepted)
    with pytest.warns(DeprecationWarning, match="'refused' is now called 'rejected'"):
        assert small_result.refused == small_result.rejected


def test_keywords(small_result: ga.Result, tmp_path: Path) -> None:
    with pytest.warns(DeprecationWarning, match="the keyword 'feasible' is now called 'accepted'"):
        count = small_result.save_grasps(tmp_path / "old.csv", feasible=True)  # type: ignore[call-arg]
    assert count == small_result.save_grasps(tmp_path / "new.csv", accepted=True)
    assert (tmp_path / "old.csv").read_bytes() == (tmp_path / "new.csv").read_bytes()
