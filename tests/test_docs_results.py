"""The code in docs/results.md runs, and the page tells the truth about files and columns."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pandas as pd
import pytest

import graspatlas as ga
from graspatlas.cli import main

PAGE = Path(__file__).parents[1] / "docs" / "results.md"
TEXT = PAGE.read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def test_the_code_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile("\n".join(blocks("python")), str(PAGE), "exec"), {})
    out = capsys.readouterr().out
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


def test_the_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    lines = [shlex.split(line, comments=True) for line in blocks("")[0].splitlines()]
    assert [words[:2] for words in lines][-1] == ["graspatlas", "view"]
    for words in lines[:-1]:
        assert main(words[1:]) == 0, words
    assert {"grasps.json", "charts.parquet", "path.csv", "out"} == {file.name for file in tmp_path.iterdir()}
    assert {file.name for file in (tmp_path / "out").iterdir()} == {"result.npz", "summary.json"}
