"""Hands by one word: paths, names of libraries, bare names; and words that name none."""

from __future__ import annotations

import sys
import warnings
from types import ModuleType

import pytest
from helpers import DATA, ROOT

import graspatlas as ga
from graspatlas.hand.named_hands import named_hand

WORDS = {
    str(ROOT / "examples/own_hand/three_fingers.urdf"): "three_fingers",
    "example_robot_data:allegro_right_hand": "allegro_right_hand",
    "allegro_left_hand": "allegro_left_hand",
    "schunk_sah": "schunk_sah",
    "three_finger_hand": "three_finger_hand",
    "parallel_gripper": "parallel_gripper",
}


@pytest.mark.parametrize("word", WORDS)
def test_words_name_hands(word):
    found = named_hand(word)
    assert found.hand.name == WORDS[word]
    assert len(found.hand.joints) >= 2
    again = ga.Hand.from_urdf(found.source["urdf"]) if "urdf" in found.source else found.hand
    assert again.joints == found.hand.joints


def test_an_mjcf_is_told_by_what_it_holds(tmp_path):
    pytest.importorskip("mujoco")
    text = (DATA / "mjcf/claw.xml").read_text().replace('meshdir="meshes"', f'meshdir="{DATA / "mjcf/meshes"}"')
    (tmp_path / "claw.urdf").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        found = named_hand(str(tmp_path / "claw.urdf"), "palm")
    assert found.source == {"mjcf": str(tmp_path / "claw.urdf"), "root": "palm"}
    assert "thumb_bend" in found.hand.joints


def test_a_library_may_have_hands_in_mjcf(monkeypatch):
    pytest.importorskip("mujoco")
    listing, module = ModuleType("robot_descriptions"), ModuleType("robot_descriptions.claw_mj_description")
    listing.__path__ = []
    module.MJCF_PATH = str(DATA / "mjcf/claw.xml")
    module.PACKAGE_PATH = module.REPOSITORY_PATH = str(DATA / "mjcf")
    monkeypatch.setitem(sys.modules, "robot_descriptions", listing)
    monkeypatch.setitem(sys.modules, "robot_descriptions.claw_mj_description", module)
    for place in ("robot_files", "named_hands"):
        monkeypatch.setattr(f"graspatlas.hand.{place}.described_names", lambda: ("claw_mj_description",))
    with pytest.warns(RuntimeWarning, match="left out"):
        found = named_hand("claw")
    assert found.source == {"robot_descriptions": "claw_mj_description"}
    assert found.hand.name == "claw_mj_description"
    assert "thumb_bend" in found.hand.joints


WRONG = {
    "alegro_right_hand": "hand 'alegro_right_hand' is not a file, nor among .*; did you mean 'allegro_right_hand'",
    "gone.xml": "file 'gone.xml' does not exist; give a URDF, an MJCF",
    "no/hand": "file 'no/hand' does not exist",
    "example_robot_data:alegro_right_hand": "did you mean 'allegro_right_hand'",
}


@pytest.mark.parametrize("word", WRONG)
def test_words_that_name_no_hand(word):
    with pytest.raises(ga.GraspAtlasError, match=WRONG[word]):
        named_hand(word)


def test_a_urdf_has_its_own_root():
    path = ROOT / "examples/own_hand/three_fingers.urdf"
    with pytest.raises(ga.GraspAtlasError, match=r"root names the palm of an MJCF, and .* is a URDF"):
        named_hand(str(path), "palm")
    with pytest.raises(ga.GraspAtlasError, match="must hold a <robot>, not a <mujoco>; an MJCF is read by mjcf:"):
        ga.Hand.from_urdf(DATA / "mjcf/claw.xml")
