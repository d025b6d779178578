"""The command line: what it prints where, its exit status, and one line for each wrong input."""

from __future__ import annotations

import copy
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.libraries import PINS

COMMAND = [sys.executable, "-m", "graspatlas.cli"]
QUICK = ["optimize", "schunk_oil_bottle", "--radius", "0.2"]


@pytest.fixture(scope="module")
def can_data() -> dict[str, Any]:
    return json.loads(json.dumps(ga.load_problem("schunk_can").to_dict()))


FIELDS = {
    "problem": str,
    "dimension": int,
    "radius": float,
    "epsilon": float,
    "length_scale": float,
    "torque_length": float,
    "status": str,
    "is_global": bool,
    "doubts": list,
    "audit": dict,
    "n_charts": int,
    "seconds": {"atlas": float, "audit": float, "quality": float},
    "max_residual": float,
    "quality": {"name": str, "best": float, "worst": float, "at_x1": float},
    "best": {"q": list, "object_xyz": list, "object_quat_xyzw": list, "chart": int},
    "gap": {
        **{"kind": str, "n_charts": int, "n_rejected": int, "n_unknown": int},
        **{"best": float, "bound": float, "share": float},
    },
}


def assert_fields(data: dict[str, Any], fields: dict[str, Any]) -> None:
    assert list(data) == list(fields)
    for name, kind in fields.items():
        if isinstance(kind, dict):
            assert_fields(data[name], kind)
        else:
            assert type(data[name]) is kind, name


def test_json(cli, bottle):
    status, out, _ = cli(*QUICK, "--json", "--quality", "smallest_semi_axis", "--epsilon", "0.4", "--dimension", "2")
    assert status == 0
    assert out.count("\n") == 1
    data = json.loads(out)
    assert_fields(data, FIELDS)
    result = ga.optimize(bottle, dimension=2, radius=0.2, epsilon=0.4, quality="smallest_semi_axis")
    expected = result.summary()
    assert data.pop("seconds").keys() == expected.pop("seconds").keys()
    assert data == expected
    assert (data["problem"], data["status"], data["length_scale"]) == ("schunk_oil_bottle", "complete", 0.01)
    assert len(data["best"]["q"]) == 13
    assert np.linalg.norm(data["best"]["object_quat_xyzw"]) == pytest.approx(1.0)


def test_report_for_people(cli):
    status, out, err = cli(*QUICK)
    assert status == 0
    assert err == ""
    for words in (
        "schunk_oil_bottle",
        "charts of dimension 2",
        "complete",
        "manipulability_volume",
        "thumb_opposition",
    ):
        assert words in out
    assert "better grasps may exist" not in out


def test_output_folder(cli, tmp_path):
    folder = tmp_path / "a" / "b"
    status, out, _ = cli(*QUICK, "--output", folder, "--json")
    assert status == 0
    assert sorted(p.name for p in folder.iterdir()) == ["result.npz", "summary.json"]
    assert json.loads((folder / "summary.json").read_text()) == json.loads(out)
    result = ga.load_result(folder)
    assert result.check().passed
    assert result.summary() == json.loads(out)


def test_cut_short(cli):
    status, out, _ = cli(*QUICK, "--json", "--max-charts", "5")
    assert status == 0
    assert json.loads(out)["n_charts"] == 5
    assert json.loads(out)["status"] == "cut short: limit of charts"
    status, out, _ = cli("optimize", "schunk_can", "--radius", "0.01", "--max-seconds", "0.2", "--require", "none")
    assert status == 0
    assert "cut short: limit of time" in out
    assert "better grasps may exist" in out


def test_list(cli):
    status, out, err = cli("list")
    assert (status, err) == (0, "")
    for name in (*ga.bundled_problems(), *ga.quality.INDICES):
        assert name in out


def test_problem_file(cli, can_data, tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(can_data | {"name": "mine", "defaults": {"dimension": 2, "radius": 0.3}}))
    status, out, _ = cli("optimize", path, "--epsilon", "0.5", "--quality", "smallest_semi_axis", "--json")
    assert status == 0
    assert json.loads(out)["problem"] == "mine"
    assert json.loads(out)["n_charts"] > 1000


def edited(change) -> Any:
    def edit(data: dict[str, Any], folder: Path) -> str:
        change(data, folder)
        return json.dumps(data)

    return edit


def put(value: object, *path: Any):
    def change(data: Any, folder: Path) -> None:
        for key in path[:-1]:
            data = data[key]
        data[path[-1]] = value

    return edited(change)


def drop(*path: Any):
    def change(data: Any, folder: Path) -> None:
        for key in path[:-1]:
            data = data[key]
        del data[path[-1]]

    return edited(change)


