"""Fuzzing of the command line."""

from __future__ import annotations

from drawn import few
from hypothesis import given
from hypothesis import strategies as st

from graspatlas.cli import main

WORDS = [
    "list", "optimize", "view", "check-result", "schunk_can", "schunk_oil_bottle", "planar_hand", "nothing", "--json",
    "--help", "--version", "--dimension", "--radius", "--epsilon", "--quality", "--require", "--max-charts",
    "--max-seconds", "--output", "1", "2", "0", "-1", "nan", "inf", "1e-300", "1e300", "0.5", "", "force_closure",
    "force_closure:0", "joint_margin:1:2", "collision_free:nan", "smallest_semi_axis", "--html", "x.html", "\0",
    "/dev/null", "/proc/nothing/x",
]  # fmt: skip


@given(words=st.lists(st.sampled_from(WORDS), max_size=6), start=st.sampled_from([[], ["optimize", "planar_hand"]]))
@few(150)
def test_command_lines(tmp_path, monkeypatch, capfd, words, start):
    monkeypatch.chdir(tmp_path)
    limits = ["--max-charts", "4", "--max-seconds", "0.2"] if start else []
    try:
        status = main([*start, *words, *limits])
    except SystemExit as end:
        status = int(end.code or 0)
    out, err = capfd.readouterr()
    assert status in (0, 1, 2)
    assert "Traceback" not in err
    if status == 2:
        assert err.startswith("graspatlas: error: ")
        assert len(err.splitlines()) == 1
        assert out == ""
