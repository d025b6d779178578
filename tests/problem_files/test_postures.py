"""Hand motions from recorded postures, and couplings of joints."""

from __future__ import annotations

import json

import numpy as np
import pytest
from problem_texts import CAN, ROBOTS, fault

import graspatlas as ga
from graspatlas.problem_files import read_problem


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
    "index_pip\n1\n2\n": "no values of joint 'index_abduction', which moves",
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
    with pytest.raises(ga.GraspAtlasError, match="leave the 2 joints no freedom"):
        ga.HandMotions.from_couplings([{"a": 1}, {"b": 1}], "ab")
