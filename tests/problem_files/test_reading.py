"""Problem files: the bundled ones, every part of the format, and what is said of broken ones."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from helpers import DATA, ROOT, chain, robot

import graspatlas as ga
from graspatlas.hand.robot_files import described_robot, example_robot
from graspatlas.patches import patch_types
from graspatlas.problem_files import ProblemFileError, documents, json_schema, read_problem
from graspatlas.problem_files.schema import ProblemTable
from graspatlas.problems import problem_text
from graspatlas.requirements import requirement_from_dict

BUNDLED, _, ROBOTS = problem_text("schunk_can")
#: The can without the requirements at its end, so that cases can state their own.
CAN = BUNDLED.partition("\nrequirements:")[0] + "\n"
ALLEGRO = problem_text("allegro_cylinder_3")[0]


def read(text: str) -> ga.Problem:
    return read_problem(text, "can.yaml", ROBOTS)


def fault(text: str, folder: Path = ROBOTS) -> str:
    with pytest.raises(ProblemFileError) as caught:
        read_problem(text, "can.yaml", folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", ["planar_hand", "schunk_can", "schunk_oil_bottle"])
def test_the_papers_problems_are_what_they_were(name):
    stored = json.loads((DATA / "problems" / f"{name}.json").read_text(encoding="utf-8"))
    now = ga.load_problem(name).to_dict()
    now.pop("requirements", None)  # the paper's experiments have none
    assert now == ga.Problem.from_dict(stored).to_dict()


@pytest.mark.parametrize(("name", "radius"), [("planar_hand", 0.2), ("schunk_can", 0.34), ("schunk_oil_bottle", 0.2)])
def test_the_papers_problems_have_the_charts_that_they_had(name, radius):
    stored = json.loads((DATA / "problems" / f"{name}.json").read_text(encoding="utf-8"))
    old, new = (
        ga.optimize(p, radius=radius, require=[]) for p in (ga.Problem.from_dict(stored), ga.load_problem(name))
    )
    np.testing.assert_array_equal(new.atlas.centers, old.atlas.centers)
    np.testing.assert_array_equal(new.qualities, old.qualities)


@pytest.mark.parametrize("name", ga.bundled_problems())
def test_stored_problems_are_problem_files(name, tmp_path):
    problem = ga.load_problem(name)
    (tmp_path / "again.json").write_text(json.dumps(problem.to_dict()))
    assert ga.load_problem(tmp_path / "again.json").to_dict() == problem.to_dict()
    assert ga.Problem.from_dict(problem.to_dict()).to_dict() == problem.to_dict()


# Each broken file: what is replaced in the can's, by what, and what is said of it.
BROKEN: dict[str, tuple[str, str, str]] = {
    "negative radius": (
        "radius: 0.02224",
        "radius: -0.03",
        "can.yaml:31: contacts[0].object.radius: must be positive and below 1e+09, got -0.03",
    ),
    "radius of text": (
        "radius: 0.02224",
        "radius: wide",
        "can.yaml:31: contacts[0].object.radius: must be a number, got 'wide'",
    ),
    "radius misspelt": (
        "radius: 0.02224",
        "radus: 0.02224",
        "can.yaml:31: contacts[0].object.radus: field 'radus' is unknown; did you mean 'radius'?",
    ),
    "patch misspelt": (
        "type: cylinder",
        "type: cilinder",
        "can.yaml:30: contacts[0].object.type: patch type 'cilinder' is unknown; did you mean 'cylinder'?",
    ),
    "patch without type": (
        "      type: cylinder\n",
        "",
        "can.yaml:29: contacts[0].object: has no type; give one such as 'type: point'",
    ),
    "interval upside down": (
        "v_interval: [-0.037, 0.027]",
        "v_interval: [0.027, -0.037]",
        "can.yaml:32: contacts[0].object.v_interval: must be (lower, upper) with lower below upper, got "
        "(0.027, -0.037)",
    ),
    "interval of one": (
        "v_interval: [-0.037, 0.027]",
        "v_interval: [0.027]",
        "can.yaml:32: contacts[0].object.v_interval: must hold 2 items, got 1",
    ),
    "interval that is none": (
        "v_interval: [-0.037, 0.027]",
        "v_interval: 3",
        "can.yaml:32: contacts[0].object.v_interval: must be a list, got 3",
    ),
    "normal of zero": (
        "normal: [0.0085134960924787, 0.0, 0.999963759535456]",
        "normal: [0, 0, 0]",
        "can.yaml:28: contacts[0].hand.normal: must not be zero",
    ),
    "frame misspelt": (
        "frame: thumb_distal",
        "frame: thumb_distl",
        "can.yaml:43: contacts[2].frame: frame 'thumb_distl' is not in hand 'schunk_sah'; did you mean 'thumb_distal'?",
    ),
    "frozen nowhere": (
        "frozen: {u:",
        "frozen: {w:",
        "can.yaml:33: contacts[0].frozen.w: parameter 'w' is not one of a cylinder patch's; known: u, v",
    ),
    "joint forgotten": (
        "    thumb_pip: 0.0\n",
        "",
        "can.yaml:76: x1: x1 gives no position for joint 'thumb_pip' of hand 'schunk_sah'",
    ),
    "joint misspelt": (
        "    thumb_pip: 0.0\n",
        "    thumb_pipp: 0.0\n",
        "can.yaml:90: x1.joints.thumb_pipp: joint 'thumb_pipp' is not in hand 'schunk_sah'; did you mean 'thumb_pip'?",
    ),
    "joint twice": (
        "    thumb_pip: 0.0\n",
        "    thumb_pip: 0.0\n    thumb_pip: 0.0\n",
        "can.yaml:91: the field 'thumb_pip' stands twice, first on line 90",
    ),
    "x1 off its contacts": (
        "0.057596",
        "0.067596",
        "can.yaml:76: x1: x1 of problem 'schunk_can' misses its contacts (middle_distal: 10 mm, ",
    ),
    "x1 without rotation": (
        "[0.0, 0.0, 0.0, 1.0]",
        "[0, 0, 0, 0]",
        "can.yaml:76: x1: x1 has a quaternion of length zero",
    ),
    "quaternion of three": (
        "[0.0, 0.0, 0.0, 1.0]",
        "[0, 0, 1]",
        "can.yaml:93: x1.object_quat_xyzw: must hold 4 items, got 3",
    ),
    "place of text": (
        "object_xyz: [0.057596, 0.028845, 0.243568]",
        "object_xyz: here",
        "can.yaml:92: x1.object_xyz: must be a list, got 'here'",
    ),
    "place not finite": (
        "object_xyz: [0.057596,",
        "object_xyz: [.nan,",
        "can.yaml:92: x1.object_xyz[0]: must be finite, got nan",
    ),
    "negative length scale": (
        "length_scale: 0.01",
        "length_scale: -1",
        "can.yaml:19: length_scale: must be positive, got -1",
    ),
    "length scale misspelt": (
        "length_scale: 0.01",
        "length_scal: 0.01",
        "can.yaml:19: length_scal: field 'length_scal' is unknown; did you mean 'length_scale'?",
    ),
    "length scale true": (
        "length_scale: 0.01",
        "length_scale: true",
        "can.yaml:19: length_scale: must be a number, got True",
    ),
    "missing URDF": (
        "urdf: schunk_sah/schunk_sah.urdf",
        "urdf: nowhere.urdf",
        "can.yaml:12: hand.urdf: file 'nowhere.urdf' does not exist; looked for it at ",
    ),
    "two hands": (
        "  urdf: schunk_sah/schunk_sah.urdf",
        "  urdf: schunk_sah/schunk_sah.urdf\n  example_robot_data: allegro_right_hand",
        "can.yaml:10: hand: the hand needs exactly one of urdf, example_robot_data, robot_descriptions, got urdf and ",
    ),
    "unknown robot": (
        "  urdf: schunk_sah/schunk_sah.urdf",
        "  example_robot_data: alegro_right_hand",
        "can.yaml:12: hand.example_robot_data: robot 'alegro_right_hand' is not in example-robot-data; did you mean "
        "'allegro_right_hand'?",
    ),
    "unknown moving joint": (
        "  srdf: schunk",
        "  joints: [thumb_pipp]\n  srdf: schunk",
        "can.yaml:13: hand.joints[0]: joint 'thumb_pipp' is not one of hand 'schunk_sah' that moves; did you mean "
        "'thumb_pip'?",
    ),
    "locked beyond its limits": (
        "  srdf: schunk",
        "  locked: {thumb_pip: 9}\n  srdf: schunk",
        "can.yaml:13: hand.locked.thumb_pip: joint 'thumb_pip' is locked at 9, outside its limits [-0.349066, 1.91986]",
    ),
    "x1 beyond a limit": (
        "  srdf: schunk",
        "  limits: {thumb_opposition: [0.0, 1.304]}\n  srdf: schunk",
        "can.yaml:88: x1.joints.thumb_opposition: x1 of problem 'schunk_can' breaks the upper limit of joint "
        "'thumb_opposition' by 0.1",
    ),
    "limits upside down": (
        "  srdf: schunk",
        "  limits: {thumb_pip: [1, -1]}\n  srdf: schunk",
        "can.yaml:13: hand.limits.thumb_pip: limits of joint 'thumb_pip' must be (lower, upper), got (1.0, -1.0)",
    ),
    "limits without a range": (
        "  srdf: schunk",
        "  enlarge_limits: -2\n  srdf: schunk",
        "can.yaml:10: hand: limits of joint 'middle_abduction' must be (lower, upper), got ",
    ),
    "sphere of nothing": (
        "  urdf: objects/can.urdf",
        "  sphere: {radius: 0}",
        "can.yaml:17: object.sphere.radius: must be positive, got 0",
    ),
    "box of a list": (
        "  urdf: objects/can.urdf",
        "  box: [1, 2, 3]",
        "can.yaml:17: object.box: must be a table of names and values, got [1, 2, 3]",
    ),
    "missing mesh": (
        "  urdf: objects/can.urdf",
        "  mesh: x.stl",
        "can.yaml:17: object.mesh: file 'x.stl' does not exist; looked for it at ",
    ),
    "object that slides": (
        "  urdf: objects/can.urdf",
        "  urdf: objects/can.urdf\n  joint: slider",
        "can.yaml:18: object.joint: must be 'free_flyer' or 'planar', got 'slider'",
    ),
    "guess of two numbers": (
        "  urdf: objects/can.urdf",
        "  urdf: objects/can.urdf\n  pose_guess: {xyz: [0, 0.1]}",
        "can.yaml:18: object.pose_guess.xyz: must hold 3 items, got 2",
    ),
    "guess of a rotation alone": (
        "  urdf: objects/can.urdf",
        "  urdf: objects/can.urdf\n  pose_guess:\n    quat_xyzw: [0, 0, 0, 1]",
        "can.yaml:18: object.pose_guess.xyz: is missing",
    ),
    "guess without rotation": (
        "  urdf: objects/can.urdf",
        "  urdf: objects/can.urdf\n  pose_guess:\n    xyz: [0, 0, 0]\n    quat_xyzw: [0, 0, 0, 0]",
        "can.yaml:18: object.pose_guess: the pose guess has a quaternion of length zero",
    ),
    "guess out of the plane": (
        "  urdf: objects/can.urdf",
        "  urdf: objects/can.urdf\n  joint: planar\n  pose_guess: {xyz: [0, 0, 0.1]}",
        "can.yaml:19: object.pose_guess: the object moves in the x-y plane, so 'pose_guess' must lie there: z = 0, and "
        "turned about z only",
    ),
    "guess misspelt": (
        "  urdf: objects/can.urdf",
        "  urdf: objects/can.urdf\n  pose_gess: {xyz: [0, 0, 0.1]}",
        "can.yaml:18: object.pose_gess: field 'pose_gess' is unknown; did you mean 'pose_guess'?",
    ),
    "unknown index": (
        "quality: manipulability_volume",
        "quality: manipulability_volum",
        "can.yaml:100: defaults.quality: quality index 'manipulability_volum' is unknown; did you mean "
        "'manipulability_volume'?",
    ),
    "half a dimension": (
        "dimension: 2",
        "dimension: 2.5",
        "can.yaml:97: defaults.dimension: must be a whole number, got 2.5",
    ),
    "epsilon too large": (
        "epsilon: 0.5",
        "epsilon: 1.5",
        "can.yaml:99: defaults.epsilon: must be below 1, got 1.5",
    ),
    "mean of text": (
        "  mean: # [rad]\n    [0.0,",
        "  mean: # [rad]\n    [a,",
        "can.yaml:60: hand_motions.mean[0]: must be a number, got 'a'",
    ),
    "short mean": (
        "  mean: # [rad]\n    [0.0,",
        "  mean: # [rad]\n    [",
        "can.yaml:53: hand_motions: hand motions of 13 joints need a mean of shape (13,) and a covariance of shape ",
    ),
    "ragged covariance": (
        "    - [0.0, 0.0, 0.0,",
        "    - [0.0, 0.0,",
        "can.yaml:53: hand_motions: row 0 of the covariance holds 12 numbers, not 13",
    ),
    "motions of another hand": (
        "[middle_abduction,",
        "[little_dip,",
        "can.yaml:56: hand_motions.joints[0]: joint 'little_dip' is not one of the hand's that move; did you mean "
        "'middle_dip'?",
    ),
    "a coupling twice": (
        "  mean: # [rad]\n",
        "  couplings: [{index_pip: 1}, {index_pip: 2}]\n  mean: # [rad]\n",
        "can.yaml:53: hand_motions: a coupling of the hand motions is empty or follows from the others: drop it",
    ),
    "a coupling of nobody": (
        "  mean: # [rad]\n",
        "  couplings: [{index_pipp: 1}]\n  mean: # [rad]\n",
        "can.yaml:59: hand_motions.couplings[0].index_pipp: joint 'index_pipp' is not one that moves; did you mean "
        "'index_pip'?",
    ),
    "missing postures": (
        "hand_motions:\n",
        "hand_motions:\n  samples: postures.csv\nx:\n",
        "can.yaml:55: x: field 'x' is unknown; did you mean 'x1'?",
    ),
    "negative friction": (
        "contacts:",
        "requirements: [force_closure: {friction: -1}]\ncontacts:",
        "can.yaml:23: requirements[0].force_closure.friction: must be positive, got -1.0",
    ),
    "unknown requirement": (
        "contacts:",
        "requirements: [force_closur]\ncontacts:",
        "can.yaml:23: requirements[0].force_closur: field 'force_closur' is unknown; did you mean 'force_closure'?",
    ),
    "unknown value of a requirement": (
        "contacts:",
        "requirements: [force_closure: {fiction: 1}]\ncontacts:",
        "can.yaml:23: requirements[0].force_closure.fiction: field 'fiction' is unknown; did you mean 'friction'?",
    ),
    "code": (
        "name: schunk_can",
        "name: !!python/object/apply:os.system [ls]",
        "can.yaml:2: the tag tag:yaml.org,2002:python/object/apply:os.system is not allowed: use plain tables and "
        "lists",
    ),
    "an alias in itself": (
        "name: schunk_can",
        "name: &a [*a]",
        "can.yaml:2: an alias (*) stands within its own anchor (&)",
    ),
    "a template's blank": (
        "frame: thumb_distal",
        "frame: FILL_IN",
        "can.yaml:43: contacts[2].frame: is still to be filled in; the comment beside it says with what",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files(name):
    old, new, message = BROKEN[name]
    assert old in CAN
    said = fault(CAN.replace(old, new, 1))
    assert said.startswith(message) if message.endswith((" ", "by 0.1")) else said == message


WHOLE = {
    "nothing": ("", "can.yaml:1: is empty"),
    "a list": ("[]", "can.yaml:1: must be a table of names and values, got []"),
    "null": ("null", "can.yaml:1: must be a table of names and values, got nothing"),
    "half a table": ("hand: {", "can.yaml:1: is not YAML: "),
    "two colons": ("a: b: c", "can.yaml:1: is not YAML: mapping values are not allowed here"),
    "two documents": ("a: 1\n---\nb: 2", "can.yaml:2: is not YAML: expected a single document"),
    "no text": ("name: x\n\0", "can.yaml:2: is not YAML: it holds the character"),
    "a table as name": ("? {a: 1}\n: 2", "can.yaml:1: a name of a field must be a text"),
    "no contacts": (
        "hand: {urdf: a}\nobject: {sphere: {radius: 1}}\ncontacts: []",
        "can.yaml:3: contacts: must hold at least 1 item, got 0",
    ),
    "no hand": ("name: x\nobject: {sphere: {radius: 1}}", "can.yaml:1: hand: is missing (and 1 more fault"),
}


@pytest.mark.parametrize("name", WHOLE)
def test_files_that_hold_something_else(name):
    text, message = WHOLE[name]
    assert fault(text).startswith(message)


def test_all_faults_are_kept_in_the_order_of_the_file():
    text = CAN.replace("radius: 0.02224", "radius: wide").replace("dimension: 2", "dimension: two")
    with pytest.raises(ProblemFileError) as caught:
        read(text)
    assert [one.split(":")[1] for one in caught.value.faults] == ["31", "41", "50", "97"]
    assert str(caught.value).endswith("(and 3 more faults: graspatlas check lists them)")


def test_many_aliases_of_aliases_are_refused():
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i + 1}: &a{i + 1} [{', '.join([f'*a{i}'] * 10)}]" for i in range(8)]
    assert "more than 1000000 fields" in fault("\n".join(lines))


NUMBERS = {
    "1e-3": 1e-3, "-.5": -0.5, "1.": 1.0, "+2": 2, "0": 0, "017": 17, ".inf": np.inf, "-Infinity": -np.inf, "1E5": 1e5,
    "0x10": "0x10", "e5": "e5", "12:30": "12:30",
    "true": True, "null": None, "~": None, "": None, "yes": "yes", "y": "y", "1_000": "1_000",
    "'1'": "1", "2001-01-01": "2001-01-01",
}  # fmt: skip


@pytest.mark.parametrize("text", NUMBERS)
def test_numbers_and_words_of_yaml(text):
    value = documents.parse(f"a: {text}").data["a"]
    assert value == NUMBERS[text]
    assert type(value) is type(NUMBERS[text])


@pytest.mark.parametrize(
    "data", [float("nan"), -1e-300, 5e-324, "x\ny\t\"'", [], {}, None, True, [[1, 2.5]], "Ünïcode"]
)
def test_json_is_read_as_json(data):
    text = json.dumps({"a": data}, indent=1)
    assert json.dumps(documents.parse(text).data) == json.dumps({"a": data})


def test_lines_of_fields():
    document = documents.parse("a:\n  b: [1,\n    2]\nc:\n  - d: 3\n")
    assert [document.line(path) for path in [("a",), ("a", "b"), ("a", "b", 1), ("c", 0, "d"), ("c", 0, "x", 5)]] == [
        1, 2, 3, 5, 5,
    ]  # fmt: skip


FINGER = robot(
    chain("f", (0.02, 0.0, 0.1), ["0 0 1", "0 1 0", "0.3 1 0.2"], 0.05, ["revolute", "continuous", "prismatic"])
)


def test_locked_joints_are_where_they_would_be():
    """The locked hand against Pinocchio's own reduced model."""
    locked = {"f0": 0.7, "f2": -0.03}
    hand = ga.Hand("h", FINGER).with_joints(None, locked)
    assert hand.joints == ("f1",)
    full = pin.buildModelFromXML(FINGER)
    q = pin.neutral(full)
    q[0], q[3] = locked["f0"], locked["f2"]
    reduced = pin.buildReducedModel(full, [full.getJointId(name) for name in locked], q)
    turn = np.array([np.cos(0.4), np.sin(0.4)])
    data = reduced.createData()
    pin.framesForwardKinematics(reduced, data, turn)
    places = hand.link_placements(turn)
    for name in ("f_0", "f_1", "f_2", "f_tip"):
        np.testing.assert_allclose(places[name], data.oMf[reduced.getFrameId(name)].homogeneous, atol=1e-14)


