"""Pictures of pads, and of problems before they are solved."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image
from screens import pixels

import graspatlas as ga
from graspatlas.hand.named_hands import named_hand
from graspatlas.viewer import save_pads_picture, save_problem_picture
from graspatlas.viewer.render.labels import _ascending, _Label, _spread
from graspatlas.viewer.scene.marks import marked_hand, marked_problem


@pytest.fixture(scope="module")
def gripper() -> tuple[ga.Hand, tuple[ga.Pad, ...]]:
    hand = named_hand("parallel_gripper").hand
    return hand, ga.find_pads(hand, ["palm", "left_jaw", "right_jaw"])


def coloured(picture: np.ndarray, colour: str) -> np.ndarray:
    """Which pixels are clearly of a colour."""
    red, green, blue = (255.0 * picture[..., k] for k in range(3))
    if colour == "orange":
        return (red > green + 40.0) & (green > blue + 30.0)
    if colour == "blue":
        return (blue > red + 60.0) & (blue > green + 40.0)
    return (green > red + 40.0) & (green > blue - 10.0)


def test_a_picture_of_pads_shows_pads_and_normals(tmp_path: Path) -> None:
    """On a hand that is grey and white."""
    hand = named_hand("allegro_right_hand").hand
    pads = ga.find_pads(hand)
    save_pads_picture(hand, pads, tmp_path / "pads.png", width=960, height=540)
    save_pads_picture(hand, (), tmp_path / "none.png", width=960, height=540)
    with_pads, without = (pixels(tmp_path / name) for name in ("pads.png", "none.png"))
    top = slice(0, 500)  # above the legend
    for colour in ("orange", "green"):
        assert coloured(with_pads[top], colour).sum() > coloured(without[top], colour).sum() + 200


def test_marks_are_where_the_pads_are(gripper) -> None:
    hand, pads = gripper
    marked = marked_hand(hand, pads)
    assert [mark.name for mark in marked.marks] == ["palm", "left_jaw", "right_jaw"]
    palm, left, right = marked.marks
    assert_allclose(palm.point, pads[0].position, atol=1e-12)
    assert_allclose([left.normal, right.normal], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-6)
    first, second = marked.directions()
    assert abs(first[1]) < 0.3  # jaws that face each other along y are seen from the side
    assert first[:2] @ second[:2] < 0.4


def test_a_solved_problem_has_its_contacts_at_x1() -> None:
    problem = ga.load_problem("gripper_skittle")
    marked = marked_problem(problem)
    arrays = problem.full_system.grasp_arrays(problem.x1_array[None])
    assert_allclose([mark.point for mark in marked.marks], arrays["hand_points"][0], atol=1e-12)
    assert marked.title == "gripper_skittle: at x1"
    assert [mark.name for mark in marked.marks] == ["1  left_jaw", "2  right_jaw"]


@pytest.mark.parametrize("guess", [None, ga.PoseGuess((0.0, 0.0, 0.09))])
def test_a_problem_is_drawn_before_it_is_solved(guess, tmp_path: Path) -> None:
    problem = replace(ga.load_problem("three_finger_cup"), x1=None, pose_guess=guess)
    assert ("pose guess" in marked_problem(problem).title) == (guess is not None)
    save_problem_picture(problem, tmp_path / "cup.png", width=640, height=360)
    picture = pixels(tmp_path / "cup.png")
    for colour in ("orange", "blue", "green"):
        assert coloured(picture[:330], colour).any(), colour


def test_a_hand_without_shapes_is_drawn_before_it_is_solved(tmp_path: Path) -> None:
    from helpers import BENT, tripod_problem

    problem = replace(tripod_problem(BENT), x1=None)
    save_problem_picture(problem, tmp_path / "bones.png", width=640, height=360)
    assert pixels(tmp_path / "bones.png").std() > 0.03


def test_labels_cover_no_other_and_stay_in_the_picture() -> None:
    images = [Image.new("RGBA", (80, 30)) for _ in range(7)]
    labels = [
        _Label(image, (200.0, y), True) for image, y in zip(images, [90, 91, 92, 300, 301, 480, 490], strict=True)
    ]
    places = np.array([label.y for label in _spread(labels, 540)])
    assert np.diff(places).min() >= 30
    assert places.min() >= 0
    assert places.max() <= 540 - 30
    assert_allclose(_ascending(np.array([1.0, 3.0, 2.0, 5.0])), [1.0, 2.5, 2.5, 5.0])


def test_a_picture_has_to_be_one(gripper, tmp_path: Path) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"must end in \.png"):
        save_pads_picture(*gripper, tmp_path / "pads.jpg")
    with pytest.raises(ga.GraspAtlasError, match="at least 320 by 180"):
        save_problem_picture(ga.load_problem("gripper_skittle"), tmp_path / "x.png", width=10)
