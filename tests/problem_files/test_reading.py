"""Problem files: the bundled ones, every part of the format, and what is said of broken ones."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from helpers import DATA, slow_but
from problem_texts import ALLEGRO, CAN, ROBOTS, fault, read

import graspatlas as ga
from graspatlas.hand.robot_files import described_robot
from graspatlas.problem_files import ProblemFileError, documents, read_problem
from graspatlas.problem_files.schema import ProblemTable
from graspatlas.requirements import requirement_from_dict


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
        "can.yaml:10: hand: the hand needs exactly one of urdf, mjcf, example_robot_data, robot_descriptions, got ",
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


def test_a_scale_that_would_be_passed_over_is_refused():
    said = fault(CAN.replace("urdf: objects/can.urdf", "sphere: {radius: 0.02}\n  scale: 0.001"))
    assert "object: scale is for a mesh; state other sizes in metres" in said


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


@pytest.mark.parametrize(
    "name",
    slow_but(
        [name for name in ga.bundled_problems() if name != "planar_hand"],
        "schunk_can",
        "allegro_sphere_3",
        "gripper_skittle",
    ),
)
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
    assert [str(r) for r in problem.requirements] == ["force_closure:0.5:0.02", "collision_free:5e-05:0"]
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
