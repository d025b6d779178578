"""Joints that mimic others: read from the URDF, and kept by whatever moves the hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import chain, robot

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.commands.diagnosis import diagnose
from graspatlas.hand.mechanism import Mimic

AXES = ["0 0 1", "0 1 0", "0.3 1 0.2", "0 1 0"]


def mimicking(urdf: str, joint: str, other: str, **numbers: object) -> str:
    """The URDF with a joint that mimics another."""
    start = urdf.index("</joint>", urdf.index(f'<joint name="{joint}"'))
    tag = "".join(f' {name}="{value}"' for name, value in numbers.items())
    return urdf[:start] + f'<mimic joint="{other}"{tag}/>' + urdf[start:]


def finger(*mimics: tuple, kinds: str | list[str] = "revolute") -> ga.Hand:
    urdf = robot(chain("f", (0.0, 0.0, 0.1), AXES, 0.05, kinds))
    for joint, other, numbers in mimics:
        urdf = mimicking(urdf, joint, other, **numbers)
    return ga.Hand("finger", urdf)


@pytest.fixture(scope="module")
def coupled(can: ga.Problem) -> ga.Problem:
    """The can in a hand whose index and middle finger bend their last joints by themselves: a chain of two mimics."""
    x = can.x1.joints
    urdf = mimicking(
        can.hand.urdf, "index_dip", "index_pip", multiplier=0.5, offset=x["index_dip"] - 0.5 * x["index_pip"]
    )
    urdf = mimicking(urdf, "middle_dip", "index_dip", multiplier=-1, offset=x["middle_dip"] + x["index_dip"])
    joints = {name: value for name, value in x.items() if name not in ("index_dip", "middle_dip")}
    return replace(can, hand=replace(can.hand, urdf=urdf), x1=replace(can.x1, joints=joints))


@pytest.fixture(scope="module")
def coupled_result(coupled: ga.Problem) -> ga.Result:
    return ga.optimize(coupled, dimension=2, radius=0.4, quality="smallest_semi_axis", refine="feasible")


def broken(problem: ga.Problem, X: np.ndarray) -> float:
    """How far grasps break the two equations of `coupled`, written out once more [rad]."""
    x1, at = problem.x1.joints, {name: i for i, name in enumerate(problem.hand.joints)}
    moved = {name: X[:, at[name]] - x1[name] for name in at}
    off = [moved["index_dip"] - 0.5 * moved["index_pip"], moved["middle_dip"] + 0.5 * moved["index_pip"]]
    return float(np.abs(off).max())


def test_tags_are_read_and_chains_resolved():
    hand = finger(("f1", "f0", {}), ("f3", "f2", {"multiplier": 2, "offset": 0.5}), ("f2", "f1", {"multiplier": -0.5}))
    assert hand.joints == ("f0", "f1", "f2", "f3")
    assert hand.mechanism.actuated == ("f0",)
    assert hand.mechanism.followers["f3"] == Mimic("f3", "f0", -1.0, 0.5)
    assert hand.mechanism.completed({"f0": 1.0}, "p") == {"f0": 1.0, "f1": 1.0, "f2": -0.5, "f3": -0.5}
    np.testing.assert_allclose(hand.mechanism.transmission[:, 0], [1.0, 1.0, -0.5, -1.0])


@pytest.mark.slow
def test_random_charts_of_an_atlas_keep_the_mimics(coupled, coupled_result):
    atlas = coupled_result.atlas
    assert atlas.complete
    assert broken(coupled, atlas.centers) < 1e-9
    assert np.ptp(atlas.centers[:, coupled.hand.joints.index("middle_dip")]) > 0.05
    full = ga.build_atlas(coupled.full_system, coupled.x1_array, radius=0.4, epsilon=0.5, max_charts=60)
    assert broken(coupled, full.centers) < 1e-9


def test_mimics_add_no_freedom_and_are_none_of_the_frozen_motions(can, coupled):
    assert coupled.full_dimension == can.full_dimension - 2
    assert coupled.frozen_motions(2) == can.frozen_motions(2) - 2
    assert coupled.system(2).tangent_size == can.system(2).tangent_size
    everything = ga.Grasps(can, coupled.x1_array).J[0]
    own = ga.Grasps(coupled, coupled.x1_array).J[0]
    steps = coupled.hand.mechanism.transmission
    np.testing.assert_allclose(own, everything @ steps, atol=1e-15)
    assert own.shape == (9, 11)


@pytest.mark.parametrize("k", [2, 4, 6])
def test_the_jacobian_by_finite_differences(coupled, k):
    assert ga.systems.jacobian_error(coupled.system(k), coupled.x1_array) < 1e-7


def test_refinement_frees_hand_motions_but_no_mimic(coupled, coupled_result):
    refinement = coupled_result.refinement
    assert refinement.all_motions
    assert np.abs(coupled.frozen_residual(refinement.x, 2)).max() > 1e-3
    assert broken(coupled, refinement.x) < 1e-9
    claims = {check.claim: check for check in coupled_result.check().checks}
    assert sum("mimic others" in claim for claim in claims) == 2
    assert coupled_result.check()


def test_the_check_notices_a_chart_that_breaks_a_mimic(coupled, coupled_result):
    centers = coupled_result.atlas.centers.copy()
    centers[7, coupled.hand.joints.index("middle_dip")] += 1e-6
    wrong = replace(coupled_result, atlas=replace(coupled_result.atlas, centers=centers), refinement=None)
    failed = [check.claim for check in wrong.check().checks if not check.passed]
    assert any("mimic others" in claim for claim in failed)


@pytest.mark.parametrize("k", [None, 2])
def test_grasps_that_are_found_keep_the_mimics(coupled, k):
    bare = replace(coupled, x1=None, reference=coupled.x1.joints)
    X = ga.find_grasps(bare, count=4, dimension=k)
    assert len(X) == 4
    assert broken(coupled, X) < 1e-9


def test_a_stored_result_is_the_same(coupled_result, tmp_path):
    coupled_result.save(tmp_path / "r.npz")
    again = ga.load_result(tmp_path / "r.npz")
    assert again.problem.hand.mechanism == coupled_result.problem.hand.mechanism
    assert again.problem.x1 == coupled_result.problem.x1
    assert again.check()


def test_x1_is_completed_corrected_or_refused(coupled):
    stated = dict(coupled.x1.joints)
    assert set(stated) == set(coupled.hand.joints)
    rounded = replace(coupled, x1=replace(coupled.x1, joints=stated | {"index_dip": stated["index_dip"] + 5e-4}))
    assert rounded.x1.joints == stated
    with pytest.raises(ga.GraspAtlasError, match=r"x1 .* joint 'index_dip' at .* mimics: index_dip = 0.5 index_pip"):
        replace(coupled, x1=replace(coupled.x1, joints=stated | {"index_dip": stated["index_dip"] + 0.01}))
    with pytest.raises(ga.GraspAtlasError, match="the reference posture has joint 'middle_dip'"):
        replace(coupled, reference=stated | {"middle_dip": stated["middle_dip"] + 0.01})
    less = {name: value for name, value in stated.items() if name != "index_pip"}
    with pytest.raises(ga.GraspAtlasError, match="no position for joint 'index_pip'"):
        replace(coupled, x1=replace(coupled.x1, joints=less))


def test_hand_motions_may_leave_the_mimics_out(coupled):
    motions, driven = coupled.motions, coupled.hand.mechanism.actuated
    few = replace(coupled, motions=motions.reordered(coupled.hand.joints).reordered(driven))
    assert set(few.motions.joints) == set(coupled.hand.joints)
    atlas = ga.build_atlas(few.system(2), few.x1_array, radius=0.4, epsilon=0.5, max_charts=50)
    assert broken(coupled, atlas.centers) < 1e-9
    rows = [{"index_dip": 1, "index_pip": -0.5}]
    follows = ga.HandMotions.from_couplings(rows, coupled.hand.joints)
    with pytest.raises(ga.GraspAtlasError, match=r"coupling .* follows from the joints that mimic others"):
        replace(coupled, motions=follows)


def test_the_limits_of_a_mimic_bind(coupled):
    names = coupled.full_system.bound_names
    # 0.5 index_pip + offset reaches no limit of index_dip first; the negative one of middle_dip does.
    assert sum("index_pip" in n or "index_dip" in n or "middle_dip" in n for n in names) == 2
    pip = coupled.x1.joints["index_pip"]
    tight = replace(coupled.hand, limits={"index_dip": (coupled.x1.joints["index_dip"] - 0.05, 2.0)})
    problem = replace(coupled, hand=tight)
    assert "lower limit of joint 'index_dip'" in problem.full_system.bound_names
    atlas = ga.build_atlas(problem.system(2), problem.x1_array, radius=0.25, epsilon=0.5)
    index_pip = atlas.centers[:, problem.hand.joints.index("index_pip")]
    assert pip - 0.1 - 1e-9 <= index_pip.min() < pip - 0.05
    with pytest.raises(ga.GraspAtlasError, match=r"'index_dip', limited to .* leaves no range"):
        _ = replace(coupled.hand, limits={"index_dip": (5.0, 6.0)}).mechanism


def test_locking_takes_the_mimics_along():
    hand = finger(("f2", "f1", {"multiplier": 0.5, "offset": 0.25}))
    assert hand.with_joints(None, {"f1": 0.5}).joints == ("f0", "f3")
    assert hand.with_joints(["f0", "f1"]).joints == ("f0", "f1", "f2")
    still, free = hand.with_joints(["f0"], {"f1": 0.5, "f2": 0.5}), hand.with_joints(None, {"f0": 0.2})
    assert (still.joints, free.mechanism.actuated) == (("f0",), ("f1", "f3"))
    places = hand.link_placements(np.array([0.3, 0.5, 0.5, 0.0]))
    np.testing.assert_allclose(still.link_placements(np.array([0.3]))["f_tip"], places["f_tip"], atol=1e-12)
    with pytest.raises(ga.GraspAtlasError, match="'f2' mimics 'f1' and cannot be locked alone: lock 'f1'"):
        hand.with_joints(None, {"f2": 0.1})
    with pytest.raises(ga.GraspAtlasError, match=r"'f2' is locked at 0.1, but it mimics: f2 = 0.5 f1 \+ 0.25 = 0.5"):
        hand.with_joints(None, {"f1": 0.5, "f2": 0.1})
    with pytest.raises(ga.GraspAtlasError, match="'f2' mimics 'f1': name that one among those that move"):
        hand.with_joints(["f0", "f2"])


def test_a_continuous_joint_that_mimics_one_with_limits_does_not_go_round():
    kinds = ["revolute", "continuous", "revolute", "continuous"]
    hand = finger(("f1", "f0", {"multiplier": 1.5}), kinds=kinds)
    assert hand.model.hand_q_size == 5  # f3 alone goes round
    assert hand.limits_by_name["f1"] == (-np.inf, np.inf)
    assert hand.mechanism.ranges(hand.limits_by_name)["f0"] == (-3.0, 3.0)
    assert hand.mechanism.completed({"f0": 3.0}, "p")["f1"] == 4.5
    both = finger(("f3", "f1", {"multiplier": -1}), kinds=kinds)
    assert both.mechanism.followers["f3"].turns
    assert np.abs(both.mechanism.residual([[0.0, 3.0, 0.0, 2 * np.pi - 3.0]])).max() < 1e-12
    assert both.mechanism.completed({"f1": 3.0, "f3": 2 * np.pi - 3.0}, "p")["f3"] == -3.0


@pytest.mark.parametrize(
    ("mimics", "kinds", "match"),
    [
        (
            [("f1", "f7", {})],
            "revolute",
            "joint 'f7' is not one that moves, for joint 'f1' to mimic",
        ),
        ([("f1", "f_fixed", {})], "revolute", "'f_fixed' is not one that moves"),
        ([("f1", "f1", {})], "revolute", "'f1' mimics 'f1' in a cycle"),
        ([("f1", "f2", {}), ("f2", "f1", {})], "revolute", "in a cycle of joints: remove one of these mimics"),
        ([("f3", "f1", {}), ("f1", "f2", {}), ("f2", "f1", {})], "revolute", "in a cycle"),
        ([("f1", "f0", {"multiplier": "x"})], "revolute", "multiplier of joint 'f1' must be a finite number, got 'x'"),
        ([("f1", "f0", {"offset": "nan"})], "revolute", "offset of joint 'f1' must be a finite number"),
        ([("f1", "f0", {"offset": 9})], "revolute", "leaves no range"),
        ([("f1", "f0", {"multiplier": 0, "offset": 4})], "revolute", "leaves no range"),
        ([("f1", "f0", {})], ["continuous", *["revolute"] * 3], "'f0', which is continuous"),
        (
            [("f1", "f0", {"multiplier": 2})],
            "continuous",
            "'f0', which is continuous: that needs .* multiplier of 1 or -1",
        ),
        ([("f1", "f0", {})], ["revolute", "planar", "revolute", "revolute"], "'f1' is planar: both must turn or slide"),
    ],
)
def test_tags_that_make_no_sense(mimics, kinds, match):
    with pytest.raises(ga.GraspAtlasError, match=match):
        _ = finger(*mimics, kinds=kinds).mechanism


def test_a_mimic_between_a_slide_and_a_turn_counts_in_its_own_units(can):
    """A rack and pinion: 20 mm for each radian; a tangent vector counts the slide in length_scale."""
    urdf = robot(chain("f", (0.0, 0.0, 0.1), AXES, 0.05, ["revolute", "prismatic", "revolute", "revolute"]))
    hand = ga.Hand("rack", mimicking(urdf, "f1", "f0", multiplier=0.02, offset=0.01))
    point = ga.patches.Point((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    contact = ga.Contact("f_tip", point, ga.patches.Sphere(radius=0.03))
    problem = ga.Problem("rack", hand, can.object, (contact,))
    x = ga.find_grasps(problem, count=3)
    assert np.abs(x[:, 1] - 0.02 * x[:, 0] - 0.01).max() < 1e-12
    system, found = problem.full_system, problem.at(x[0])
    assert ga.systems.jacobian_error(system, x[0]) < 1e-7
    v = np.zeros(system.tangent_size)
    v[0] = 0.1
    step = system.integrate(x[0], v) - x[0]
    assert np.hypot(step[0], step[1] / problem.length_scale) == pytest.approx(0.1)
    assert np.abs(found.mimic_residual(system.integrate(x[0], v))).max() < 1e-15


def test_check_and_new_list_the_mimics(coupled, tmp_path, capsys):
    finding = diagnose(coupled, dimension=2)[0]
    assert (finding.mark, finding.subject) == ("ok", "mimic joints")
    assert "index_dip = 0.5 index_pip" in finding.text
    path = Path(tmp_path / "hand.urdf")
    path.write_text(finger(("f1", "f0", {"multiplier": 2, "offset": 1})).urdf)
    assert main(["new", str(path)]) == 0
    out = capsys.readouterr().out
    assert "f1  [-3, 3], mimics: f1 = 2 f0 + 1\n" in out
    assert "#     f0: -0.5\n" in out  # from -2 to 1, where f1 is within its limits
    assert "#     f1:" not in out
