"""Malformed input of every kind: one line that says what is wrong and where, exit status 2, and no traceback."""

from __future__ import annotations

import copy
import json
import os
import re
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import slow_but

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.hand.mesh_files import check_meshes
from graspatlas.hand.urdf import box_urdf, mesh_urdf
from graspatlas.problem_files.documents import MOST_LEVELS, DocumentError, parse
from graspatlas.problems import problem_text
from graspatlas.viewer.scene.meshes import box

QUICK = ["--max-charts", "20", "--max-seconds", "2"]


@pytest.fixture
def refused(capfd: pytest.CaptureFixture[str]):
    """Run the command line on wrong input; the one line that it says on standard error."""

    def run(*words: object) -> str:
        capfd.readouterr()
        try:
            status = main([str(word) for word in words])
        except SystemExit as exit_:
            status = int(exit_.code or 0)
        out, err = capfd.readouterr()
        assert status == 2, (status, out, err)
        assert err.startswith("graspatlas: error: "), err
        assert err.count("\n") == 1, err
        assert len(err) < 700, err
        return err

    return run


@pytest.fixture(scope="module")
def gripper() -> dict[str, Any]:
    return yaml.safe_load(problem_text("gripper_skittle")[0])


@pytest.fixture(scope="module")
def stored() -> dict[str, Any]:
    return json.loads(json.dumps(ga.load_problem("gripper_skittle").to_dict()))


def put(data: Any, path: tuple[str | int, ...], value: object) -> Any:
    """A copy of plain data with something else at one place."""
    data = copy.deepcopy(data)
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return data


# YAML


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[" * 400 + "]" * 400, r"p.yaml:1: has more than 50 tables or lists within one another"),
        ("a:\n" + "".join("  " * i + f" b{i}:\n" for i in range(1, 300)), r"p.yaml:\d+: has more than 50 tables"),
        ("length_scale: " + "9" * 5000, r"p.yaml:1: a whole number of 5000 digits is too large"),
        ("name: x\nlength_scale: !!int abc", r"p.yaml:2: the tag \S+int does not fit 'abc'"),
        ("length_scale: !!float abc", r"p.yaml:1: the tag \S+float does not fit 'abc'"),
        ("hand: !!bool perhaps", r"p.yaml:1: the tag \S+bool does not fit 'perhaps'"),
        ("hand: !!timestamp 2001-01-01", r"p.yaml:1: the tag \S+timestamp is not allowed"),
        ('name: "\\ud800"', r"p.yaml:1: \S+ holds an escape that is not a character"),
        ('"\\ud800": 1', r"p.yaml:1: \S+ holds an escape that is not a character"),
    ],
    ids=["brackets", "tables", "digits", "int", "float", "bool", "timestamp", "surrogate", "key"],
)
def test_yaml(text: str, reason: str, refused: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.yaml").write_text(text)
    import re

    assert re.search(reason, refused("optimize", "p.yaml"))


def test_yaml_of_as_many_levels_as_are_allowed() -> None:
    assert parse("[" * MOST_LEVELS + "]" * MOST_LEVELS).data is not None
    with pytest.raises(DocumentError, match="has more than"):
        parse("[" * (MOST_LEVELS + 1) + "]" * (MOST_LEVELS + 1))


LONG = "a" * 400


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("hand", "urdf"), LONG, "too long"),
        (("hand", "urdf"), "a\0b", "holds"),
        (("hand", "srdf"), LONG, "too long"),
        (("hand", "package_paths"), [LONG], "must"),
        (("contacts", 0, "frame"), LONG, "frame"),
        (("object", "sphere"), {"radius": -0.1}, "positive"),
        (("contacts", 0, "object", "v_interval"), [0.0, 1e300], "v_interval"),
        (("length_scale",), 10**400, "a whole number of 401 digits"),
        (("hand", "limits"), {"left_slide": [-1e300, 1e300]}, "limits"),
    ],
)
def test_fields(gripper: dict[str, Any], path: Any, value: object, words: str, refused: Any, tmp_path: Path) -> None:
    data = copy.deepcopy(gripper)
    if path[0] == "hand" and path[1] in ("urdf", "srdf"):
        data["hand"] = {**data["hand"], path[1]: value}
    elif path[:2] == ("object", "sphere"):
        data["object"] = {"sphere": value}
    elif path[:2] == ("hand", "package_paths"):
        data["hand"] = {"urdf": "package://nowhere/x.urdf", "package_paths": value}
        words = "does not exist"
    elif path == ("hand", "limits"):
        joint = ga.load_problem("gripper_skittle").hand.joints[0]
        data["hand"]["limits"] = {joint: [-1e300, 1e300]}
    else:
        data = put(data, path, value)
    file = tmp_path / "p.json"
    sys.set_int_max_str_digits(0)
    file.write_text(json.dumps(data))
    sys.set_int_max_str_digits(4300)
    said = refused("optimize", file, *QUICK)
    assert words in said
    assert "p.json:" in said


