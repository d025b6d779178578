"""Pads of the bundled hands, and of others, against what is known of them."""

from __future__ import annotations

import importlib.util
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import graspatlas as ga
from graspatlas.hand.named_hands import named_hand
from graspatlas.patches import Plane, Sphere

#: Contacts of bundled problems that are elsewhere, deliberately: the middle finger touches the bottle with its side.
ELSEWHERE = {("schunk_oil_bottle", "middle_distal")}
PROBLEMS = [name for name in ga.bundled_problems() if name != "planar_hand"]  # whose fingers touch with their very ends


def angle(a, b) -> float:
    return float(np.degrees(np.arccos(np.clip(np.dot(a, b), -1.0, 1.0))))


@pytest.fixture(scope="module")
def found() -> dict[str, tuple[ga.Problem, dict[str, ga.Pad]]]:
    problems = {name: ga.load_problem(name) for name in PROBLEMS}
    frames = {name: list(dict.fromkeys(c.frame for c in problem.contacts)) for name, problem in problems.items()}
    by_hand: dict[str, dict[str, ga.Pad]] = {}
    for name, problem in problems.items():
        known = by_hand.setdefault(problem.hand.name, {})
        wanted = [frame for frame in frames[name] if frame not in known]
        known |= dict(zip(wanted, ga.find_pads(problem.hand, wanted) if wanted else (), strict=True))
    return {name: (problem, by_hand[problem.hand.name]) for name, problem in problems.items()}


def contact_of(contact) -> tuple[np.ndarray, np.ndarray]:
    """The point that a contact states on the hand, and its normal there; the middle of what is free."""
    u, v = (contact.hand_frozen.get(name, 0.0) for name in ("u", "v"))
    return np.array(contact.hand.point(u, v)), np.array(contact.hand.normal_at(u, v))


@pytest.mark.parametrize("name", PROBLEMS)
def test_contacts_that_were_written_by_hand_are_on_the_pads(found, name):
    """Within 1.5 mm and 10 degrees of the pad, on its patch within the intervals in which it can roll."""
    problem, pads = found[name]
    compared = 0
    for contact in problem.contacts:
        if (name, contact.frame) in ELSEWHERE:
            continue
        (point, normal), patch = contact_of(contact), pads[contact.frame].patch
        w = [np.clip(w, *patch.interval(k)) for w, k in zip(patch.locate(point), ("u", "v"), strict=True)]
        assert np.linalg.norm(patch.point(*w) - point) < 1.5e-3, contact.frame
        assert angle(patch.normal_at(*w), normal) < 10.0, contact.frame
        compared += 1
    assert compared >= 2


def test_middles_of_pads_are_where_fingers_of_the_allegro_hand_touch(found):
    """Those of the box and cylinder, 30 degrees towards the tip; the thumb's is up to 20 degrees off, and rolls."""
    problem, pads = found["allegro_cylinder_4"]
    for contact in problem.contacts[1:]:
        point, normal = contact_of(contact)
        assert np.linalg.norm(pads[contact.frame].position - point) < 1.5e-3
        assert angle(pads[contact.frame].normal, normal) < 10.0
    thumb = pads["link_15.0_tip"]
    assert angle(thumb.normal, contact_of(problem.contacts[0])[1]) < 20.0


def test_middles_of_pads_of_the_gripper(found):
    problem, pads = found["gripper_skittle"]
    for contact in problem.contacts:
        point, normal = contact_of(contact)
        assert_allclose(pads[contact.frame].position, point, atol=1e-6)
        assert_allclose(pads[contact.frame].normal, normal, atol=1e-6)
        assert isinstance(pads[contact.frame].patch, Plane)


def test_fingertips_of_a_hand_are_balls_where_they_are():
    """The three-finger hand has balls of 9 mm at its tips, the Allegro hand of 12 mm."""
    for name, radius in (("three_finger_hand", 0.009), ("allegro_right_hand", 0.012)):
        for pad in ga.find_pads(named_hand(name).hand):
            assert isinstance(pad.patch, Sphere)
            assert pad.patch.radius == pytest.approx(radius, rel=0.02)
            assert pad.error < 2.1e-4
            assert_allclose(pad.patch.point(), pad.position, atol=1e-12)


@pytest.mark.parametrize("name", ["schunk_sah", "allegro_left_hand", "panda"])
def test_a_search_takes_less_than_two_seconds(name):
    hand = named_hand(name).hand
    start = time.process_time()
    pads = ga.find_pads(hand)
    assert time.process_time() - start < 4.0  # of both cores, where other work is done
    assert len(pads) >= 2


def test_jaws_of_the_panda_face_each_other():
    left, right = ga.find_pads(named_hand("panda").hand)
    assert_allclose([left.normal, right.normal], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-6)


def test_pads_of_the_shadow_hand():
    """From MJCF: its fingers bend to -y, its thumb to -x, as the touch sensors of its model lie."""
    pytest.importorskip("mujoco")
    spec = importlib.util.find_spec("gymnasium_robotics")
    if spec is None or spec.origin is None:
        pytest.skip("gymnasium-robotics is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        hand = ga.Hand.from_mjcf(Path(spec.origin).parent / "envs/assets/hand/reach.xml")
    pads = {pad.frame: pad for pad in ga.find_pads(hand)}
    assert len(pads) == 5
    for frame, pad in pads.items():
        sensor = [-1.0, 0.0, 0.0] if frame.endswith("thdistal") else [0.0, -1.0, 0.0]
        assert angle(pad.normal, sensor) < 45.0
        assert isinstance(pad.patch, Sphere)


def test_pads_of_links_that_there_are_not():
    hand = named_hand("allegro_right_hand").hand
    with pytest.raises(ga.GraspAtlasError, match=r"frame 'link_3_tip' is not in hand .*; did you mean 'link_3.0_tip'"):
        ga.find_pads(hand, ["link_3_tip"])
    with pytest.raises(ga.GraspAtlasError, match="hand must be a Hand"):
        ga.find_pads("allegro_right_hand")


def test_a_pad_is_plain_data_of_a_contact():
    hand = named_hand("parallel_gripper").hand
    pad, _ = ga.find_pads(hand)
    data = pad.to_dict()
    contact = ga.Contact.from_dict({**data, "object": {"type": "sphere", "radius": 0.02}})
    assert (contact.frame, contact.hand) == (pad.frame, pad.patch)


def test_fingertips_without_a_smooth_place_are_left_out_with_a_warning():
    with pytest.warns(RuntimeWarning, match=r"no smooth place to touch on '.*'.* of hand 'talos_full_v2': left out"):
        pads = ga.find_pads(named_hand("talos_full_v2").hand)
    assert {"gripper_left_fingertip_1_link", "gripper_right_fingertip_1_link"} <= {pad.frame for pad in pads}
