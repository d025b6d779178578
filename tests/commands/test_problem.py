"""graspatlas new and schema: problem files to fill in, and what they may hold."""

from __future__ import annotations

import json

import numpy as np
import pytest
from helpers import BENT, DATA, tripod_problem

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.problem_files import ProblemFileError, json_schema, read_problem
from graspatlas.problem_files.reading import FILL_IN

HANDS = {
    "a file": (lambda folder: str(folder / "hand.urdf"), "urdf: hand.urdf"),
    "example-robot-data": (
        lambda folder: "example_robot_data:allegro_right_hand",
        "example_robot_data: allegro_right_hand",
    ),
}


@pytest.mark.parametrize("name", HANDS)
def test_a_new_problem_names_what_is_left_to_fill_in(name, tmp_path, capsys):
    make, source = HANDS[name]
    (tmp_path / "hand.urdf").write_text(tripod_problem(BENT).hand.urdf)
    path = tmp_path / "new.yaml"
    assert main(["new", make(tmp_path), "--output", str(path)]) == 0
    text = path.read_text()
    assert f"  {source}\n" in text
    with pytest.raises(ProblemFileError) as caught:
        ga.load_problem(path)
    lines = [i for i, line in enumerate(text.splitlines(), 1) if f": {FILL_IN}" in line]
    assert [int(one.removeprefix(f"{path}:").split(":")[0]) for one in caught.value.faults] == lines
    assert main(["check", str(path)]) == 1
    assert capsys.readouterr().out.count("is still to be filled in") == len(lines)
    assert main(["new", make(tmp_path), "--output", str(path)]) == 2
    assert "exists" in capsys.readouterr().err


def test_a_new_problem_filled_in_is_one(tmp_path, capsys, monkeypatch):
    """The template of the tripod, filled in by its own comments, is the tripod."""
    monkeypatch.chdir(tmp_path)
    problem = tripod_problem(BENT)
    (tmp_path / "hand.urdf").write_text(problem.hand.urdf)
    (tmp_path / "plate.urdf").write_text(problem.object.urdf)
    assert main(["new", "hand.urdf", "--object", "plate.urdf"]) == 0
    text = capsys.readouterr().out
    for joint in problem.hand.joints:
        assert f"  #   {joint}" in text
        text = text.replace(f"#     {joint}: 0\n", f"     {joint}: {BENT[joint]!r}\n")
    for frame in problem.hand.frames:
        assert frame in text
    for contact in problem.contacts:
        hand, plane = contact.hand, contact.object
        text = text.replace(f"frame: {FILL_IN}", f"frame: {contact.frame}", 1)
        text = text.replace(f"position: {FILL_IN}", f"position: {list(hand.position)}", 1)
        text = text.replace(f"normal: {FILL_IN}", f"normal: {list(hand.normal)}", 1)
        rest = f"type: plane\n      origin: {list(plane.origin)}\n      normal: {list(plane.normal)} #"
        text = text.replace(f"type: {FILL_IN}", rest, 1)
    text = text.replace("# x1:", "x1:").replace("#   joints:\n", "   joints:\n")
    text = text.replace("#   object_xyz: [0, 0, 0.1]", "   object_xyz: [0, 0, 0]").replace(
        "#   object_quat", "   object_quat"
    )
    made = read_problem(text, "tripod.yaml", tmp_path)
    np.testing.assert_allclose(made.x1_array, problem.x1_array, atol=1e-12)
    assert made.full_dimension == problem.full_dimension
    assert [str(r) for r in made.requirements] == ["force_closure:0.5:0.02", "collision_free:0.002:0"]


def test_new_of_what_is_no_hand(tmp_path, capsys):
    assert main(["new", str(tmp_path / "none.urdf")]) == 2
    assert main(["new", "example_robot_data:allegro"]) == 2
    (tmp_path / "text.urdf").write_text("hello")
    assert main(["new", str(tmp_path / "text.urdf")]) == 2
    assert capsys.readouterr().err.count("\n") == 3


def test_schema(tmp_path, capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json_schema()
    path = tmp_path / "problem.schema.json"
    assert main(["schema", "--output", str(path)]) == 0
    assert main(["schema", "--output", str(path)]) == 0
    assert json.loads(path.read_text()) == json_schema()
    assert main(["schema", "--output", str(tmp_path / "none" / "x.json")]) == 2


def test_pads_are_contacts_to_paste(tmp_path, capsys, monkeypatch):
    """The YAML of a hand's pads, each with an object, is the contacts of a problem, to a tenth of a micrometre."""
    monkeypatch.chdir(tmp_path)
    assert main(["pads", "three_finger_hand", "--output", "pads.yaml", "--picture", "pads.png"]) == 0
    assert (tmp_path / "pads.png").stat().st_size > 10_000
    assert main(["pads", "three_finger_hand"]) == 0
    text = (tmp_path / "pads.yaml").read_text()
    assert capsys.readouterr().out == text
    contacts = text.replace("- frame", "  object: {type: sphere, radius: 0.03}\n- frame").split("\n", 3)[3]
    contacts += "  object: {type: sphere, radius: 0.03}\n"
    head = "hand: {urdf: three_finger_hand/three_finger_hand.urdf}\nobject: {sphere: {radius: 0.03}}\ncontacts:\n"
    problem = read_problem(head + contacts)
    pads = ga.find_pads(problem.hand)
    assert [contact.frame for contact in problem.contacts] == [pad.frame for pad in pads]
    for contact, pad in zip(problem.contacts, pads, strict=True):
        np.testing.assert_allclose(contact.hand.point(0.3, -0.2), pad.patch.point(0.3, -0.2), atol=2e-7)


def test_pads_of_links_and_of_what_is_none(capsys):
    assert main(["pads", "three_finger_hand", "--link", "palm"]) == 0
    assert "- frame: palm #" in capsys.readouterr().out
    assert main(["pads", "schunk_sah", "--link", "index_medial"]) == 0
    out = capsys.readouterr().out
    assert "- frame: index_medial #" in out
    assert main(["pads", "schunk_sah", "--link", "plam"]) == 2
    assert main(["pads", "schunk_shah"]) == 2
    assert main(["pads", "schunk_sah", "--picture", "pads.jpg"]) == 2
    assert main(["pads", "parallel_gripper", "--root", "palm"]) == 2
    errors = capsys.readouterr().err
    assert errors.count("graspatlas: error: ") == 4
    assert "did you mean 'palm'?" in errors
    assert "did you mean 'schunk_sah'?" in errors


@pytest.mark.filterwarnings("default::RuntimeWarning")
def test_new_and_pads_of_an_mjcf(tmp_path, capsys):
    """What is left out is said in one line each time."""
    pytest.importorskip("mujoco")
    claw = str(DATA / "mjcf/claw.xml")
    assert main(["new", claw, "--root", "palm", "--output", str(tmp_path / "claw.yaml")]) == 0
    text = (tmp_path / "claw.yaml").read_text()
    assert "  mjcf: " in text
    assert "\n  root: palm\n" in text
    assert main(["pads", claw, "--link", "thumb_tip"]) == 0
    out, err = capsys.readouterr()
    assert "- frame: thumb_tip #" in out
    lines = err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith("graspatlas: warning: '") and "left out" in line for line in lines)


def test_check_draws_a_problem(tmp_path, capsys):
    path = tmp_path / "gripper.png"
    assert main(["check", "gripper_skittle", "--picture", str(path)]) == 0
    assert path.stat().st_size > 10_000
    assert main(["check", "gripper_skittle", "--picture", str(tmp_path / "gripper.svg")]) == 2
    assert "must end in .png" in capsys.readouterr().err