@pytest.mark.parametrize("name", [LONG, "a/" * 3000, "x.yaml" + LONG + ".yaml"])
def test_names_of_hundreds_of_letters(name: str, refused: Any) -> None:
    for words in (["optimize", name], ["check-result", name], ["view", name], ["new", name]):
        refused(*words)


# URDF


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ('<box size="0 0 0"/>', "size='0 0 0'; it must be 3 positive numbers"),
        ('<box size="1 1"/>', "3 positive numbers"),
        ('<sphere radius="-0.02"/>', "radius='-0.02'; it must be a positive number"),
        ('<sphere radius=""/>', "a positive number"),
        ("<sphere/>", "a <sphere> without radius"),
        ('<cylinder radius="nan" length="0.1"/>', "radius='nan'"),
        ('<cylinder radius="0.1" length="1e300"/>', "below 1e+09"),
        ('<mesh filename=""/>', "a <mesh> without filename"),
        ('<mesh filename="a.stl" scale="1 0 1"/>', "scale 0"),
        ('<mesh filename="a.stl" scale="1 1"/>', "3 numbers"),
    ],
)
@pytest.mark.parametrize("kind", ["visual", "collision"])
def test_shapes(shape: str, reason: str, kind: str) -> None:
    urdf = f'<robot name="r"><link name="base"><{kind}><geometry>{shape}</geometry></{kind}></link></robot>'
    with pytest.raises(ga.GraspAtlasError) as caught:
        ga.Body("r", urdf)
    assert "link 'base' of the URDF of 'r'" in str(caught.value)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('lower="-1"', 'lower="-1e300"', "lower='-1e300'; it must be a number below 1e+09"),
        ('upper="1"', 'upper="nan"', "upper='nan'"),
        ('upper="1"', 'upper="one"', "upper='one'"),
        ('xyz="0 0 1"', 'xyz="0 0 0"', "axis of length 0"),
        ('xyz="0 0 1"', 'xyz="0 0"', "3 numbers"),
        ('rpy="0 0 0"', 'rpy="0 inf 0"', "rpy='0 inf 0'"),
        ('name="j"', f'name="{"j" * 201}"', "at most 200 letters"),
        ('name="j"', 'name="j&#155;31m"', "without control codes"),
        ('name="tip"', 'name="base"', "stands twice"),
    ],
)
def test_joints(old: str, new: str, reason: str) -> None:
    urdf = (
        '<robot name="r"><link name="base"/><link name="tip"/><joint name="j" type="revolute"><parent link="base"/>'
        '<child link="tip"/><origin xyz="0 0 0.1" rpy="0 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    ga.Hand("r", urdf)
    assert old in urdf
    with pytest.raises(ga.GraspAtlasError) as caught:
        ga.Hand("r", urdf.replace(old, new))
    assert reason in str(caught.value)


def test_urdfs_that_are_no_text() -> None:
    for urdf in ("\ud800", "<robot>\ud800</robot>", "", "<robot", "<sdf/>"):
        with pytest.raises(ga.GraspAtlasError, match="URDF of 'r'"):
            ga.Body("r", urdf)


def test_a_shape_that_cannot_be_read_is_not_left_out(stored: dict[str, Any], refused: Any, tmp_path: Path) -> None:
    """The parser drops it with a remark; collisions with it would then never be found."""
    import re

    text, count = re.subn(
        r'<(box size|cylinder radius|sphere radius)="[^"]*"', r'<\1="abc"', stored["hand"]["urdf_text"]
    )
    assert count
    (tmp_path / "p.json").write_text(json.dumps(put(stored, ("hand", "urdf_text"), text)))
    assert "abc" in refused("optimize", tmp_path / "p.json", *QUICK)


# Meshes


def write_stl(path: Path, triangles: np.ndarray, *, text: bool = False) -> None:
    corners = np.asarray(triangles, np.float32).reshape(-1, 3, 3)
    if text:
        rows = "".join(
            "facet normal 0 0 0\nouter loop\n"
            + "".join(f"vertex {x} {y} {z}\n" for x, y, z in t)
            + "endloop\nendfacet\n"
            for t in corners
        )
        path.write_text(f"solid s\n{rows}endsolid s\n")
        return
    body = b"".join(bytes(12) + t.tobytes() + bytes(2) for t in corners)
    path.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + body)


