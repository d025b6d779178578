"""Links that nothing moves, such as the palm, take part in proposals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from proposals.conftest import HAND

import graspatlas as ga
from graspatlas.hand.named_hands import named_hand
from graspatlas.proposals.assignments.fingers import grips, touched


def test_the_palm_touches_anywhere_on_it_and_fingers_with_the_middle_of_their_pads() -> None:
    grips_ = grips(named_hand(HAND).hand, 2, ["palm_link", "link_6.0", "link_15.0_tip"])
    assert [each.grip.name for each in grips_] == [
        "palm_link+link_6.0",
        "palm_link+link_15.0_tip",
        "link_6.0+link_15.0_tip",
    ]
    for each in grips_:
        for pad in each.grip.pads:
            patch = touched(each.hand, pad)
            assert patch.kind == ("plane" if pad.frame == "palm_link" else "point")
        points, _ = each.pads_at(each.postures(3, np.random.default_rng(0)))
        moves = np.ptp(points, axis=0).max(axis=1) > 1e-3
        assert moves.tolist() == [pad.frame != "palm_link" for pad in each.grip.pads]


def test_a_jar_is_held_against_the_palm(tmp_path: Path) -> None:
    trimesh.creation.cylinder(0.035, 0.14).export(tmp_path / "jar.stl")
    links = ["palm_link", "link_6.0", "link_15.0_tip"]
    (best,) = ga.propose(HAND, tmp_path / "jar.stl", tmp_path, links=links, top=1, max_seconds=None).proposals
    problem = best.result.problem
    assert best.tried.links[0] == "palm_link"
    palm = problem.contacts[0]
    assert set(palm.hand_frozen) == {"u", "v"}, "the place on the palm that was found stays"
    grasp = best.result.refined_best if best.result.refinement else best.result.best
    assert np.abs(problem.full_system.evaluate_residual(grasp.x)).max() < 1e-9
    assert grasp.contact_points[0] @ palm.hand.normal == pytest.approx(np.dot(palm.hand.origin, palm.hand.normal))
    (u, v), (low, high) = palm.hand_frozen.values(), palm.hand.u_interval
    assert low <= u <= high
    assert palm.hand.v_interval[0] <= v <= palm.hand.v_interval[1]
    assert ga.load_problem(best.folder / "problem.yaml").contacts == problem.contacts