def test_joints_that_move_and_the_rest_locked():
    hand = ga.Hand.from_urdf("schunk_sah/schunk_sah.urdf", limits={"thumb_pip": (0.0, 1.0), "index_pip": (0.0, 1.0)})
    less = hand.with_joints(["index_pip", "index_mcp"], {"thumb_pip": 0.5})
    assert set(less.joints) == {"index_pip", "index_mcp"}
    assert less.limits == {"index_pip": (0.0, 1.0)}
    assert hand.with_joints() is hand
    with pytest.raises(ga.GraspAtlasError, match="'index_pip' is among the joints that move and among the locked"):
        hand.with_joints(["index_pip"], {"index_pip": 0.0})
    with pytest.raises(ga.GraspAtlasError, match=r"'joint_12.0' is locked at 0, outside its limits \[0.263, 1.396\]"):
        ga.Hand.from_urdf(example_robot("allegro_right_hand")).with_joints(["joint_0.0"])


def test_enlarged_limits():
    text = CAN.replace("  srdf: schunk", "  limits: {index_pip: [0, 1]}\n  enlarge_limits: 0.1\n  srdf: schunk")
    hand, before = read(text).hand, ga.load_problem("schunk_can").hand
    at = hand.joints.index("index_pip")
    lower, upper = (new - old for new, old in zip(hand.joint_limits, before.joint_limits, strict=True))
    np.testing.assert_allclose(np.delete(lower, at), -0.1, atol=1e-12)
    np.testing.assert_allclose(np.delete(upper, at), 0.1, atol=1e-12)
    assert (hand.joint_limits[0][at], hand.joint_limits[1][at]) == (0.0, 1.0)


