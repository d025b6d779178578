"""Fuzzing of problems, their parts and their files."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
from drawn import anything, change_leaf, check_answer, damaged, few, no_numbers, odd_numbers, tried, vectors
from hypothesis import given
from hypothesis import strategies as st

import graspatlas as ga


@given(dimension=anything, radius=anything, epsilon=anything, index=anything, require=anything)
@few(60)
def test_optimize(tripod, dimension, radius, epsilon, index, require):
    options: dict[str, Any] = {"dimension": 6, "radius": 0.5, "epsilon": 0.5, "quality": "smallest_semi_axis"}
    for name, value in {"dimension": dimension, "radius": radius, "epsilon": epsilon, "quality": index}.items():
        result = tried(lambda o=options | {name: value}: ga.optimize(tripod, **o, max_charts=4, max_seconds=0.2))
        check_answer(result)
    check_answer(tried(lambda: ga.optimize(tripod, require=require, max_charts=3)))
    assert tried(lambda: ga.optimize(require)) is None


@given(
    length_scale=odd_numbers | no_numbers,
    xyz=vectors | anything,
    quaternion=st.tuples(*[odd_numbers] * 4) | anything,
    angle=odd_numbers | no_numbers,
    parameters=anything,
    joint=anything,
)
@few(40)
def test_problems(tripod, length_scale, xyz, quaternion, angle, parameters, joint):
    joints = dict(tripod.x1.joints)
    wrong = [
        lambda: replace(tripod, length_scale=length_scale),
        lambda: replace(tripod, object_joint=joint),
        lambda: replace(tripod, contacts=joint),
        lambda: replace(tripod, x1=joint),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints, object_xyz=xyz)),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints, object_quat_xyzw=quaternion)),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints | {"a1": angle})),
        lambda: replace(tripod, x1=ga.FirstGrasp(joint)),
        lambda: replace(tripod, x1=ga.FirstGrasp(joints, parameters=parameters)),
        lambda: replace(tripod, motions=joint),
        lambda: replace(tripod, hand=joint),
        lambda: replace(tripod, hand=replace(tripod.hand, limits={"a1": parameters})),
    ]
    for make in wrong:
        problem = tried(make)
        if problem is not None:
            check_answer(tried(lambda p=problem: ga.optimize(p, max_charts=3, max_seconds=0.2)))


@given(
    frame=anything, hand=anything, body=anything, frozen=anything | st.dictionaries(st.sampled_from("uvw"), anything)
)
@few(150)
def test_contacts(tripod, frame, hand, body, frozen):
    contact = tripod.contacts[0]
    changes = ({"frame": frame}, {"hand": hand}, {"object": body}, {"frozen": frozen}, {"hand_frozen": frozen})
    for change in changes:
        made = tried(lambda c=change: replace(contact, **c))
        if made is not None:
            problem = tried(lambda m=made: replace(tripod, contacts=(m, *tripod.contacts[1:])))
            if problem is not None:
                assert ga.Problem.from_dict(problem.to_dict()).to_dict() == problem.to_dict()
                check_answer(tried(lambda p=problem: ga.optimize(p, max_charts=2, max_seconds=0.2)))


@given(
    samples=anything | st.lists(st.lists(odd_numbers, min_size=3, max_size=3), max_size=4), joints=anything, s=anything
)
@few(200)
def test_hand_motions(samples, joints, s):
    tried(lambda: ga.HandMotions.from_samples(samples, joints))
    tried(lambda: ga.HandMotions(joints, samples, samples))
    motions = tried(lambda: ga.HandMotions.from_samples(samples, "abc"))
    if motions is not None:
        np.testing.assert_allclose(motions.E.T @ motions.E, np.eye(3), atol=1e-9)
        kept = tried(lambda: motions.kept(s))
        assert kept is None or kept.shape == (3, 3 - s)
        other = tried(lambda: motions.reordered(joints))
        assert other is None or set(other.joints) <= set("abc")
        turned = motions.reordered("cab")
        np.testing.assert_array_equal(turned.mean, motions.mean[[2, 0, 1]])
        np.testing.assert_allclose(turned.variances, motions.variances, atol=1e-9 * (1.0 + motions.variances.max()))


@given(data=st.data())
@few(60)
def test_damaged_urdfs(tripod, tmp_path, capfd, data):
    text = data.draw(st.sampled_from([tripod.hand.urdf, '<robot name="plate"><link name="plate"/></robot>']))
    path = tmp_path / "damaged.urdf"
    path.write_bytes(damaged(text.encode(), data))
    hand = tried(lambda: ga.Hand.from_urdf(path))
    if hand is not None and tried(lambda: hand.joints):
        problem = tried(lambda: replace(tripod, hand=hand))
        if problem is not None:
            check_answer(tried(lambda: ga.optimize(problem, max_charts=2, max_seconds=0.2)))
    body = tried(lambda: ga.Body.from_urdf(path))
    assert body is None or "<robot" in body.urdf


@given(data=st.data())
@few(150)
def test_damaged_problem_files(tripod, tmp_path, capfd, data):
    content = json.loads(json.dumps(tripod.to_dict()))
    change_leaf(content, data)
    text = json.dumps(content).encode()
    if data.draw(st.integers(0, 3)) == 0:
        text = damaged(text, data)
    path = tmp_path / "problem.json"
    path.write_bytes(text)
    problem = tried(lambda: ga.load_problem(path))
    if problem is not None:
        assert ga.Problem.from_dict(problem.to_dict()).to_dict() == problem.to_dict()
        check_answer(tried(lambda: ga.optimize(problem, max_charts=3, max_seconds=0.2)))
