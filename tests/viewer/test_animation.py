"""Films of paths, as pages and in the live view."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from screens import browse, pixels, share

import graspatlas as ga
from graspatlas.viewer import export_html, save_picture, view
from graspatlas.viewer.films.path_film import path_film
from graspatlas.viewer.web.animation_page import film_animation
from graspatlas.viewer.web.browser import close

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def path(small_result: ga.Result) -> ga.GraspPath:
    return ga.shortest_path(small_result, small_result.worst.chart)


def test_film_shows_the_grasps_of_the_path(path: ga.GraspPath) -> None:
    film = path_film(path, 7)
    assert len(film) == 7
    assert (film.frames[0], film.frames[-1]) == (0, len(path) - 1)
    for i, point in enumerate(film.frames):
        parts = film.frame(i)
        balls = [part.T[:3, 3] for part in parts if part.group == "contact"]
        needles = [part.T[:3, 2] for part in parts if part.group == "normal"]
        assert_allclose(balls, path.grasps.contact_points[point], atol=1e-12)
        assert_allclose(needles, path.grasps.contact_normals[point], atol=1e-9)
        tips = [part for part in parts if part.group in ("hand", "object")]
        assert len(tips) == path.result.problem.hand.urdf.count("<visual") + path.result.problem.object.urdf.count(
            "<visual"
        )
    moving = {part.group for part, moves in zip(film.parts, film.moving, strict=True) if moves}
    assert moving == {"hand", "object", "contact", "normal"}
    assert not film.moving.all()  # the palm stands still


def test_film_page_carries_every_placement(path: ga.GraspPath, tmp_path: Path) -> None:
    export_html(path, tmp_path / "path.html")
    text = (tmp_path / "path.html").read_text(encoding="utf-8")
    match = re.search(r"^const film = (.*);$", text, re.MULTILINE)
    assert match
    data = json.loads(match[1])
    film = path_film(path)
    rows = np.frombuffer(base64.b64decode(data["placements"]), np.float32).reshape(len(film), -1, 4, 3)
    assert_allclose(rows.transpose(0, 1, 3, 2), film.T[:, film.moving, :3], atol=1e-6)
    assert_allclose(data["curve"], [path.arc_length[film.frames], path.qualities[film.frames]])
    assert data["curve"][0][-1] == pytest.approx(path.length)
    assert {alarm for _, alarm, _ in data["readouts"]} == {""}
    assert len(text) < 6e6


def test_meshcat_plays_every_placement(path: ga.GraspPath) -> None:
    film = path_film(path, 20)
    animations = film_animation(film)["animations"]
    assert len(animations) == film.moving.sum()
    for animation, part in zip(animations, np.flatnonzero(film.moving), strict=True):
        position = animation["clip"]["tracks"][0]["keys"]
        assert_allclose([key["value"] for key in position], film.T[:, part, :3, 3])
        assert [key["time"] for key in position] == pytest.approx(range(20))


def test_a_path_is_served(path: ga.GraspPath, capsys: pytest.CaptureFixture[str]) -> None:
    visualizer = view(path, open_browser=False, wait=False)
    try:
        assert visualizer.url() in capsys.readouterr().err
        assert visualizer.static_html().count("fetch(") > 20
    finally:
        close(visualizer)


@pytest.mark.slow
def test_strip_shows_six_grasps(path: ga.GraspPath, tmp_path: Path) -> None:
    save_picture(path, tmp_path / "strip.png", width=480, height=270)
    shown = pixels(tmp_path / "strip.png")
    assert shown.shape == (270, 480, 3)
    assert share(shown, "grey") > 0.02
    assert share(shown, "yellow") > 0.005


def test_what_has_no_hand_is_not_shown(sphere: ga.Atlas, small_result: ga.Result, tmp_path: Path) -> None:
    with pytest.raises(ga.GraspAtlasError, match="not one of grasps"):
        export_html(ga.shortest_path(sphere, 0, 5), tmp_path / "path.html")
    with pytest.raises(ga.GraspAtlasError, match=r"only a graspatlas\.Result, a path"):
        view(small_result.atlas)  # type: ignore[arg-type]
    export_html(ga.shortest_path(small_result, 3, 3), tmp_path / "point.html")
    assert [file.name for file in tmp_path.iterdir()] == ["point.html"]


READ_OUT = """<script>
slider.value = 17;
slider.dispatchEvent(new Event("input"));
const shown = film.paths.map((path) => viewer.scene_tree.find(path.split("/").filter(Boolean)).object);
const report = document.createElement("pre");
report.id = "report";
report.textContent = JSON.stringify(shown.map((o) => { o.updateMatrix(); return o.matrix.toArray(); }));
document.body.append(report);
</script>"""


@pytest.mark.slow
@pytest.mark.browser
def test_slider_moves_the_grasp(path: ga.GraspPath, tmp_path: Path) -> None:
    page = tmp_path / "path.html"
    export_html(path, page)
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", READ_OUT + "</body>"), encoding="utf-8")
    text = browse(page.as_uri(), tmp_path, "--dump-dom")
    match = re.search(r'<pre id="report">(.*?)</pre>', text)
    assert match
    film = path_film(path)
    shown = np.array(json.loads(match[1])).reshape(-1, 4, 4).transpose(0, 2, 1)
    assert_allclose(shown, film.T[17, film.moving], atol=1e-5)
    assert f"point {film.frames[17]} of {len(path) - 1}" in text
    assert f"arc length {path.arc_length[film.frames[17]]:.3f} of {path.length:.3f}" in text


#: Says how far the page reaches beyond the window while its longest line is shown.
LONGEST_LINE = """<script>
addEventListener("load", () => setTimeout(() => {
  const line = "inverse condition number 0.0363 \\u2717 breaks a requirement";
  document.getElementById("readout").firstChild.textContent = line;
  const page = document.documentElement;
  document.title = "beyond " + (page.scrollWidth - page.clientWidth) + ", " + (page.scrollHeight - page.clientHeight);
}, 500));
</script>"""


@pytest.mark.slow
@pytest.mark.browser
def test_the_longest_line_of_a_film_page_stays_in_the_window(path: ga.GraspPath, tmp_path: Path) -> None:
    page = tmp_path / "path.html"
    export_html(path, page)
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", LONGEST_LINE + "</body>"), encoding="utf-8")
    assert "<title>beyond 0, 0</title>" in browse(page.as_uri(), tmp_path, "--dump-dom")


@pytest.mark.slow
@pytest.mark.browser
def test_film_page_opens_at_the_frame_of_its_address(path: ga.GraspPath, tmp_path: Path) -> None:
    export_html(path, tmp_path / "path.html")
    address = (tmp_path / "path.html").as_uri() + "#frame=30"
    screenshot = tmp_path / "page.png"
    browse(address, tmp_path, f"--screenshot={screenshot}")
    shown = pixels(screenshot)
    for colour, least in (("yellow", 0.01), ("grey", 0.01), ("red", 0.0001)):
        assert share(shown, colour) > least
    assert f"point {path_film(path).frames[30]} of" in browse(address, tmp_path, "--dump-dom")
