"""Hands in MJCF, against MuJoCo itself: where links are, shapes, limits, couplings; what is refused or left out."""

from __future__ import annotations

import importlib
import pickle
import shutil
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from helpers import DATA

import graspatlas as ga
from graspatlas import _core
from graspatlas.collision.shapes import read_shapes
from graspatlas.hand.embedded_meshes import mesh_folders
from graspatlas.hand.urdf import root_link
from graspatlas.problem_files.reading import read_problem

mujoco = pytest.importorskip("mujoco")
CLAW = DATA / "mjcf/claw.xml"


def shadow_path() -> Path:
    """The Shadow hand of gymnasium-robotics, which is not imported: that registers environments."""
    spec = importlib.util.find_spec("gymnasium_robotics")
    if spec is None or spec.origin is None:
        pytest.skip("gymnasium-robotics is not installed")
    return Path(spec.origin).parent / "envs/assets/hand/reach.xml"


HANDS = {"claw": lambda: CLAW, "shadow": shadow_path}
PALMS = {"claw": "palm", "shadow": "robot0:palm"}


def read(path: Path, **options: object) -> ga.Hand:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return ga.Hand.from_mjcf(path, **options)


@pytest.fixture(scope="module", params=HANDS)
def pair(request):
    """A hand, MuJoCo's own model, and the name of the palm."""
    path = HANDS[request.param]()
    return read(path), mujoco.MjModel.from_xml_path(str(path)), PALMS[request.param]


def postures(hand: ga.Hand, count: int):
    """Random postures within the limits, those that mimic others included."""
    rng = np.random.default_rng(0)
    ranges = hand.mechanism.ranges(hand.limits_by_name)
    for _ in range(count):
        driven = {n: rng.uniform(max(low, -2.0), min(high, 2.0)) for n, (low, high) in ranges.items()}
        yield hand.mechanism.completed(driven, "a posture")


def placed(model, data, palm: str, positions: dict[str, float]) -> np.ndarray:
    """Poses MuJoCo's joints; T_palm_world (4, 4)."""
    for name, position in positions.items():
        number = joint_number(model, name)
        data.qpos[model.jnt_qposadr[number]] = position
    mujoco.mj_kinematics(model, data)
    return np.linalg.inv(pose(data.body(palm).xpos, data.body(palm).xmat))


def joint_number(model, name: str) -> int:
    named = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    return named if named >= 0 else int(model.body(name.removesuffix("_joint")).jntadr[0])


def pose(position, matrix) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.reshape(matrix, (3, 3)), position
    return T


def test_links_and_sites_are_where_mujoco_has_them(pair):
    hand, model, palm = pair
    data, compared = mujoco.MjData(model), 0
    for positions in postures(hand, 20):
        T = placed(model, data, palm, positions)
        found = hand.link_placements(hand.configuration(positions))
        for place, count in ((data.body, model.nbody), (data.site, model.nsite)):
            for number in range(count):
                thing = place(number)
                if thing.name in found:
                    np.testing.assert_allclose(found[thing.name], T @ pose(thing.xpos, thing.xmat), atol=1e-9)
                    compared += 1
    assert compared >= 20 * 8


def test_limits_are_those_of_mujoco(pair):
    hand, model, _ = pair
    for name, (low, high) in hand.limits_by_name.items():
        number = joint_number(model, name)
        expected = model.jnt_range[number] if model.jnt_limited[number] else (-np.inf, np.inf)
        np.testing.assert_array_equal((low, high), expected)


