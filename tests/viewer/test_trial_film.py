"""Films of trials, as pages and as strips of pictures."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pinch import pinch
from screens import browse, pixels, share

import graspatlas as ga
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.viewer.films.trial_film import moments, trial_film, trial_strips
from graspatlas.viewer.web.animation_page import film_animation


@pytest.fixture(scope="module")
def strong() -> ga.Recording:
    problem = pinch()
    return ga.record(ga.Grasps(problem, problem.x1_array)[0], protocol="shake", direction=(0, 1, 0), name="strong")


@pytest.fixture(scope="module")
def weak() -> ga.Recording:
    problem = pinch()
    icy = replace(PROTOCOLS["shake"], friction=0.1)
    return ga.record(ga.Grasps(problem, problem.x1_array)[0], protocol=icy, direction=(0, 1, 0), name="weak")


def test_parts_follow_the_recording(strong: ga.Recording) -> None:
    film = trial_film([strong], 40)
    assert len(film) == 40
    groups = [part.group for part in film.parts]
    assert groups == ["hand", "hand", "object", "contact", "contact", "force", "force", "push"]
    steps = film.frames
    scale = np.linalg.norm(film.T[0, 2, :3, 0])
    placed = np.diag([1.0 / scale] * 3 + [1.0]) @ film.T
    assert_allclose(placed[:, 2], strong.T_palm_object[steps], atol=1e-12)
    slides = strong.joint_positions[steps]
    assert_allclose(placed[:, 0, 0, 3], -0.1 + slides[:, 0], atol=1e-12)
    assert_allclose(placed[:, 1, 0, 3], 0.1 - slides[:, 1], atol=1e-12)


def test_arrows_are_as_long_as_forces_are_large(strong: ga.Recording) -> None:
    film = trial_film([strong])
    scale = np.linalg.norm(film.T[0, 2, :3, 0])
    placed = np.diag([1.0 / scale] * 3 + [1.0]) @ film.T
    pushes = np.linalg.norm(strong.pushes[film.frames], axis=1)
    lengths = np.linalg.norm(placed[:, -1, :3, 2], axis=1)
    pushed = pushes > 0.0
    assert_allclose(lengths[pushed], pushes[pushed] / pushes.max())
    assert (lengths[~pushed] < 1e-3).all()
    assert_allclose(placed[pushed, -1, :3, 2] / lengths[pushed, None], np.tile([0.0, 1.0, 0.0], (pushed.sum(), 1)))
    # The arrow begins at the surface of the box, which is 6 cm long.
    before = pushed & ~strong.lost[film.frames]
    assert_allclose(placed[before, -1, 1, 3] - placed[before, 2, 1, 3], 0.03, atol=0.01)
    forces = strong.contact_forces[film.frames]
    touching = ~np.isnan(strong.contact_points[film.frames, 0, 0])
    assert_allclose(placed[touching, 5, :3, 2], forces[touching, 0] / 10.0, atol=1e-9)


def test_it_is_told_when_the_object_is_lost(strong: ga.Recording) -> None:
    film = trial_film([strong])
    lost = strong.lost[film.frames]
    assert [bool(readout.alarm) for readout in film.readouts] == lost.tolist()
    assert film.readouts[-1].alarm == f"lost at {strong.breaking_force:.2f} N"
    assert film.readouts[0].value == "before closing"
    assert film.readouts[-1].value == f"push {np.linalg.norm(strong.pushes[-1]):.2f} N"
    assert film.curve is not None
    assert_allclose(film.curve[:, 1], np.linalg.norm(strong.pushes[film.frames], axis=1))


def test_moments_tell_the_trial(strong: ga.Recording) -> None:
    steps = moments(strong)
    assert len(steps) == 5
    assert [strong.phases[i] for i in steps] == ["closing", "squeeze", "push", "push", "push"]
    assert strong.lost[steps].tolist() == [False] * 4 + [True]
    sizes = np.linalg.norm(strong.pushes[steps], axis=1)
    assert_allclose(sizes[2:4] / strong.breaking_force, [0.5, 0.9], atol=0.02)


def test_two_trials_stand_side_by_side_at_the_same_times(strong: ga.Recording, weak: ga.Recording) -> None:
    film = trial_film([weak, strong], 50)
    half = len(film.parts) // 2
    points = [film.T[0, i * half + 2, :3, 3] for i in (0, 1)]
    assert np.linalg.norm(points[1] - points[0]) > 0.05
    ended = strong.times[film.frames] > weak.times[-1]
    assert ended.any()
    assert (np.ptp(film.T[ended, :half], axis=0) == 0.0).all()
    assert (np.linalg.norm(film.T[ended, half - 1, :3, 2], axis=1) < 1e-3).all()
    assert [(label.title, label.text) for label in film.labels] == [
        (r.name, f"lost at {r.breaking_force:.2f} N") for r in (weak, strong)
    ]
    between = film.readouts[int(np.flatnonzero(ended)[0])].details
    assert f"weak lost at {weak.breaking_force:.2f} N; strong held" in between
    strips = trial_strips([weak, strong])
    assert_allclose(strips[0].direction, strips[1].direction)
    sizes = [np.linalg.norm(strip.T[-2, -1, :3, 2]) for strip in strips]
    assert sizes[0] < 0.3 * sizes[1]


def test_a_page_carries_every_placement(strong: ga.Recording, tmp_path: Path) -> None:
    ga.export_html(strong, tmp_path / "trial.html")
    text = (tmp_path / "trial.html").read_text(encoding="utf-8")
    match = re.search(r"^const film = (.*);$", text, re.MULTILINE)
    assert match
    data, film = json.loads(match[1]), trial_film([strong])
    rows = np.frombuffer(base64.b64decode(data["placements"]), np.float32).reshape(len(film), -1, 4, 3)
    assert_allclose(rows.transpose(0, 1, 3, 2), film.T[:, film.moving, :3], atol=1e-6)
    assert data["readouts"][-1][:2] == [film.readouts[-1].value, film.readouts[-1].alarm]
    assert not re.search(r"""(?:src|href)=["']?http""", text)