OBJECTS = {
    "sphere: {radius: 0.02}": (0.04, 0.04, 0.04),
    "box: {size: [0.01, 0.02, 0.03]}": (0.01, 0.02, 0.03),
    "cylinder: {radius: 0.02, length: 0.1}": (0.04, 0.04, 0.1),
}


@pytest.mark.parametrize("text", OBJECTS)
def test_primitive_objects(text):
    body = read(CAN.replace("urdf: objects/can.urdf", text)).object
    model = pin.buildModelFromXML(body.urdf)
    for kind in (pin.VISUAL, pin.COLLISION):
        (shape,) = pin.buildGeomFromUrdfString(model, body.urdf, kind).geometryObjects
        shape.geometry.computeLocalAABB()
        box = shape.geometry.aabb_local
        np.testing.assert_allclose(box.max_ - box.min_, OBJECTS[text], rtol=1e-9)


def test_an_object_of_a_mesh(tmp_path):
    (tmp_path / "parts").mkdir()
    corners = "".join(f"v {x} {y} {z}\n" for x in (0, 10) for y in (0, 20) for z in (0, 30))
    (tmp_path / "parts" / "block.obj").write_text(corners + "f 1 2 3\nf 2 4 3\nf 5 6 7\nf 6 8 7\n")
    text = CAN.replace("urdf: objects/can.urdf", "mesh: parts/block.obj\n  scale: 0.001")
    text = text.replace("schunk_sah/schunk", str(ROBOTS / "schunk_sah/schunk"))
    problem = read_problem(text, "p.yaml", tmp_path)
    for body in (problem.object, ga.Problem.from_dict(problem.to_dict()).object):
        model = pin.buildModelFromXML(body.urdf)
        found = pin.buildGeomFromUrdfString(model, body.urdf, pin.COLLISION, package_dirs=list(body.package_dirs))
        geometry = found.geometryObjects[0].geometry
        geometry.computeLocalAABB()
        np.testing.assert_allclose(geometry.aabb_local.max_, [0.01, 0.02, 0.03], rtol=1e-6)