@pytest.mark.parametrize("kind", ["binary", "text", "obj"])
def test_meshes_that_are_none(kind: str, tmp_path: Path) -> None:
    shape = box([0.06, 0.06, 0.1])
    T = shape.vertices[shape.faces]
    hole = T.copy()
    hole[3, 1, 2] = np.nan
    cases = {
        "not finite numbers, such as": [hole, T * np.inf, T * 1e30],
        "has no area": [T * [1.0, 0.0, 0.0], T * 0.0 + 1.0, T[:0]],
    }
    path = tmp_path / ("m.obj" if kind == "obj" else "m.stl")

    def body(triangles: np.ndarray) -> ga.Body:
        if kind == "obj":
            corners = triangles.reshape(-1, 3)
            faces = [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(corners) // 3)]
            path.write_text("\n".join([*(f"v {x} {y} {z}" for x, y, z in corners), *faces, ""]))
        else:
            write_stl(path, triangles, text=kind == "text")
        return ga.Body("m", mesh_urdf("m", str(path), [1.0] * 3))

    check_meshes(body(T))
    check_meshes(body(T * [1.0, 1.0, 0.0]))  # flat ones are surfaces
    for reason, many in cases.items():
        for triangles in many:
            with pytest.raises(ga.GraspAtlasError, match=reason):
                check_meshes(body(triangles))


def test_a_mesh_with_nan_is_named(refused: Any, tmp_path: Path) -> None:
    shape = box([0.06, 0.06, 0.1])
    corners = shape.vertices[shape.faces]
    corners[0, 0, 0] = np.nan
    write_stl(tmp_path / "bad.stl", corners)
    data = yaml.safe_load(problem_text("allegro_box_4")[0])
    data["object"] = {"mesh": "bad.stl"}
    data["requirements"] = ["collision_free"]
    (tmp_path / "p.json").write_text(json.dumps(data))
    assert "bad.stl" in refused("optimize", tmp_path / "p.json", *QUICK)


# Results


@pytest.fixture(scope="module")
def arrays(small_result: ga.Result, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("r") / "r.npz"
    small_result.save(path)
    with np.load(path) as file:
        return dict(file)


def header_with(arrays: dict[str, Any], **values: object) -> dict[str, Any]:
    return {**arrays, "header": json.dumps({**json.loads(str(arrays["header"])), **values})}


@pytest.mark.parametrize("command", ["check-result", "path", "densify"])
@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("radius", float("inf"), "radius must be positive and below 1e+100"),
        ("radius", float("nan"), "radius must be positive"),
        ("radius", -1.0, "radius must be positive"),
        ("epsilon", float("nan"), "epsilon must lie between 0 and 1"),
        ("seconds", float("nan"), "seconds must be finite"),
        ("quality_seconds", float("-inf"), "seconds must be finite"),
        ("quality", ["a"], "quality must be the name of an index"),
        ("version", [[1] * 1000], "has version a list"),
        ("problem", None, "problem must be a table"),
        ("others", 7, "damaged"),
        ("requirements", 7, "damaged"),
        ("rejected", [7], "damaged"),
        ("dimension", 10**30, "dimension must be a whole number"),
    ],
)
def test_headers(
    arrays: dict[str, Any], command: str, name: str, value: object, reason: str, refused: Any, tmp_path: Path
) -> None:
    np.savez(tmp_path / "r.npz", **header_with(arrays, **{name: value}))
    words = [command, tmp_path / "r.npz", *(["0.3"] if command == "densify" else [])]
    assert reason in refused(*words)


@pytest.mark.parametrize("command", ["check-result", "path", "densify", "view"])
def test_centres_that_are_no_configurations(arrays: dict[str, Any], command: str, refused: Any, tmp_path: Path) -> None:
    zero = np.zeros_like(arrays["centers"])
    one = arrays["centers"].copy()
    one[3] *= 1.001
    for centers in (zero, one):
        np.savez(tmp_path / "r.npz", **{**arrays, "centers": centers})
        words = [command, tmp_path / "r.npz", *(["0.3"] if command == "densify" else [])]
        assert "the object's rotation has length" in refused(*words, *(["--no-browser"] if command == "view" else []))


