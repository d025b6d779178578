"""graspatlas check: what it finds in a problem."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from helpers import BENT, chain, robot, slow_but, tripod_problem

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.collision.checker import CollisionChecker
from graspatlas.commands import diagnosis
from graspatlas.commands.diagnosis import NOTE, OK, PROBLEM, Finding, diagnose, report
from graspatlas.problem.redundancy import redundant_joints
from graspatlas.problems import problem_text

#: Bundled problems that are checked quickly.
FEW = ("planar_hand", "schunk_can", "gripper_skittle", "allegro_sphere_3")


def found(problem: ga.Problem, subject: str, **options) -> Finding:
    (one,) = [finding for finding in diagnose(problem, **options) if finding.subject == subject]
    return one


@pytest.mark.parametrize("name", slow_but(ga.bundled_problems(), *FEW))
def test_bundled_problems_have_no_problem(name, capsys):
    assert main(["check", name]) == 0
    out = capsys.readouterr().out
    assert "0 problem" in out
    problem = ga.load_problem(name)
    assert f"t = {problem.full_dimension}" in out


def test_numbers_of_the_can(can):
    assert "23 unknowns; 3 contacts: 15 equations" in found(can, "freedoms").text
    assert found(can, "rank").text == "15 of 15 at x1, so t = 8"
    motions = found(can, "hand motions")
    assert (motions.mark, motions.text) == (OK, "k = 2 freezes s = 6 of 13; 99.71 % of the variance stay")
    assert "s = 5" in found(can, "hand motions", dimension=3).text
    assert found(can, "hand motions", dimension=9).mark == PROBLEM
    contacts = [finding.text for finding in diagnose(can) if finding.subject == "contact at x1"]
    assert [text.partition(":")[0] for text in contacts] == ["middle_distal", "index_distal", "thumb_distal"]


def test_little_variance_is_pointed_out():
    planar = ga.load_problem("planar_hand")
    finding = found(planar, "hand motions")
    assert (finding.mark, planar.motions.variance_kept(1) < 0.9) == (NOTE, True)


def test_equal_variances_are_pointed_out(can):
    h = len(can.motions.joints)
    motions = ga.HandMotions(can.motions.joints, np.zeros(h), np.eye(h))
    assert "equal variance" in found(replace(can, motions=motions), "hand motions").hint


def test_no_motions_and_no_defaults(can):
    problem = replace(can, motions=None, defaults={})
    assert found(problem, "hand motions").mark == PROBLEM
    assert "no hand motions" in found(problem, "hand motions").text
    assert "dimension, radius, epsilon, quality" in found(problem, "defaults").text
    assert found(problem, "hand motions", dimension=8).mark == OK


def test_a_contact_stated_twice_costs_rank(can):
    twice = replace(can, contacts=(*can.contacts, can.contacts[0]))
    finding = found(twice, "rank")
    assert finding.mark == PROBLEM
    assert "rank 15" in finding.text


def test_an_idle_finger_is_redundant():
    """A finger that touches nothing: each of its joints moves unfelt, and no other joint does."""
    problem = tripod_problem(BENT)
    idle = chain("d", (0.0, 0.08, 0.0), ["0 0 1", "0 1 0"], 0.05)
    hand = ga.Hand("four", problem.hand.urdf.replace("</robot>", idle + "</robot>"))
    x1 = ga.FirstGrasp({**BENT, "d0": 0.1, "d1": 0.2})
    more = replace(problem, hand=hand, x1=x1)
    assert redundant_joints(problem) == []
    assert sorted(redundant_joints(more)) == [["d0"], ["d1"]]
    assert "d0; d1" in found(more, "redundancies").text or "d1; d0" in found(more, "redundancies").text


def test_joints_that_undo_each_other_are_redundant():
    """Two joints about one axis: only their sum is felt."""
    problem = tripod_problem(BENT)
    twin = '<link name="twin"/><joint name="a9" type="revolute"><origin xyz="0.06 0 0"/><parent link="palm"/>'
    twin += '<child link="twin"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
    old = '<origin xyz="0.06 0.0 0.0"/><parent link="palm"/>'
    assert old in problem.hand.urdf
    urdf = problem.hand.urdf.replace(old, '<origin xyz="0 0 0"/><parent link="twin"/>').replace(
        "</robot>", twin + "</robot>"
    )
    more = replace(problem, hand=ga.Hand("twin", urdf), x1=ga.FirstGrasp({**BENT, "a9": 0.0}))
    (group,) = redundant_joints(more)
    assert sorted(group) == ["a0", "a9"]


def test_a_straight_finger_at_x1_is_no_redundancy(can):
    """The can's thumb is straight at x1, and there alone the contacts miss one of its motions."""
    assert redundant_joints(can) == []
    assert "at x1 itself" in found(can, "redundancies").text