def test_package_paths(tmp_path):
    (tmp_path / "ros" / "my_hand").mkdir(parents=True)
    (tmp_path / "ros" / "my_hand" / "hand.urdf").write_text(ga.load_problem("schunk_can").hand.urdf)
    text = CAN.replace("urdf: schunk_sah/schunk_sah.urdf", "urdf: package://my_hand/hand.urdf\n  package_paths: [ros]")
    text = text.replace("objects/can.urdf", str(ROBOTS / "objects/can.urdf"))
    text = text.replace("schunk_sah/schunk_sah.srdf", str(ROBOTS / "schunk_sah/schunk_sah.srdf"))
    hand = read_problem(text, "p.yaml", tmp_path).hand
    assert hand.package_dirs[0] == str(tmp_path / "ros")
    assert ga.Hand.from_dict(hand.to_dict()).package_dirs[0] == str(tmp_path / "ros")
    assert "hand.urdf" in fault(text.replace("  package_paths: [ros]", " "), tmp_path)


def test_robot_descriptions_are_optional(monkeypatch):
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    text = CAN.replace("urdf: schunk_sah/schunk_sah.urdf", "robot_descriptions: allegro_hand_description")
    assert fault(text) == (
        "can.yaml:12: hand.robot_descriptions: robot_descriptions is not installed: pip install graspatlas[hands]"
    )


