"""The code in docs/results.md runs, and the page tells the truth about files and columns."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pandas as pd
import pytest
from pages import Run, blocks_of, read

import graspatlas as ga

PAGE = "results.md"
TEXT = read(PAGE)


@pytest.mark.slow
def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands first, then one program in Python; each part with what it leaves."""
    monkeypatch.chdir(tmp_path)
    first, *others = blocks_of(PAGE)
    lines = [shlex.split(line, comments=True) for line in first.text.splitlines()]
    assert [words[:2] for words in lines][-1] == ["graspatlas", "view"]
    run = Run(PAGE)
    run.run(first)
    assert {"grasps.json", "charts.parquet", "path.csv", "out"} == {file.name for file in tmp_path.iterdir()}
    assert {file.name for file in (tmp_path / "out").iterdir()} == {"result.npz", "summary.json"}
    out = ""
    for block in others:
        run.run(block)
        out += run.printed
    for words in ("grasps hold", "n_neighbours", "the index changes most", "at half a radian a second"):
        assert words in out
    assert pd.read_csv("path.csv").columns[0] == "time"
    data = json.loads(Path("grasps.json").read_text(encoding="utf-8"))
    for name in (*data, *data["grasps"][0]):
        assert f"`{name}`" in TEXT
    assert len(data["grasps"]) == 21


def test_every_column_is_named(small_result: ga.Result) -> None:
    named = {name for name in small_result.to_pandas(volumes=True) if re.fullmatch(r"[a-z]+_?[a-z_]*", str(name))}
    known = {*small_result.problem.hand.joints, *ga.quality.INDICES}
    assert len(named - known) > 5
    for name in named - known:
        assert f"`{name}`" in TEXT or re.match("palm_|object_", name), name
