"""Fuzzing of results and their files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from drawn import INF, NAN, anything, change_leaf, damaged, few, tried
from hypothesis import given
from hypothesis import strategies as st

import graspatlas as ga
from graspatlas import quality


@pytest.fixture(scope="module")
def stored(tripod_result, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("fuzz") / "result.npz"
    tripod_result.save(path)
    return path


@given(data=st.data())
@few(60)
def test_damaged_results(stored, tmp_path, data):
    path = tmp_path / "result.npz"
    path.write_bytes(damaged(stored.read_bytes(), data))
    result = tried(lambda: ga.load_result(path))
    if result is not None:  # what was damaged does not matter: the archive has a sum of each part
        kept = ga.load_result(stored)
        assert result.problem.to_dict() == kept.problem.to_dict()
        for name, array in {**kept.atlas.to_arrays(), "qualities": kept.qualities, "accepted": kept.accepted}.items():
            part = getattr(result if name in ("qualities", "accepted") else result.atlas, name)
            assert part.tobytes() == array.tobytes()


ENTRIES = {
    "f": [0.0, -1.0, 0.5, NAN, INF, -INF, 1e-300, 1e12, 1e300],
    "b": [True, False],
    "i": [-9, -2, -1, 0, 1, 7, 8, 99],
    "u": [0, 1, 3, 200],
}


@given(header_too=st.booleans(), place=st.integers(0, 10**6), whole=st.booleans(), data=st.data())
@few(100)
def test_results_with_other_content(stored, tmp_path, capfd, header_too, place, whole, data):
    """A file that is whole, with a header or an array that is not what it should be."""
    with np.load(stored) as file:
        arrays = {name: file[name] for name in file.files}
    if header_too:
        header = json.loads(str(arrays["header"]))
        change_leaf(header, data)
        arrays["header"] = np.array(json.dumps(header))
    else:
        name = sorted(arrays)[place % len(arrays)]
        array = arrays[name]
        if whole or array.size == 0 or array.dtype.kind not in ENTRIES:
            other = [0.0, [1.0, 2.0], [[NAN]], "text", [True], []]
            arrays[name] = np.array(other[place // 100 % len(other)])
        else:
            entries = ENTRIES[array.dtype.kind]
            array.flat[place // 100 % array.size] = entries[place % len(entries)]
    path = tmp_path / "result.npz"
    np.savez(path, **arrays)
    result = tried(lambda: ga.load_result(path))
    if result is not None:
        report = tried(lambda: result.check())
        summary = tried(lambda: result.summary())
        if report:
            system = result.problem.system(result.dimension)
            assert max(np.abs(system.evaluate_residual(x)).max() for x in result.atlas.centers) < 1e-9
            assert (
                summary["quality"]["best"] == result.qualities[result.accepted].max(initial=-INF) or not summary["best"]
            )
            json.dumps(summary, allow_nan=False)


@given(chart=anything, max_steps=anything)
@few(100)
def test_result_methods(tripod_result, chart, max_steps):
    result = tripod_result
    grasp = tried(lambda: result.grasp(chart))
    if grasp is not None:
        np.testing.assert_array_equal(grasp.x, result.atlas.centers[chart])
        assert (grasp.chart, grasp.quality) == (chart, result.qualities[chart])
    climbs = [tried(lambda: ga.climb(result, chart, max_steps=1))]
    if not isinstance(max_steps, int) or max_steps < 3:
        climbs.append(tried(lambda: ga.climb(result, 0, max_steps=max_steps)))
    for climb in climbs:
        if climb is not None:
            assert climb.quality >= climb.qualities[0] == result.qualities[climb.chart]
            assert quality.evaluate(result.quality, ga.Grasps(result.problem, climb.x))[0] == pytest.approx(
                climb.quality
            )
            assert np.abs(result.atlas.system.evaluate_residual(climb.x)).max() < 1e-8


@given(value=anything)
@few(60)
def test_what_is_no_result(value):
    for use in (
        lambda: ga.climb(value, 0),
        lambda: ga.local_maxima(value),
        lambda: ga.export_html(value, "no.html"),
        lambda: ga.save_picture(value, "no.png"),
    ):
        assert tried(use) is None