def test_robots_of_robot_descriptions(monkeypatch, tmp_path):
    """A package made here stands for the real one, which would fetch from the network."""
    package = tmp_path / "robot_descriptions"
    package.mkdir()
    (package / "__init__.py").write_text("")
    place = repr(str(tmp_path / "cache" / "models" / "hand"))
    (package / "my_hand_description.py").write_text(
        f"REPOSITORY_PATH = {str(tmp_path / 'cache')!r}\nPACKAGE_PATH = {place}\nURDF_PATH = {place} + '/hand.urdf'\n"
    )
    (package / "broken_description.py").write_text("raise OSError('no network')\n")
    for name in [name for name in sys.modules if name.startswith("robot_descriptions")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(str(tmp_path))
    urdf, folders = described_robot("my_hand_description")
    assert Path(urdf) == tmp_path / "cache/models/hand/hand.urdf"
    assert folders == tuple(str(tmp_path / f) for f in ("cache/models", "cache/models/hand", "cache"))
    with pytest.raises(ga.GraspAtlasError, match="did you mean 'my_hand_description'"):
        described_robot("my_hand")
    with pytest.raises(ga.GraspAtlasError, match=r"cannot fetch 'broken_description': no network; .*path of a URDF"):
        described_robot("broken_description")
    (package / "far_description.py").write_text(f"raise OSError('git fetch -v {'x' * 300}: fatal: no such host')\n")
    with pytest.raises(ga.GraspAtlasError, match=r"cannot fetch 'far_description': no such host; .*path of a URDF"):
        described_robot("far_description")
    for name in ("robot_descriptions", "robot_descriptions.my_hand_description"):
        monkeypatch.delitem(sys.modules, name, raising=False)


def with_samples(file: str) -> str:
    begin, end = CAN.index("hand_motions:"), CAN.index("x1:")
    text = CAN[:begin] + f"hand_motions:\n  samples: {file}\n\n" + CAN[end:]
    return text.replace("schunk_sah/schunk", str(ROBOTS / "schunk_sah/schunk")).replace(
        "objects/can.urdf", str(ROBOTS / "objects/can.urdf")
    )


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_recorded_postures(ending, tmp_path):
    joints = ga.load_problem("schunk_can").hand.joints
    samples = np.random.default_rng(3).normal(size=(50, len(joints)))
    if ending == "csv":
        np.savetxt(tmp_path / "p.csv", samples, delimiter=",", header=", ".join(joints), comments="", fmt="%.17g")
    else:
        np.savez(tmp_path / "p.npz", samples=samples, joints=np.array(joints))
    motions = read_problem(with_samples(f"p.{ending}"), "p.yaml", tmp_path).motions
    expected = ga.HandMotions.from_samples(samples, joints)
    assert motions.joints == expected.joints
    np.testing.assert_array_equal(motions.covariance, expected.covariance)


def test_postures_of_locked_joints_are_left_out(tmp_path):
    hand = ga.load_problem("schunk_can").hand
    samples = np.random.default_rng(3).normal(size=(50, len(hand.joints)))
    np.savetxt(tmp_path / "p.csv", samples, delimiter=",", header=",".join(hand.joints), comments="")
    text = with_samples("p.csv").replace("  srdf", "  locked: {thumb_dip: 0}\n  srdf")
    text = text.replace("    thumb_dip: 0.0\n", "")
    motions = read_problem(text, "p.yaml", tmp_path).motions
    keep = [i for i, name in enumerate(hand.joints) if name != "thumb_dip"]
    assert motions.joints == tuple(hand.joints[i] for i in keep)
    np.testing.assert_allclose(motions.mean, samples[:, keep].mean(axis=0))


WRONG_POSTURES = {
    "": "'p.csv' is empty",
    "a,b\n1,2,3\n": "'p.csv', line 2: 3 columns, but 2 joints",
    "a,b\n\n1,x\n": "'p.csv', line 3: joint 'b' must be a finite number, got 'x'",
    "a,b\n1,nan\n": "joint 'b' must be a finite number",
    "a,b\n1,2\n": "samples: must have shape (z, 2) with z of at least 2, got (1, 2)",
    "a,b\n1,2\n3,4\n": "joint 'a' is not one of the hand's that move",
    "index_pip\n1\n2\n": "say nothing of joint 'index_abduction', which moves",
}


@pytest.mark.parametrize("content", WRONG_POSTURES)
def test_wrong_postures(content, tmp_path):
    (tmp_path / "p.csv").write_text(content)
    assert WRONG_POSTURES[content] in fault(with_samples("p.csv"), tmp_path)


def test_postures_that_would_run_code_are_refused(tmp_path):
    np.savez(tmp_path / "p.npz", samples=np.array([{"a": 1}], object), joints=np.array(["a"]))
    assert "needs the arrays samples" in fault(with_samples("p.npz"), tmp_path)


def test_couplings_hold_in_every_grasp():
    problem = ga.load_problem("allegro_cylinder_3")
    assert problem.frozen_motions(2) == len(problem.motions.couplings) == 5
    atlas = ga.optimize(problem, radius=0.3, require=()).atlas
    q = [dict(zip(problem.hand.joints, row, strict=True)) for row in atlas.centers[:, : len(problem.hand.joints)]]
    x1 = problem.x1.joints
    for row in problem.motions.to_dict()["couplings"]:
        sums = [sum(c * (one[name] - x1[name]) for name, c in row.items()) for one in q]
        np.testing.assert_allclose(sums, 0.0, atol=1e-6)
    assert np.ptp([one["joint_2.0"] for one in q]) > 0.1
    for dimension, words in (
        (3, "5 couplings, which are always frozen, so s = 4 is too few"),
        (1, "s = 6 is too many"),
    ):
        with pytest.raises(ga.GraspAtlasError, match=words):
            problem.system(dimension)


def test_couplings_come_before_postures():
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(100, 4)) * [3.0, 2.0, 1.0, 0.5]
    plain = ga.HandMotions.from_samples(samples, "abcd")
    row = np.array([[1.0, -0.7, 0.0, 0.0]])
    motions = ga.HandMotions(plain.joints, plain.mean, plain.covariance, row)
    np.testing.assert_allclose(motions.E.T @ motions.E, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(np.abs(motions.frozen(1)[:, 0]), np.abs(row[0]) / np.hypot(1, 0.7), atol=1e-12)
    np.testing.assert_allclose(row @ motions.kept(1), 0.0, atol=1e-12)
    kept = motions.variances[:3]
    assert (np.diff(kept) <= 1e-12).all()
    # What stays is the best of what the coupling allows: by projection, an independent route.
    P = np.eye(4) - row.T @ row / (row @ row.T)
    expected = np.sort(np.linalg.eigvalsh(P @ plain.covariance @ P))[::-1][:3]
    np.testing.assert_allclose(kept, expected, rtol=1e-9)
    again = motions.reordered("dcba").reordered("abcd")
    np.testing.assert_array_equal(again.couplings, motions.couplings)
    stored = ga.HandMotions.from_dict(json.loads(json.dumps(motions.to_dict())))
    np.testing.assert_array_equal(stored.couplings, motions.couplings)
    with pytest.raises(ga.GraspAtlasError, match="leave nothing"):
        ga.HandMotions.from_couplings([{"a": 1}, {"b": 1}], "ab")


@pytest.mark.parametrize("name", [name for name in ga.bundled_problems() if name != "planar_hand"])
def test_what_a_newcomer_gets_by_default_can_be_executed(name):
    """Every bundled hand in space asks for closure and freedom from collision, and has grasps that keep them."""
    problem = ga.load_problem(name)
    assert {r.name for r in problem.requirements} == {"force_closure", "collision_free"}
    result = ga.optimize(problem)
    best = ga.Grasps(problem, result.best.x)
    assert ga.CollisionFree().met(best).all()
    (closure,) = (r for r in problem.requirements if r.name == "force_closure")
    assert ga.quality.force_closure_margin(best, closure.friction, closure.torsional)[0] >= closure.margin > 0.0


def test_the_files_requirements_are_the_default():
    problem = ga.load_problem("allegro_cylinder_3")
    assert [str(r) for r in problem.requirements] == ["force_closure:0.5:0.02", "collision_free:0.002:0"]
    result = ga.optimize(problem, radius=0.4)
    assert result.requirements == problem.requirements
    assert 0 < result.accepted.sum() < len(result.accepted)
    assert ga.optimize(problem, radius=0.4, require=()).accepted.all()
    assert ga.optimize(problem, radius=0.4, require=[ga.JointMargin(0.01)]).requirements == (ga.JointMargin(0.01),)


@pytest.mark.parametrize(
    "data", [{}, {"a": {}, "b": {}}, "x", {"beauty": {}}, {"force_closure": {"fiction": 1}}], ids=str
)
def test_requirements_that_are_none(data):
    with pytest.raises(ga.GraspAtlasError, match="requirement"):
        requirement_from_dict(data)


def test_the_name_is_the_files_by_default(tmp_path):
    (tmp_path / "my_problem.yml").write_text(
        ALLEGRO.replace("name: allegro_cylinder_3\n", "").replace("allegro/", f"{ROBOTS}/allegro/")
    )
    assert ga.load_problem(tmp_path / "my_problem.yml").name == "my_problem"


def test_x1_and_reference_may_be_left_out_or_given():
    data = documents.parse(CAN[: CAN.index("x1:")] + "reference: {thumb_pip: 0.1}\n").data
    table = ProblemTable.model_validate(data)
    assert table.x1 is None
    assert table.reference == {"thumb_pip": 0.1}
    assert "x2" in fault(CAN.replace("x1:\n", "x2:\n"))


PAGE = (ROOT / "docs" / "problem_files.md").read_text(encoding="utf-8")


def test_the_example_of_the_documentation_holds():
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    problem = read_problem(text, "example.yaml")
    result = ga.optimize(problem)
    assert result.is_global
    assert 100 < result.accepted.sum() < len(result.accepted)
    assert result.check().passed


def test_the_documentation_names_every_field():
    schema = json_schema()
    for table in ("problem", "HandTable", "ObjectTable", "ContactTable", "MotionsTable", "FirstGraspTable"):
        for field in (schema if table == "problem" else schema["$defs"][table])["properties"]:
            assert field.endswith("_text") or re.search(rf"\b{field}\b", PAGE), f"{table}.{field}"


def test_every_patch_and_requirement_is_in_the_schema():
    schema = json_schema()
    text = json.dumps(schema)
    for cls in patch_types():
        table = schema["$defs"][f"{cls.__name__}Table"]
        assert table["properties"]["type"]["const"] == cls.kind
        assert table["additionalProperties"] is False
        assert table["description"]
    for name in (*ga.quality.INDICES, *(r for r in ga.requirements.REQUIREMENTS)):
        assert f'"{name}"' in text


ODD = [None, True, 0, -1, 3.5, 1e30, np.nan, -np.inf, "", "x", [], [1], ["x"], [[]], {}, {"x": 1}, {"type": "point"}]


@pytest.mark.parametrize("text", [CAN, ALLEGRO], ids=["can", "allegro"])
def test_odd_values_anywhere_are_refused_in_one_line(text):
    """Any field replaced by anything, or dropped: a problem, or one line that names the file."""
    rng = np.random.default_rng(5)
    document = documents.parse(text)
    paths = [path for path in document.lines if path]
    refused = []
    for _ in range(150):
        data = json.loads(json.dumps(document.data))
        *path, last = paths[rng.integers(len(paths))]
        place = data
        for key in path:
            place = place[key]
        if rng.uniform() < 0.1:
            del place[last]
        else:
            place[last] = ODD[rng.integers(len(ODD))]
        try:
            read_problem(json.dumps(data), "odd.json", ROBOTS)
        except ProblemFileError as error:
            refused.append(str(error))
    assert len(refused) > 100
    assert [message for message in refused if not re.fullmatch(r"odd\.json:\d+: .+", message)] == []


def test_the_schema_takes_a_requirement_by_its_name_alone():
    choices = json_schema()["properties"]["requirements"]["items"]["anyOf"]
    assert {"enum": list(ga.requirements.REQUIREMENTS), "type": "string"} in choices
    assert {"$ref": "#/$defs/RequirementTable"} in choices
    assert str(
        read(CAN.replace("contacts:", "requirements: [collision_free, joint_margin:]\ncontacts:")).requirements[1]
    ) == ("joint_margin:0.05")


def fields_without_description(schema: dict[str, Any]) -> list[str]:
    tables = {"problem": schema, **schema["$defs"]}
    return [
        f"{name}.{field}"
        for name, table in tables.items()
        for field, entry in table.get("properties", {}).items()
        if field not in ("type",) and not entry.get("description") and "$ref" not in entry
    ]


def test_every_field_is_described():
    assert fields_without_description(json_schema()) == []