def bodies(which: str, urdf: str | None):
    """The hand or the object from a URDF file of this text, or from a missing file."""

    def change(data: dict[str, Any], folder: Path) -> None:
        data[which] = {"name": "thing", "urdf": "thing.urdf"}
        if urdf is not None:
            (folder / "thing.urdf").write_text(urdf)

    return edited(change)


LINK = '<link name="palm"/>'
LOOSE = f'<robot name="x">{LINK}<joint name="j" type="fixed"><parent link="palm"/><child link="gone"/></joint></robot>'
# What is wrong with the problem file, and words that the message must have.
PROBLEM_FILES = {
    "empty": (lambda data, folder: "", ["empty"]),
    "broken JSON": (lambda data, folder: json.dumps(data)[:-20], ["YAML"]),
    "a list": (lambda data, folder: "[]", ["problem"]),
    "null": (lambda data, folder: "null", ["problem"]),
    "no hand": (drop("hand"), ["hand"]),
    "no contacts": (drop("contacts"), ["contacts"]),
    "empty contacts": (put([], "contacts"), ["contact"]),
    "x1 a list": (put([0.1], "x1"), ["x1"]),
    "reference of one joint": (put({"thumb_pip": 0.1}, "reference"), ["reference", "no position"]),
    "hand of text": (put("schunk", "hand"), ["hand"]),
    "object null": (put(None, "object"), ["object"]),
    "missing hand URDF": (bodies("hand", None), ["thing.urdf", "does not exist"]),
    "missing object URDF": (bodies("object", None), ["thing.urdf", "does not exist"]),
    "empty hand URDF": (bodies("hand", ""), ["thing"]),
    "hand URDF not XML": (bodies("hand", "hello"), ["thing"]),
    "hand URDF cut off": (bodies("hand", '<robot name="x"><link name="palm">'), ["thing"]),
    "hand URDF with a loose joint": (bodies("hand", LOOSE), ["thing"]),
    "hand URDF without joint": (bodies("hand", f'<robot name="x">{LINK}</robot>'), ["no joint"]),
    "object URDF not XML": (bodies("object", "hello"), ["thing"]),
    "unknown frame": (put("thumb_distl", "contacts", 2, "frame"), ["thumb_distl", "did you mean 'thumb_distal'?"]),
    "unknown patch": (put({"type": "cilinder"}, "contacts", 0, "object"), ["cilinder", "did you mean 'cylinder'?"]),
    "unknown joint": (put(0.1, "x1", "joints", "thumb_pipp"), ["thumb_pipp", "did you mean 'thumb_pip'?"]),
    "joint without position": (drop("x1", "joints", "thumb_pip"), ["thumb_pip"]),
    "x1 off its contacts": (put([0.0676, 0.0288, 0.2436], "x1", "object_xyz"), ["thumb_distal", "mm", "degrees"]),
    "x1 turned away": (put([0.0, 1.0, 0.0, 0.0], "x1", "object_quat_xyzw"), ["degrees"]),
    "x1 with NaN": (put(float("nan"), "x1", "joints", "thumb_pip"), ["finite"]),
    "x1 with an infinite place": (put([float("inf"), 0, 0], "x1", "object_xyz"), ["finite"]),
    "x1 of text": (put("left", "x1", "joints", "thumb_pip"), ["thumb_pip", "left"]),
    "x1 without quaternion": (put([0, 0, 0, 0], "x1", "object_quat_xyzw"), ["quaternion"]),
    "x1 beyond a limit": (put({"thumb_opposition": [0.0, 1.304]}, "hand", "limits"), ["thumb_opposition", "by 0.1"]),
    "limits upside down": (put({"thumb_pip": [1.0, -1.0]}, "hand", "limits"), ["thumb_pip"]),
    "limits of nobody": (put({"thumb_pipp": [-1.0, 1.0]}, "hand", "limits"), ["did you mean 'thumb_pip'?"]),
    "limits of text": (put({"thumb_pip": ["a", "b"]}, "hand", "limits"), ["thumb_pip"]),
    "frozen nowhere": (put({"w": 1.0}, "contacts", 0, "frozen"), ["parameter 'w'"]),
    "negative length scale": (put(-1.0, "length_scale"), ["length_scale"]),
    "length scale of text": (put("wide", "length_scale"), ["length_scale"]),
    "negative radius of the can": (put(-0.02, "contacts", 0, "object", "radius"), ["radius"]),
    "huge can": (put(1e8, "contacts", 0, "object", "radius"), ["x1", "mm"]),
    "motions of other joints": (put("little_dip", "hand_motions", "joints", 0), ["little_dip"]),
    "motions with NaN": (put(float("nan"), "hand_motions", "mean", 0), ["finite"]),
    "motions of text": (put("a", "hand_motions", "mean", 0), ["hand_motions"]),
    "short covariance": (put([[1.0]], "hand_motions", "covariance"), ["covariance"]),
    "default radius of text": (put("wide", "defaults", "radius"), ["radius", "wide"]),
    "default quality unknown": (put("beauty", "defaults", "quality"), ["beauty"]),
    "default dimension 20": (put(20, "defaults", "dimension"), ["dimension", "8"]),
    "too many parameters": (put([0.1] * 9, "x1", "parameters"), ["parameters"]),
    "too few parameters": (put([0.1], "x1", "parameters"), ["parameters"]),
}


