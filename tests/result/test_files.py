"""Results: saved, loaded, damaged, cut short."""

from __future__ import annotations

import io
import json
import pickle
import random
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import graspatlas as ga
from graspatlas import _core


@pytest.fixture(scope="module")
def saved(bottle, tmp_path_factory) -> tuple[ga.Result, bytes]:
    """A small result, and its file."""
    result = ga.optimize(bottle, radius=0.3, max_charts=4)
    path = tmp_path_factory.mktemp("saved") / "small.npz"
    result.save(path)
    return result, path.read_bytes()


def assert_equal(a: ga.Result, b: ga.Result) -> None:
    for name, array in a.atlas.to_arrays().items():
        other = b.atlas.to_arrays()[name]
        assert array.dtype == other.dtype
        assert array.shape == other.shape
        assert array.tobytes() == other.tobytes(), name
    assert a.qualities.tobytes() == b.qualities.tobytes()
    assert a.accepted.tobytes() == b.accepted.tobytes()
    assert dict(a.rejected) == dict(b.rejected)
    for name in ("status", "dimension", "is_global", "quality_seconds"):
        assert getattr(a, name) == getattr(b, name)
    for name in ("radius", "epsilon", "seconds"):
        assert getattr(a.atlas, name) == getattr(b.atlas, name)


@pytest.mark.parametrize("fixture", ["can_result", "bottle_result"])
def test_round_trip_to_the_bit(fixture, request, tmp_path):
    result = request.getfixturevalue(fixture)
    result.save(tmp_path / "result.npz")
    for place in (tmp_path / "result.npz", str(tmp_path / "result.npz"), tmp_path):
        again = ga.load_result(place)
        assert_equal(result, again)
    assert again.problem.x1_array.tobytes() == result.problem.x1_array.tobytes()
    assert again.problem.to_dict() == result.problem.to_dict()
    assert again.summary() == result.summary()
    assert again.best.x.tobytes() == result.best.x.tobytes()
    assert again.check().passed
    again.save(tmp_path / "again.npz")
    assert_equal(ga.load_result(tmp_path / "again.npz"), result)


def test_a_loaded_result_carries_its_problem(small_result, tmp_path):
    """Everything that the atlas can do, it can do after loading, and the hand and object come along."""
    small_result.save(tmp_path / "r.npz")
    again = ga.load_result(tmp_path / "r.npz")
    x = again.atlas.point(3, [0.02, 0.01])
    np.testing.assert_allclose(x, small_result.atlas.point(3, [0.02, 0.01]), atol=1e-12)
    assert again.atlas.locate(x)[0] == small_result.atlas.locate(x)[0]
    assert again.problem.hand.urdf == small_result.problem.hand.urdf
    assert again.problem.object.urdf == small_result.problem.object.urdf
    more = ga.optimize(again.problem, radius=0.2, require=[])
    assert_equal(
        replace(more, quality_seconds=0.0, atlas=replace(more.atlas, seconds=0.0)),
        replace(small_result, quality_seconds=0.0, atlas=replace(small_result.atlas, seconds=0.0)),
    )


def test_a_result_of_a_callable(bottle, tmp_path):
    def height(grasp):
        return grasp.object_xyz[2]

    result = ga.optimize(bottle, radius=0.3, quality=height)
    result.save(tmp_path / "r.npz")
    again = ga.load_result(tmp_path / "r.npz")
    assert_equal(result, again)
    assert again.summary()["quality"]["name"] == "height"
    assert again.check().passed


def test_saving_replaces_at_once_or_not(saved, tmp_path):
    result, _ = saved
    path = tmp_path / "r.npz"
    path.write_bytes(b"old")
    result.save(path)
    assert ga.load_result(path).atlas.n_charts == 4
    assert [p.name for p in tmp_path.iterdir()] == ["r.npz"]


@pytest.mark.parametrize("place", ["missing/folder/r.npz", "file/r.npz", "folder"])
def test_unwritable_places(saved, tmp_path, place):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder").mkdir()
    before = sorted(p.name for p in tmp_path.iterdir())
    with pytest.raises(ga.GraspAtlasError, match="cannot write"):
        saved[0].save(tmp_path / place)
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def load_bytes(data: bytes, folder: Path) -> ga.Result:
    path = folder / "damaged.npz"
    path.write_bytes(data)
    return ga.load_result(path)