def corners_of(model, data, geom: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the box round a geom along the world's axes, by its support in six directions."""
    T = pose(data.geom_xpos[geom], data.geom_xmat[geom])
    size, kind = model.geom_size[geom], int(model.geom_type[geom])
    ways = np.vstack([np.eye(3), -np.eye(3)]) @ T[:3, :3]
    geoms = mujoco.mjtGeom
    if kind == geoms.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        points = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
        reach = (ways @ points.T).max(axis=1)
    elif kind == geoms.mjGEOM_BOX:
        reach = np.abs(ways) @ size
    elif kind == geoms.mjGEOM_CYLINDER:
        reach = size[0] * np.hypot(ways[:, 0], ways[:, 1]) + size[1] * np.abs(ways[:, 2])
    elif kind == geoms.mjGEOM_CAPSULE:
        reach = size[0] + size[1] * np.abs(ways[:, 2])
    else:
        radii = size if kind == geoms.mjGEOM_ELLIPSOID else np.full(3, size[0])
        reach = np.linalg.norm(ways * radii, axis=1)
    return T[:3, 3] - reach[3:], T[:3, 3] + reach[:3]


def box_of(shape, T: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of a shape of the hand, whose joint is at T (4, 4)."""
    at = T @ shape.placement
    ways = np.vstack([np.eye(3), -np.eye(3)]) @ at[:3, :3]
    a, b = shape.sizes[0], shape.sizes[1]
    reach = {
        "sphere": lambda: np.full(6, a),
        "capsule": lambda: a + 0.5 * b * np.abs(ways[:, 2]),
        "cylinder": lambda: a * np.hypot(ways[:, 0], ways[:, 1]) + 0.5 * b * np.abs(ways[:, 2]),
        "box": lambda: 0.5 * np.abs(ways) @ shape.sizes,
    }.get(shape.kind, lambda: (ways @ np.asarray(shape.points).T).max(axis=1))()
    return at[:3, 3] - reach[3:], at[:3, 3] + reach[:3]


def test_collision_shapes_are_where_mujoco_has_its_geoms(pair):
    """The boxes round them, in a random posture; balls of triangles for ellipsoids are 1 % smaller at most."""
    hand, model, palm = pair
    data = mujoco.MjData(model)
    positions = next(iter(postures(hand, 1)))
    T = placed(model, data, palm, positions)
    # MuJoCo's world turned so that the palm is its frame, as the hand's is.
    data.geom_xpos[:] = data.geom_xpos @ T[:3, :3].T + T[:3, 3]
    data.geom_xmat[:] = (T[:3, :3] @ data.geom_xmat.reshape(-1, 3, 3)).reshape(-1, 9)
    links = hand.link_placements(hand.configuration(positions))
    shapes = read_shapes(hand.tree, hand.urdf, mesh_folders(hand))
    expected = {}
    for geom in range(model.ngeom):
        body = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, model.geom_bodyid[geom])
        name = body or f"body_{model.geom_bodyid[geom]}"
        if name in links and (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            expected.setdefault(name, []).append(corners_of(model, data, geom))
    assert sorted(shape.link for shape in shapes) == sorted(name for name, boxes in expected.items() for _ in boxes)
    for shape in shapes:
        joint = links[shape.link] @ np.linalg.inv(hand.frame(shape.link)[1])
        low, high = box_of(shape, joint)
        sizes = [np.abs(np.concatenate([low - a, high - b])).max() for a, b in expected[shape.link]]
        assert min(sizes) < (1.2e-4 if shape.is_mesh else 1e-8), shape.name


def test_visual_shapes_are_those_of_the_groups_that_are_seen():
    hand = read(CLAW)
    seen = _core.read_visual_shapes(hand.tree, hand.urdf, list(mesh_folders(hand)))
    assert sorted((table["link"], table["kind"]) for table in seen) == [
        ("palm", "box"), ("thumb_tip", "sphere"), ("whisker", "box"),
    ]  # fmt: skip
    colours = {table["link"]: tuple(np.round(table["colour"], 3)) for table in seen}
    assert colours["thumb_tip"] == (0.2, 0.3, 0.4, 1.0)
    assert colours["whisker"] == (0.5, 0.5, 0.5, 1.0)


def test_couplings_become_mimics_and_force_ranges_efforts():
    hand = read(CLAW)
    (mimic,) = hand.mechanism.mimics
    assert (mimic.joint, mimic.driver, mimic.multiplier) == ("thumb_curl", "thumb_bend", 0.6)
    assert mimic.offset == pytest.approx(0.1 - 0.6 * np.radians(20.0))  # of the distance from the reference, 20 degrees
    assert hand.efforts_by_name == {"thumb_bend": pytest.approx(1.8), "claw_curl": pytest.approx(1.0)}


def test_pairs_that_may_touch_are_neighbours_exclusions_and_what_always_overlaps():
    hand = read(CLAW)
    assert 'link1="thumb_tip" link2="claw_tip" reason="Excluded"' in hand.srdf
    assert 'link1="body_7" link2="claw_tip" reason="Adjacent"' in hand.srdf
    assert 'link1="robot0:palm" link2="robot0:thproximal" reason="Always"' in read(shadow_path()).srdf


def test_what_is_left_out_is_said_in_one_line():
    with pytest.warns(RuntimeWarning) as caught:
        ga.Hand.from_mjcf(CLAW)
    (line,) = [str(warning.message) for warning in caught]
    assert "joints 'floating', 'wrist' move the palm 'palm', which stands still here: left out" in line
    assert "2 bodies not on the palm" in line
    with pytest.warns(RuntimeWarning, match=r"tendons 'robot0:T_FFJ1c', .* and 8 more of several joints: not kept"):
        ga.Hand.from_mjcf(shadow_path())


def test_another_root_keeps_the_joints_below_it():
    hand = read(shadow_path(), root="robot0:forearm")
    assert {"robot0:WRJ0", "robot0:WRJ1"} <= set(hand.joints)
    assert len(hand.joints) == 24
    locked = hand.with_joints(None, {"robot0:WRJ0": 0.1, "robot0:WRJ1": 0.0})
    assert len(locked.joints) == 22


PROBLEM = """
hand: {mjcf: claw.xml}
object: {sphere: {radius: 0.02}}
contacts:
  - {frame: thumb_tip, hand: {type: point, position: [-0.007, 0, 0.01], normal: [-1, 0, 0]},
     object: {type: sphere, radius: 0.02}}
  - {frame: claw_tip, hand: {type: point, position: [0.006, 0, 0.02], normal: [1, 0, 0]},
     object: {type: sphere, radius: 0.02}}
"""


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_problem_is_stored_with_its_hand(tmp_path, monkeypatch):
    """Its URDF stands for the MJCF: neither that file, nor its meshes without a file, nor MuJoCo are needed again."""
    shutil.copytree(CLAW.parent, tmp_path / "hands")
    problem = read_problem(PROBLEM, folder=tmp_path / "hands")
    assert problem.hand.urdf_path == "claw.xml"
    copies = [pickle.loads(pickle.dumps(problem)), ga.Problem.from_dict(problem.to_dict(), tmp_path / "hands")]
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for copy in copies:
        assert copy.hand.urdf == problem.hand.urdf
        shapes = read_shapes(copy.hand.tree, copy.hand.urdf, mesh_folders(copy.hand))
        assert [shape.kind for shape in shapes].count("mesh") == 3
    with pytest.raises(ga.GraspAtlasError, match=r"MuJoCo is not installed: pip install 'graspatlas\[mujoco\]'"):
        ga.Hand.from_mjcf(CLAW)


def finger(body: str, *, more: str = "", joint: str = '<joint name="j" axis="0 1 0" range="-1 1"/>') -> str:
    return (
        f'<mujoco><compiler angle="radian"/>{more}<worldbody><body name="palm"><geom size="0.02"/>'
        f'<body name="finger">{joint}<geom type="capsule" size="0.005 0.02"/>{body}</body></body></worldbody></mujoco>'
    )


SECOND = '<body name="tip" pos="0 0 0.04"><joint name="k" axis="0 1 0" range="-1 1"/><geom size="0.006"/></body>'
COUPLED = finger(SECOND) + '<equality><joint joint1="k" joint2="j" polycoef="0 1 0.5 0 0"/></equality>'
WRONG = {
    "broken XML": ("<mujoco><worldbody>", "MuJoCo cannot read .*XML"),
    "a URDF": ("<robot name='r'><link name='a'/></robot>", "holds a <robot>, a URDF: say urdf: in place of mjcf:"),
    "no joint": (finger("", joint=""), "has no hinge or slide joint"),
    "a ball joint": (
        finger('<body name="tip"><joint name="b" type="ball"/><geom size="0.01"/></body>'),
        "joint 'b' .* is a ball joint, which no hand can have",
    ),
    "no mesh file": (
        finger("", more='<asset><mesh name="m" file="gone.stl"/></asset>'),
        "MuJoCo cannot read .*gone.stl",
    ),
    "a coupling that is not linear": (
        COUPLED.replace("</mujoco><equality>", "<equality>") + "</mujoco>",
        r"joint 'k' .* follows 'j' by a polynomial that is not linear \(0, 1, 0.5, 0, 0\)",
    ),
    "two hands": (
        '<mujoco><worldbody><body name="a"><joint name="j"/><geom size="1"/></body>'
        '<body name="b"><joint name="k"/><geom size="1"/></body></worldbody></mujoco>',
        r"several bodies with joints in its world \('a', 'b'\): say which is the palm",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_a_hand_is_refused(name, tmp_path):
    text, message = WRONG[name]
    (tmp_path / "hand.xml").write_text(text)
    with pytest.raises(ga.GraspAtlasError, match=message):
        ga.Hand.from_mjcf("hand.xml", folder=tmp_path)


def test_a_file_or_body_that_is_not_there(tmp_path):
    with pytest.raises(ga.GraspAtlasError, match=r"file 'gone.xml' does not exist"):
        ga.Hand.from_mjcf("gone.xml", folder=tmp_path)
    with pytest.raises(ga.GraspAtlasError, match=r"body 'plam' is not in .*; did you mean 'palm'\?"):
        read(CLAW, root="plam")
    with pytest.raises(ga.GraspAtlasError, match=r"no joint moves a body below 'whisker'"):
        read(CLAW, root="whisker")


def test_a_hand_of_one_finger_has_its_palm_before_the_first_joint(tmp_path):
    (tmp_path / "hand.xml").write_text(finger(SECOND))
    hand = ga.Hand.from_mjcf(tmp_path / "hand.xml")
    assert hand.joints == ("j", "k")
    assert root_link(hand.urdf) == "palm"


def test_shadow_hand_is_read_as_a_hand_of_22_joints():
    """Pinocchio's own reader of MJCF makes a hand of none of it."""
    hand = read(shadow_path())
    assert len(hand.joints) == 22
    assert hand.efforts_by_name["robot0:THJ4"] == pytest.approx(2.3722)