def assert_one_line(result: tuple[int, str, str], *words: str) -> None:
    status, out, err = result
    assert status == 2
    assert out == ""
    assert err.startswith("graspatlas: error: ")
    assert err.count("\n") == 1, err
    assert "Traceback" not in err
    for word in words:
        assert word in err, err


@pytest.mark.parametrize("name", PROBLEM_FILES)
def test_wrong_problem_files(cli, can_data, tmp_path, name):
    write, words = PROBLEM_FILES[name]
    path = tmp_path / "problem.json"
    path.write_text(write(copy.deepcopy(can_data), tmp_path))
    radius = [] if name == "default radius of text" else ["--radius", "0.4"]
    assert_one_line(cli("optimize", path, *radius, "--json"), *words)


WRONG_OPTIONS = {
    "unknown problem": (["schunk_cam"], ["schunk_cam", "did you mean 'schunk_can'?"]),
    "missing problem file": (["nowhere/problem.json"], ["problem.json"]),
    "a folder as problem": (["."], ["problem"]),
    "unknown index": (["schunk_can", "--quality", "manipulability"], ["did you mean 'manipulability_volume'?"]),
    **{f"dimension {k}": (["schunk_can", "--dimension", k], ["dimension", "1 to 8", k]) for k in ("0", "9", "-1")},
    **{f"radius {r}": (["schunk_can", "--radius", r], ["radius", r]) for r in ("0", "-1", "nan", "inf")},
    **{f"epsilon {e}": (["schunk_can", "--epsilon", e], ["epsilon"]) for e in ("0", "-1", "nan", "1", "2", "inf")},
    "no chart": (["schunk_can", "--max-charts", "0"], ["max_charts"]),
    "no time": (["schunk_can", "--max-seconds", "0"], ["max_seconds"]),
    "NaN seconds": (["schunk_can", "--max-seconds", "nan"], ["max_seconds"]),
}


@pytest.mark.parametrize("name", WRONG_OPTIONS)
def test_wrong_options(cli, name):
    words, expected = WRONG_OPTIONS[name]
    assert_one_line(cli("optimize", *words), *expected)


@pytest.mark.parametrize("words", [[], ["optimise"], ["optimize"], ["optimize", "schunk_can", "--radius", "wide"]])
def test_wrong_grammar(cli, words):
    status, out, err = cli(*words)
    assert (status, out) == (2, "")
    assert "error: " in err.splitlines()[-1]
    assert "Traceback" not in err


@pytest.mark.parametrize("place", ["file/out", "/proc/graspatlas"])
def test_unwritable_output_is_found_before_the_work(cli, tmp_path, place):
    (tmp_path / "file").write_text("in the way")
    start = time.perf_counter()
    result = cli("optimize", "schunk_oil_bottle", "--dimension", "3", "--radius", "0.03", "--output", tmp_path / place)
    assert_one_line(result, "cannot write", place)
    assert time.perf_counter() - start < 1.0


@pytest.mark.parametrize("damage", ["missing", "truncated", "text", "empty folder"])
def test_wrong_results(cli, small_result, tmp_path, damage):
    path = tmp_path / "result.npz"
    if damage == "truncated":
        small_result.save(path)
        path.write_bytes(path.read_bytes()[:-1000])
    elif damage == "text":
        path.write_text("hello")
    place = tmp_path if damage == "empty folder" else path
    assert_one_line(cli("view", place, "--html", tmp_path / "page.html"), "result.npz")


def test_options_that_do_not_go_together(cli, saved):
    assert_one_line(cli("view", saved, "--alone"), "--meshcat")
    assert_one_line(cli("optimize", "planar_hand", "--components", "--watch"), "--watch")