def test_truncated_files(saved, tmp_path):
    data = saved[1]
    rng = random.Random(0)
    lengths = {0, 1, 3, 4, 30, len(data) - 1, len(data) - 22} | {rng.randrange(len(data)) for _ in range(120)}
    for length in sorted(lengths):
        with pytest.raises(ga.GraspAtlasError) as caught:
            load_bytes(data[:length], tmp_path)
        assert "\n" not in str(caught.value)


def flips(data: bytes) -> list[tuple[int, int]]:
    rng = random.Random(1)
    anywhere = [(rng.randrange(len(data)), rng.randrange(8)) for _ in range(300)]
    directory = data.index(b"PK\x01\x02")
    headers = [(rng.randrange(directory, len(data)), rng.randrange(8)) for _ in range(500)]
    first = [(i, bit) for i in range(60) for bit in (0, 3, 6)]
    return anywhere + headers + first


@pytest.mark.parametrize("step", [9, pytest.param(1, marks=pytest.mark.slow)])
def test_flipped_bits(saved, tmp_path, step):
    """A damaged file is refused; where a bit says nothing (a date, say), what is loaded is unchanged."""
    result, data = saved
    loaded, tried = 0, flips(data)[::step]
    for at, bit in tried:
        damaged = bytearray(data)
        damaged[at] ^= 1 << bit
        try:
            again = load_bytes(bytes(damaged), tmp_path)
        except ga.GraspAtlasError:
            continue
        loaded += 1
        assert_equal(again, result)
    assert loaded < 0.6 * len(tried)


def rewritten(data: bytes, change) -> bytes:
    """The file with its header or an array changed, and valid otherwise."""
    with np.load(io.BytesIO(data)) as file:
        arrays = {name: file[name] for name in file.files}
    header = json.loads(str(arrays.pop("header")))
    change(header, arrays)
    out = io.BytesIO()
    np.savez(out, header=json.dumps(header), **arrays)
    return out.getvalue()


def archive(**arrays) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def plain_array() -> bytes:
    out = io.BytesIO()
    np.save(out, np.arange(3))
    return out.getvalue()


def text_archive() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        file.writestr("readme.txt", "hello")
    return out.getvalue()


NOT_RESULTS = {
    "empty": b"",
    "text": b"hello",
    "start of an archive": b"PK\x03\x04",
    "pickle": pickle.dumps({"a": 1}),
    "an array": plain_array(),
    "an archive of text": text_archive(),
    "an archive of arrays": archive(a=np.arange(3)),
    "a pickled header": archive(header=np.array([{"format": "graspatlas result"}], dtype=object)),
    "a number as header": archive(header=np.array(1.0)),
    "no JSON": archive(header="{"),
    "null": archive(header="null"),
    "a list": archive(header="[]"),
    "a string": archive(header='"x"'),
    "no format": archive(header="{}"),
    "another format": archive(header='{"format": "atlas", "version": 1}'),
    "only a format": archive(header='{"format": "graspatlas result", "version": 1}'),
}


@pytest.mark.parametrize("name", NOT_RESULTS)
def test_what_is_not_a_result(name, tmp_path):
    with pytest.raises(ga.GraspAtlasError) as caught:
        load_bytes(NOT_RESULTS[name], tmp_path)
    assert "\n" not in str(caught.value)


class Trap:
    fired = False

    def __reduce__(self):
        return (setattr, (Trap, "fired", True))


def test_nothing_in_a_file_is_executed(saved, tmp_path):
    data = rewritten(saved[1], lambda header, arrays: arrays.update(qualities=np.array([Trap()] * 4, dtype=object)))
    with pytest.raises(ga.GraspAtlasError):
        load_bytes(data, tmp_path)
    assert not Trap.fired


def set_header(**values):
    return lambda header, arrays: header.update(values)


ARRAYS = (
    "qualities",
    "accepted",
    "centers",
    "bases",
    "residuals",
    "facet_start",
    "facet_normals",
    "facet_offsets",
    "facet_tags",
    "vertex_start",
    "vertices",
    "vertex_closed",
    "neighbour_pairs",
)
CHANGES = {
    "future version": set_header(version=3),
    "version of text": set_header(version="1"),
    "no problem": set_header(problem=None),
    "empty problem": set_header(problem={}),
    "dimension 0": set_header(dimension=0),
    "dimension 3": set_header(dimension=3),
    "dimension of text": set_header(dimension="2"),
    "unknown status": set_header(status="FINE"),
    "status null": set_header(status=None),
    "radius of text": set_header(radius="wide"),
    "radius negative": set_header(radius=-1.0),
    "epsilon null": set_header(epsilon=None),
    "seconds null": set_header(seconds=None),
    "quality null": set_header(quality=None),
    "an extra array": lambda header, arrays: arrays.update(extra=np.zeros(3)),
    **{f"no {name}": (lambda header, arrays, name=name: arrays.pop(name)) for name in ARRAYS},
    **{
        f"{name} one short": (lambda header, arrays, name=name: arrays.update({name: arrays[name][:-1]}))
        for name in ARRAYS
        if name != "neighbour_pairs"
    },
    **{
        f"{name} of text": (lambda header, arrays, name=name: arrays.update({name: arrays[name].astype("U")}))
        for name in ARRAYS
    },
}


