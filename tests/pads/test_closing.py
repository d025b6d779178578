"""To which side fingers close, however their joints are stated."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import graspatlas as ga


def finger(name: str, at: str, turn: str, axis: str, limits: str, mimic: str = "") -> str:
    """Three links along z, each with a box that is thinner along x; they bend about y, one way or the other."""
    parts, parent, origin = [], "palm", f'<origin xyz="{at}" rpy="{turn}"/>'
    for i in range(3):
        link, shape = f"{name}_{i}", '<geometry><box size="0.012 0.016 0.03"/></geometry>'
        if i == 2:
            shape = '<geometry><sphere radius="0.008"/></geometry>'
        parts.append(
            f'<link name="{link}"><collision><origin xyz="0 0 {0.03 if i == 2 else 0.015}"/>{shape}</collision></link>'
            f'<joint name="{name}{i}" type="revolute">{origin}<parent link="{parent}"/><child link="{link}"/>'
            f'<axis xyz="{axis}"/><limit {limits} effort="1" velocity="1"/>{mimic if i == 2 else ""}</joint>'
        )
        parent, origin = link, '<origin xyz="0 0 0.03"/>'
    return "".join(parts)


def hand(*fingers: str) -> ga.Hand:
    palm = '<link name="palm"><collision><geometry><box size="0.06 0.06 0.02"/></geometry></collision></link>'
    return ga.Hand("made", f'<robot name="made">{palm}{"".join(fingers)}</robot>')


def pair(axis: str, limits: str, mimic: str = "") -> ga.Hand:
    """A finger at x = -40 mm, and the same, turned by half a turn about z, at x = 40 mm."""
    first = finger("a", "-0.04 0 0.01", "0 0 0", axis, limits, mimic)
    return hand(first, finger("b", "0.04 0 0.01", "0 0 3.14159265", axis, limits))


#: Fingers that bend to +x from a straight posture, as a URDF may state that.
WAYS = {
    "about y": ("0 1 0", 'lower="-0.1" upper="1.6"'),
    "about -y": ("0 -1 0", 'lower="-1.6" upper="0.1"'),
    "about y, symmetric": ("0 1 0", 'lower="-1.4" upper="1.4"'),
}


@pytest.mark.parametrize("way", WAYS)
def test_fingers_close_to_each_other(way):
    """One at x = -40 mm bends to +x; the other is the same, turned by half a turn about z."""
    axis, limits = WAYS[way]
    made = pair(axis, limits)
    pads = ga.find_pads(made)
    assert [pad.frame for pad in pads] == ["a_2", "b_2"]
    for pad in pads:
        assert pad.normal[0] > 0.7
        assert abs(pad.normal[1]) < 1e-6
        # Straight ahead or towards the tip; backwards only where the fingers are as often bent to the other side.
        assert pad.normal[2] > (-0.3 if "symmetric" in way else -1e-6)
        assert_allclose(pad.position, np.array([0.0, 0.0, 0.03]) + 0.008 * np.array(pad.normal), atol=2e-4)


def test_joints_that_mimic_others_close_with_them():
    axis, limits = WAYS["about y"]
    mimic = '<mimic joint="a1" multiplier="1"/>'
    alone, coupled = (ga.find_pads(pair(axis, limits, tag)) for tag in ("", mimic))
    assert_allclose(coupled[0].normal, alone[0].normal, atol=1e-9)


def test_phalanges_and_palm_on_request():
    axis, limits = WAYS["about y"]
    made = pair(axis, limits)
    middle, palm = ga.find_pads(made, ["a_1", "palm"])
    assert_allclose(middle.normal, [1.0, 0.0, 0.0], atol=1e-9)
    assert_allclose(middle.position, [0.006, 0.0, 0.015], atol=1e-9)
    assert_allclose(palm.normal, [0.0, 0.0, 1.0], atol=1e-9)
    assert palm.position[2] == pytest.approx(0.01)
