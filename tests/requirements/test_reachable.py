"""The requirement that an arm can bring the hand to a grasp, in results, climbs and summaries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.commands.shared.report import result_lines
from graspatlas.requirements import parse_requirement

HOLDS = [ga.ForceClosure(0.5, 0.02)]


@pytest.fixture(scope="module")
def before_arm(can: ga.Problem) -> ga.Problem:
    """The can where a UR5 just gets to some of its grasps."""
    return replace(can, arm=ga.Arm.named("ur5_robot", "tool0", object=ga.Pose([0.8, -0.3, 0.5], [0, 1, 1, 1])))


@pytest.fixture(scope="module")
def reached(before_arm: ga.Problem) -> ga.Result:
    return ga.optimize(before_arm, require=[*HOLDS, ga.Reachable()], refine=True)


def test_accepted_are_those_for_which_a_posture_is_found(before_arm: ga.Problem, reached: ga.Result) -> None:
    holding = ga.optimize(before_arm, require=HOLDS)
    np.testing.assert_array_equal(reached.accepted, holding.accepted & reached.reachable)
    np.testing.assert_array_equal(reached.reachable, ga.Grasps(before_arm, reached.atlas.centers).reach().found)
    assert 0 < reached.accepted.sum() < holding.accepted.sum()
    assert reached.rejected["reachable:0"] == holding.accepted.sum() - reached.accepted.sum()
    assert reached.best.arm_positions()


def test_the_refined_best_is_reachable_too(before_arm: ga.Problem, reached: ga.Result) -> None:
    """Where one that need not be is better, and not reachable."""
    free = ga.optimize(before_arm, require=HOLDS, refine=True)
    assert free.refined_best.quality > reached.refined_best.quality >= reached.best.quality
    assert reached.meets(reached.refined_best.x[None]).all()
    assert not reached.meets(free.refined_best.x[None]).any()
    assert reached.refinement is not None
    assert reached.meets(reached.refinement.x).all()


def test_the_share_is_told(reached: ga.Result) -> None:
    arm = reached.summary()["arm"]
    assert arm == {
        "name": "ur5_robot",
        "reachable": reached.accepted.sum(),
        "of": reached.accepted.sum() + reached.rejected["reachable:0"],
        "best": reached.refined_best.arm_positions(),
    }
    (line,) = [line for line in result_lines(reached, None) if line.startswith("  arm ur5_robot")]
    assert f"found for {arm['reachable']} of the {arm['of']} grasps that meet the other requirements" in line
    for joint, position in reached.refined_best.arm_positions().items():
        assert f"    {joint:20} {position:9.4f}" in result_lines(reached, None)
    assert "that none was found is no proof that there is none" in line
    assert "arm" not in replace(reached, requirements=(), rejected={}).summary()
    none = replace(reached, accepted=np.zeros_like(reached.accepted), refinement=None)
    assert none.summary()["arm"] == {**arm, "reachable": 0, "of": reached.rejected["reachable:0"], "best": None}


def test_it_is_checked_last() -> None:
    costs = {name: cls.cost for name, cls in ga.requirements.REQUIREMENTS.items()}
    assert max(costs, key=lambda name: costs[name]) == "reachable"
    assert parse_requirement("reachable:0.01") == ga.Reachable(clearance=0.01)
    with pytest.raises(ga.GraspAtlasError, match=r"clearance of requirement reachable must not be negative, got -0.01"):
        ga.Reachable(-0.01)


def test_a_problem_without_an_arm_is_told_before_the_atlas_is_traced(can: ga.Problem) -> None:
    with pytest.raises(ga.GraspAtlasError, match="problem 'schunk_can' has no arm; state one, such as arm:") as caught:
        ga.optimize(can, require=[ga.Reachable()])
    assert not hasattr(caught.value, "atlas")


def test_proposals_know_of_no_arm() -> None:
    with pytest.raises(
        ga.GraspAtlasError, match="requirement reachable asks what an arm can bring about, and proposals"
    ):
        ga.propose("allegro_right_hand", "thing.stl", "out", require=[ga.Reachable()])