@pytest.mark.parametrize("name", CHANGES)
def test_changed_files_are_refused(saved, tmp_path, name):
    with pytest.raises(ga.GraspAtlasError) as caught:
        load_bytes(rewritten(saved[1], CHANGES[name]), tmp_path)
    assert "\n" not in str(caught.value)
    if name == "future version":
        assert "version 3" in str(caught.value)


def test_missing_files(tmp_path):
    with pytest.raises(ga.GraspAtlasError, match="does not exist"):
        ga.load_result(tmp_path / "nothing.npz")
    with pytest.raises(ga.GraspAtlasError, match="does not exist"):
        ga.load_result(tmp_path)


def test_cut_short_results_are_never_global(bottle, tmp_path):
    few = ga.optimize(bottle, radius=0.02, max_charts=10)
    brief = ga.optimize(bottle, radius=0.002, dimension=3, max_seconds=0.1)
    assert (few.status, brief.status) == (ga.Status.CHART_LIMIT, ga.Status.TIME_LIMIT)
    assert few.atlas.n_charts == 10
    for result in (few, brief):
        assert not result.is_global
        assert not result.atlas.complete
        assert "cut short" in result.summary()["status"]
        assert result.check().passed
        result.save(tmp_path / "r.npz")
        again = ga.load_result(tmp_path / "r.npz")
        assert again.status is result.status
        assert not again.is_global


def test_complete_results_with_closed_vertices_are_not_global(small_result):
    assert small_result.is_global
    for reason in (ga.Closed.CURVATURE, ga.Closed.NOT_CONVERGED):
        closed = small_result.atlas.vertex_closed.copy()
        closed[5] = reason.value
        assert not replace(small_result, atlas=replace(small_result.atlas, vertex_closed=closed)).is_global


def test_an_interruption_keeps_what_there_is(bottle, monkeypatch):
    class Interrupted:
        """A builder at which Ctrl-C arrives in the third slice of its work."""

        slices = 0

        def __init__(self, *arguments):
            self.builder = builder(*arguments)

        def expand(self, charts, seconds):
            Interrupted.slices += 1
            if Interrupted.slices == 3:
                raise KeyboardInterrupt
            self.builder.expand(self.builder.n_charts + 7, seconds)

        def __getattr__(self, name):
            return getattr(self.builder, name)

    builder = _core.AtlasBuilder
    monkeypatch.setattr(_core, "AtlasBuilder", Interrupted)
    result = ga.optimize(bottle, radius=0.02)
    assert result.status is ga.Status.INTERRUPTED
    assert result.atlas.n_charts == 15
    assert len(result.qualities) == 15
    assert not result.is_global
    assert result.check().passed


def test_grasps_by_number(small_result):
    assert small_result.grasp(3).quality == small_result.qualities[3]
    for wrong in (-1, small_result.atlas.n_charts):
        with pytest.raises(ga.GraspAtlasError, match="does not exist"):
            small_result.grasp(wrong)


def test_the_best_is_feasible_whatever_the_index(small_result):
    """Also when the index is minus infinity, or the same, everywhere."""
    feasible = np.zeros(small_result.atlas.n_charts, bool)
    feasible[[7, 9]] = True
    for value in (-np.inf, 0.0, np.inf):
        qualities = np.full(small_result.atlas.n_charts, value)
        result = replace(small_result, accepted=feasible, qualities=qualities)
        assert (result.best.chart, result.worst.chart) == (7, 7)


def test_summary_is_plain_data(small_result):
    summary = small_result.summary()
    assert json.loads(json.dumps(summary)) == summary
    assert summary["best"]["q"] == small_result.best.q.tolist()
    assert summary["max_residual"] == small_result.atlas.residuals.max()