def test_an_object_that_spins_in_the_grasp_is_pointed_out(can):
    assert found(can, "object").mark == OK
    free = replace(can, contacts=tuple(replace(contact, frozen={}) for contact in can.contacts))
    assert found(free, "object").text == "it can move in 2 ways while the hand stays still"


def test_limits_near_x1_are_named(can):
    limits = {"thumb_pip": (-0.001, 1.0)}
    near = replace(can, hand=replace(can.hand, limits=limits))
    assert found(near, "limits").text == "x1 is at the lower limit of joint 'thumb_pip' (0.001)"
    assert found(can, "limits").mark == OK


def test_collisions_at_x1_are_named(can):
    assert found(can, "collision at x1").mark == OK
    thick = can.object.urdf.replace('radius="0.02224"', 'radius="0.04"')
    assert thick != can.object.urdf
    finding = found(replace(can, object=replace(can.object, urdf=thick)), "collision at x1")
    assert finding.mark == NOTE
    assert "object/can_0" in finding.text
    bare = replace(can, object=ga.Body("bare", robot()))
    assert "no collision shape" in found(bare, "collision at x1").text


def test_neighbouring_links_may_touch_without_an_srdf():
    """All pairs of one joint, and of parent and child, are left out, and no other."""
    hand = ga.load_problem("allegro_cylinder_3").hand
    problem = replace(ga.load_problem("allegro_cylinder_3"), hand=replace(hand, srdf=""))
    found_pairs = [pair for pair in CollisionChecker(problem).pairs if not pair[1].startswith("object/")]
    model = pin.buildModelFromXML(hand.urdf)
    geometry = pin.buildGeomFromUrdfString(model, hand.urdf, pin.COLLISION, package_dirs=list(hand.package_dirs))
    shapes = [(shape.name, int(shape.parentJoint)) for shape in geometry.geometryObjects]
    assert found_pairs == [
        (first, second)
        for i, (first, a) in enumerate(shapes)
        for second, b in shapes[i + 1 :]
        if a != b and model.parents[a] != b and model.parents[b] != a
    ]


def test_charts_are_counted_or_estimated(bottle, monkeypatch):
    exact = found(bottle, "charts", radius=0.2)
    traced = ga.optimize(bottle, radius=0.2).atlas.n_charts
    assert exact.text.startswith(f"{traced} for k = 2, r = 0.2")

    # Too little time for the radius, enough for a multiple: the estimate is of the right size.
    wanted = ga.optimize(bottle, radius=0.025).atlas.n_charts
    calls = []

    def slow(system, x0, *, radius, epsilon, max_seconds, progress):
        calls.append(radius)
        charts = 100 if radius < 0.09 else None
        atlas = ga.build_atlas(system, x0, radius=radius, epsilon=epsilon, max_charts=charts, progress=progress)
        return replace(atlas, status=ga.Status.TIME_LIMIT) if charts else atlas

    monkeypatch.setattr(diagnosis, "build_atlas", slow)
    text = found(bottle, "charts", radius=0.025).text
    assert calls == [0.025, 0.05, 0.1]
    assert text.startswith("about ")
    assert float(text.split()[1]) == pytest.approx(wanted, rel=0.35)
    assert "an estimate from r = 0.1" in text
    monkeypatch.setattr(diagnosis, "DOUBLINGS", 0)
    assert found(bottle, "charts", radius=0.025).text.startswith("more than ")


def test_a_radius_that_makes_no_sense(can):
    assert found(can, "charts", radius=-1.0).mark == PROBLEM


def test_report_is_aligned():
    lines = report([Finding(OK, "a", "one", "x"), Finding(PROBLEM, "longer", "two", "y")]).splitlines()
    assert lines == [
        "ok       a       one",
        "                 (x)",
        "problem  longer  two",
        "                 (y)",
        "1 ok, 0 note, 1 problem",
    ]


