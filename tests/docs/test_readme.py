"""The README's first example does what the README says that it does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from graspatlas.quality.evaluation import INDICES

README = Path(__file__).parents[2] / "README.md"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def blocks() -> tuple[str, str]:
    """The first Python block, and the output that follows it."""
    text = README.read_text(encoding="utf-8")
    match = re.search(r"```python\n(.*?)```\n\n```\n(.*?)```", text, re.DOTALL)
    assert match
    return match[1], match[2]


def test_first_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    code, promised = blocks()
    assert len(code.strip().splitlines()) <= 12
    exec(compile(code, str(README), "exec"), {})
    printed = capsys.readouterr().out
    assert NUMBER.sub("#", printed) == NUMBER.sub("#", promised)
    for line, said in zip(printed.splitlines(), promised.splitlines(), strict=True):
        if "grasps in" in line:  # a chart more or less, and another machine's time
            assert int(line.split()[0]) == pytest.approx(int(said.split()[0]), rel=0.02)
        else:
            assert [float(n) for n in NUMBER.findall(line)] == pytest.approx(
                [float(n) for n in NUMBER.findall(said)], rel=0.1, abs=5e-3
            )
    assert (tmp_path / "can.html").stat().st_size > 1_000_000


def test_it_counts_the_indices() -> None:
    words = {10: "ten", 11: "eleven", 12: "twelve", 13: "thirteen", 14: "fourteen"}
    assert f"by one of {words[len(INDICES)]} indices" in README.read_text(encoding="utf-8")


def test_it_is_one_screen_and_a_half() -> None:
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 80, "what is longer belongs in docs/"