def test_a_header_that_is_nested_deeply(arrays: dict[str, Any], refused: Any, tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", **{**arrays, "header": "[" * 100_000})
    assert "damaged" in refused("check-result", tmp_path / "r.npz")


# The command line


@pytest.mark.parametrize(
    "words",
    [
        ["optimize", "planar_hand", "--output", ""],
        ["optimize", "planar_hand", "--threads", "99999999999999"],
        ["optimize", "planar_hand", "--dimension", "9" * 5000],
        ["optimize", "planar_hand", "--radius", "1e300"],
        ["new", "example_robot_data:allegro_right_hand", "--output", ""],
        ["schema", "--output", ""],
        ["sweep", "planar_hand", "--output", ""],
        ["reproduce", "--output", ""],
        ["check-result", ""],
        ["schema", "--output", LONG],
        ["schema", "--output", "nowhere/" * 1000],
        ["optimize", "planar_hand", "--output", LONG],
    ],
    ids=lambda words: " ".join(word[:12] for word in words),
)
def test_words(words: list[str], refused: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    refused(*words)
    assert not list(tmp_path.iterdir())


def test_numbers_of_charts(small_result: ga.Result, refused: Any, tmp_path: Path) -> None:
    small_result.save(tmp_path / "result.npz")
    for chart in ("9" * 5000, "9" * 30, "-1", "1.5", ""):
        refused("path", tmp_path, "--to", chart) if chart != "-1" else refused("path", tmp_path, "--to=-1")


def test_empty_paths_in_python(small_result: ga.Result) -> None:
    problem = ga.load_problem("planar_hand")
    for write in (
        lambda: ga.optimize(problem, radius=0.4, checkpoint=""),
        lambda: small_result.save(""),
        lambda: ga.export_html(small_result, ""),
        lambda: ga.load_result(""),
    ):
        with pytest.raises(ga.GraspAtlasError, match="the path is empty"):
            write()
    for path in ("a\0b", "a" * 5000):
        with pytest.raises(ga.GraspAtlasError, match="cannot write"):
            small_result.save(path)
        with pytest.raises(ga.GraspAtlasError, match="cannot read"):
            ga.load_result(path)


# Standard output, and Ctrl-C


PROGRAM = [sys.executable, "-m", "graspatlas"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
@pytest.mark.parametrize(
    "words", slow_but([["list"], ["schema"], ["--help"], ["--version"], ["optimize", "--help"]], ["list"])
)
@pytest.mark.parametrize("buffered", slow_but(["", "1"], ""))
def test_a_full_disk(words: list[str], buffered: str) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*PROGRAM, *words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            env={**os.environ, "PYTHONUNBUFFERED": buffered},
        )
    assert done.returncode == 2
    assert done.stderr.startswith("graspatlas: error: cannot write to standard output: No space left")
    assert done.stderr.count("\n") == 1


def test_a_reader_that_has_seen_enough() -> None:
    process = subprocess.Popen([*PROGRAM, "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 0
    process.stderr.close()


@pytest.mark.parametrize("program", [True, False], ids=["program", "import"])
def test_interrupts_while_importing(program: bool, tmp_path: Path) -> None:
    """The signal comes at several moments of the first second, in which everything is imported."""
    script = tmp_path / ("graspatlas" if program else "mine.py")
    script.write_text("import sys\nfrom graspatlas.cli import main\nsys.exit(main(sys.argv[1:]))\n")
    silent = 0
    for moment in (0.06, 0.1, 0.15, 0.2, 0.3, 0.5):
        process = subprocess.Popen(
            [sys.executable, str(script), "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        time.sleep(moment)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        # Not while Python itself was starting, or had not yet come to the first line of the package.
        if program and not re.search(r"site\.py|Fatal Python error: init|import start_up", err):
            assert "Traceback" not in err
            assert process.returncode in (-signal.SIGINT, 130, 0)
            silent += process.returncode == -signal.SIGINT
    assert silent or not program


def test_programs_keep_their_own_handling_of_interrupts() -> None:
    program = "import signal, graspatlas\nprint(signal.getsignal(signal.SIGINT) is signal.default_int_handler)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "True\n"


def test_box_urdf_is_sound() -> None:
    assert ga.Body("b", box_urdf("b", [0.1, 0.2, 0.3])).name == "b"