def test_check_of_a_broken_file(tmp_path, capsys):
    path = tmp_path / "mine.yaml"
    path.write_text(problem_text("schunk_can")[0].replace("radius: 0.02224", "radius: wide"))
    assert main(["check", str(path)]) == 1
    out = capsys.readouterr().out
    for i, line in enumerate((31, 41, 50)):
        assert f"{path}:{line}: contacts[{i}].object.radius: must be a number, got 'wide'" in out
    assert out.splitlines()[-1] == "0 ok, 0 note, 3 problem"
    assert main(["check", str(path), "--json"]) == 1
    findings = json.loads(capsys.readouterr().out)
    assert [set(finding) for finding in findings] == [{"mark", "subject", "text", "hint"}] * 3
    assert main(["check", str(tmp_path / "none.yaml")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_every_finding_has_a_hint(can, bottle):
    problems = (can, bottle, replace(can, motions=None), replace(can, defaults={}))
    findings = [finding for problem in problems for finding in diagnose(problem)]
    assert len(findings) > len(problems)
    for finding in findings:
        assert finding.text
        assert finding.hint


def test_a_first_grasp_is_found_where_none_is_given(can):
    without = replace(can, x1=None, reference=can.x1.joints)
    assert found(without, "first grasp").mark == "ok"
    assert found(without, "charts").mark != "problem"


def test_without_x1_and_motions_the_rest_is_looked_at_all_the_same(can):
    """Nobody has hand motions at first, and most have no first grasp."""
    bare = replace(can, x1=None, motions=None, defaults={})
    marks = {finding.subject: finding.mark for finding in diagnose(bare)}
    assert marks["first grasp"] == OK
    assert marks["hand motions"] == PROBLEM
    assert {"rank", "contact at x1", "redundancies", "object", "collision at x1"} <= set(marks)


def changed(problem, **sides):
    """The problem with other patches at its second contact."""
    first, second, *rest = problem.contacts
    return replace(problem, contacts=(first, replace(second, **sides), *rest), x1=None, reference=problem.x1.joints)


def test_patches_that_lie_off_the_shapes_are_pointed_out():
    """Nothing in the equations says so: a patch and the shape that collides are stated apart."""
    problem = ga.load_problem("allegro_cylinder_3")
    right = found(problem, "shapes at x1")
    assert (right.mark, right.text) == (OK, "contact points lie on the collision shapes, to 0.00 mm")
    wall, pad = problem.contacts[1].object, problem.contacts[1].hand
    frame = problem.contacts[1].frame
    for sides, words in (
        ({"object": replace(wall, radius=0.025)}, rf"{frame}: the object's point is 5 mm off the surface"),
        ({"hand": replace(pad, position=(0.0, 0.0, 0.03))}, rf"{frame}: the hand's point is [\d.]+ mm off"),
        ({"hand": replace(pad, normal=tuple(-c for c in pad.normal))}, rf"^{frame}: the hand's normal points into"),
        ({"object": replace(wall, flipped=True)}, rf"^{frame}: the object's normal points into"),
    ):
        finding = found(changed(problem, **sides), "shapes at x1")
        assert finding.mark == NOTE
        assert re.search(words, finding.text), finding.text
        assert finding.text.count(":") == 1  # and nothing is said of the others


@pytest.mark.parametrize("name", slow_but(ga.bundled_problems(), *FEW))
def test_the_bundled_patches_lie_on_the_shapes(name):
    assert found(ga.load_problem(name), "shapes at x1").mark == OK


def test_the_arm_is_looked_at(can: ga.Problem) -> None:
    arm = ga.Arm.named("ur5_robot", "tool0", object=ga.Pose([0.5, 0.2, 0.4]))
    near = found(replace(can, arm=arm), "arm at x1")
    assert near.mark == OK
    assert near.text == "ur5_robot, 6 joints up to tool0: a posture was found"
    far = found(replace(can, arm=replace(arm, object=ga.Pose([2.0, 0.0, 0.0]))), "arm at x1")
    assert far.mark == NOTE
    assert "no posture was found within the joint limits, which is no proof" in far.text
    assert "arm at x1" not in {finding.subject for finding in diagnose(can)}