def test_arrows_grow_in_the_live_view_too(strong: ga.Recording) -> None:
    film = trial_film([strong], 20)
    tracks = film_animation(film)["animations"][-1]["clip"]["tracks"]  # type: ignore[index]
    scale = next(track for track in tracks if track["name"] == ".scale")
    assert_allclose([key["value"][0] for key in scale["keys"]], np.linalg.norm(film.T[:, -1, :3, 2], axis=1))


def test_a_strip_of_each_trial(strong: ga.Recording, weak: ga.Recording, tmp_path: Path) -> None:
    ga.save_picture(strong, tmp_path / "one.png", width=480, height=180)
    ga.save_picture([weak, strong], tmp_path / "two.png", width=480, height=270)
    assert pixels(tmp_path / "one.png").shape == (180, 480, 3)
    shown = pixels(tmp_path / "two.png")
    violet = (shown[..., 2] > 0.5) & (shown[..., 1] < 0.4) & (shown[..., 0] > 0.2)
    assert violet[135:].sum() > 20


@pytest.mark.parametrize("shown", [[], [3], "out", ["a"]])
def test_what_is_no_trial_is_not_shown(shown: object, tmp_path: Path) -> None:
    with pytest.raises(ga.GraspAtlasError, match="recorded trials can be shown"):
        ga.export_html(shown, tmp_path / "page.html")  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.browser
def test_the_page_of_a_trial_opens_at_a_frame(tmp_path: Path) -> None:
    problem = ga.load_problem("schunk_can")
    recording = ga.record(ga.Grasps(problem, problem.x1_array)[0])
    ga.export_html(recording, tmp_path / "trial.html")
    film = trial_film([recording])
    for frame in (0, len(film) - 1):
        address = (tmp_path / "trial.html").as_uri() + f"#frame={frame}"
        browse(address, tmp_path, f"--screenshot={tmp_path / 'page.png'}")
        shown = pixels(tmp_path / "page.png")
        assert share(shown, "grey") > 0.01
        assert share(shown, "blue") > 0.0004
        red, green, blue = (shown[:600, :, k] for k in range(3))
        violet = ((blue > 0.5) & (blue > 2.0 * green) & (red > 1.5 * green)).sum()
        assert (violet > 50) == (frame > 0), violet
        text = browse(address, tmp_path, "--dump-dom")
        assert film.readouts[frame].value in text
    assert film.readouts[-1].alarm in text