def interrupt(words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Send Ctrl-C once the first progress has been printed."""
    process = subprocess.Popen(
        [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=folder, env=os.environ
    )
    try:
        seen = b""
        while b"charts" not in seen:
            piece = os.read(process.stderr.fileno(), 4096)
            assert piece, "it ended before it was interrupted"
            seen += piece
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    return subprocess.CompletedProcess(process.args, process.returncode, out.decode(), (seen + err).decode())


@pytest.mark.slow
def test_interrupted(tmp_path):
    words = ["optimize", "schunk_oil_bottle", "--dimension", "3", "--radius", "0.03", "--output", "out", "--json"]
    words += ["--require", "none"]
    done = interrupt(words, tmp_path)
    assert done.returncode == 130
    data = json.loads(done.stdout)
    assert_fields(data, FIELDS)
    assert data["status"] == "cut short: interrupted"
    assert data["n_charts"] > 100
    assert "charts" in done.stderr
    assert "Traceback" not in done.stderr
    result = ga.load_result(tmp_path / "out")
    assert result.status is ga.Status.INTERRUPTED
    assert not result.is_global
    assert result.atlas.n_charts == data["n_charts"]
    assert result.atlas.residuals.max() < 1e-9


def test_as_a_program(tmp_path):
    """Through the shell: exit status, streams, no warning."""
    done = subprocess.run([*COMMAND, *QUICK, "--json"], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert_fields(json.loads(done.stdout), FIELDS)
    assert done.stderr == ""
    wrong = subprocess.run([*COMMAND, "optimize", "schunk_cam"], capture_output=True, text=True, cwd=tmp_path)
    assert_one_line((wrong.returncode, wrong.stdout, wrong.stderr), "did you mean 'schunk_can'?")


def test_version(cli):
    status, out, err = cli("--version")
    assert (status, err) == (0, "")
    assert out.startswith(f"graspatlas {ga.__version__} (Python ")
    assert f"libpinocchio {PINS['libpinocchio']}" in out


def test_doctor(cli):
    status, out, err = cli("doctor", "--json")
    findings = {finding["subject"]: finding for finding in json.loads(out)}
    assert (status, err) == (0, "")
    assert findings["compiled core"] == {"mark": "ok", "subject": "compiled core", "text": "it loads"}
    assert findings["numpy"] == {"mark": "ok", "subject": "numpy", "text": np.__version__}
    assert findings["threads"]["text"].endswith("processors may be used")
    assert cli("doctor")[1].splitlines()[0].startswith("ok      graspatlas ")


def test_wrong_words_give_one_line(capsys):
    for words in (["optimise"], ["optimize", "schunk_can", "--dimension", "two"], ["optimize"], ["list", "--loud"]):
        with pytest.raises(SystemExit) as ended:
            main(words)
        assert ended.value.code == 2
        error = capsys.readouterr().err
        assert error.startswith("graspatlas: error: ")
        assert error.count("\n") == 1
        assert "--help" in error
    assert error == "graspatlas: error: unrecognized arguments: --loud; see 'graspatlas list --help'\n"


def test_part_of_a_name_finds_it(capsys):
    assert main(["optimize", "schunk_can", "--quality", "manipul"]) == 2
    assert "did you mean 'manipulability_volume'" in capsys.readouterr().err


def test_path(cli, tmp_path):
    assert cli(*QUICK, "--require", "joint_margin:0.01", "--output", tmp_path)[0] == 0
    status, out, err = cli("path", tmp_path, "--from", "worst", "--accepted", "--csv", tmp_path / "path.csv")
    assert status == 0
    assert "path of length" in out
    assert "largest residual" in out
    assert "points meet the requirements" in out
    assert "path.csv" in err
    rows = (tmp_path / "path.csv").read_text(encoding="utf-8").splitlines()
    assert f"{len(rows) - 1} points" in out.splitlines()[0]
    status, out, err = cli("path", tmp_path, "--to", "first", "--html", tmp_path / "path.html")
    assert (status, out.splitlines()[0]) == (0, "schunk_oil_bottle: path of length 0 from chart 0 to chart 0, 1 points")
    wrong = ((("--from", "top"), "'top' names no grasp"), (("--to", "99999"), "end 99999 is not a chart"))
    for words, message in wrong:
        status, out, err = cli("path", tmp_path, *words)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert message in err


def test_require_none_drops_the_requirements_of_the_file(tmp_path: Path, capsys):
    words = ["optimize", "allegro_cylinder_3", "--radius", "0.4", "--output", str(tmp_path / "out")]
    assert main(words) == 0
    assert "meet the requirements" in capsys.readouterr().out
    assert main([*words, "--require", "none"]) == 0
    assert "meet the requirements" not in capsys.readouterr().out
