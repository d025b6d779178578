"""Shapes that collide, and grasps that are rejected, as pictures and pages show them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsing import Tab, browser
from helpers import slow_but
from numpy.typing import NDArray
from screens import pixels, share, volume

import graspatlas as ga
from graspatlas.viewer import save_picture
from graspatlas.viewer.scene import meshes
from graspatlas.viewer.scene.captions import caption, scene_legend
from graspatlas.viewer.scene.clashing import ACROSS, CLEAR, RED, STRIPES, WHITE, WIDTH, striped
from graspatlas.viewer.scene.scene import Exhibit, Scene
from graspatlas.viewer.web.page import commands

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def none_accepted(can: ga.Problem) -> ga.Result:
    return ga.optimize(can, radius=0.6, require=[ga.CollisionFree(5e-5, 0.012)])


@pytest.fixture(scope="module")
def some_accepted(can: ga.Problem) -> ga.Result:
    return ga.optimize(can, radius=0.4, require=[ga.CollisionFree(5e-5), ga.ForceClosure(0.5)])


def chart_inside(result: ga.Result, name: str) -> int:
    """The first chart in which something is inside a body."""
    for chart in np.flatnonzero(~result.accepted):
        clashes = [each.clash for each in result.rejections(int(chart)) if each.clash]
        if clashes and clashes[0].names[1] == name and clashes[0].distance < -1e-3:
            return int(chart)
    raise AssertionError(name)


def stripes(exhibit: Exhibit) -> list[Any]:
    return [part for part in exhibit.parts if part.colour[:3] in [colour[:3] for colour in STRIPES]]


def area(mesh: meshes.Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0


@pytest.mark.parametrize(
    "mesh", [meshes.box([0.08, 0.05, 0.03]), meshes.ellipsoid([0.04, 0.03, 0.05]), meshes.capsule(0.01, 0.03)]
)
def test_stripes_are_the_surface_cut_at_their_edges(mesh: meshes.Mesh) -> None:
    red, white = striped(mesh)
    assert area(red) + area(white) == pytest.approx(area(mesh), rel=1e-9)
    assert 0.35 < area(red) / area(mesh) < 0.65
    assert volume(red) + volume(white) == pytest.approx(volume(mesh), rel=1e-9)  # no triangle has turned
    for part, odd in ((red, 0), (white, 1)):
        corners = part.vertices[part.faces]
        sizes = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        heights = (corners[sizes > 1e-12] @ ACROSS) / WIDTH  # slivers lie on an edge
        numbers = np.floor(heights.mean(axis=1))
        assert (numbers % 2 == odd).all()
        assert ((heights >= numbers[:, None] - 1e-5) & (heights <= numbers[:, None] + 1.0 + 1e-5)).all()
        np.testing.assert_allclose(np.linalg.norm(part.normals, axis=1), 1.0, atol=1e-9)


def test_the_nearest_stands_alone_with_what_collides(none_accepted: ga.Result) -> None:
    (exhibit,) = Scene(none_accepted).exhibits
    assert none_accepted.nearest is not None
    assert (exhibit.name, exhibit.grasp.chart) == ("nearest", none_accepted.nearest.chart)
    clash = exhibit.clash
    assert clash is not None
    assert {part.colour for part in stripes(exhibit)} == {RED, WHITE}
    assert not {"contact", "normal", "ellipsoid"} & {part.group for part in exhibit.parts}
    words = caption(none_accepted, exhibit)
    assert words.title == f"No grasp is accepted; nearest is chart {exhibit.grasp.chart}"
    assert " ".join(words.alarms) == f"rejected by collision free: {clash.text}"
    assert next(text for _, text in scene_legend(Scene(none_accepted))) == "striped: shapes that collide"


def test_stripes_are_where_the_shapes_are(some_accepted: ga.Result) -> None:
    """The deepest point lies in both: nearer to the middle of its stripes than their surface reaches."""
    chart = chart_inside(some_accepted, "can")
    best, exhibit = Scene(some_accepted, chart=chart).exhibits
    assert (best.name, exhibit.name, exhibit.grasp.chart) == ("best", "chart", chart)
    assert best.rejections == ()
    assert any(part.group == "contact" for part in best.parts)
    clash = exhibit.clash
    assert clash is not None
    (mark,) = [part for part in exhibit.parts if part.group == "clash"]
    for group in ("hand", "object"):
        shapes = [part.mesh.moved(part.T) for part in stripes(exhibit) if part.group == group]
        points = np.concatenate([mesh.vertices for mesh in shapes])
        normals = np.concatenate([mesh.normals for mesh in shapes])
        near = np.linalg.norm(points - mark.T[:3, 3], axis=1).argmin()
        assert (points[near] - mark.T[:3, 3]) @ normals[near] > -1e-3
    faded = {part.colour[3] for part in exhibit.parts if part.group == "object" and part not in stripes(exhibit)}
    assert max(faded) < 0.3


def test_an_obstacle_stays_see_through() -> None:
    table = ga.Obstacle.plane("table", [0.0, 0.0, -0.02])
    problem = replace(ga.load_problem("allegro_cylinder_3"), obstacles=(table,))
    (exhibit,) = Scene(ga.optimize(problem, radius=0.4, require=[ga.CollisionFree()])).exhibits
    plate = [part for part in exhibit.parts if part.group == "obstacle"]
    assert {part.colour for part in plate} == {(*colour[:3], CLEAR) for colour in STRIPES}


def test_a_chart_stands_beside_the_best_or_alone(some_accepted: ga.Result) -> None:
    def names(**how: Any) -> list[tuple[str, int]]:
        return [(exhibit.name, exhibit.grasp.chart) for exhibit in Scene(some_accepted, **how).exhibits]

    best = some_accepted.best.chart
    assert names(chart=3) == [("best", best), ("chart", 3)]
    assert names(chart=3, worst=False) == [("chart", 3)]
    assert names(chart=best) == [("best", best)]
    assert names() == [("best", best), ("worst", some_accepted.worst.chart)]
    n = some_accepted.atlas.n_charts
    with pytest.raises(ga.GraspAtlasError, match=f"chart {n} does not exist; the atlas has charts 0 to {n - 1}"):
        names(chart=n)


def test_a_rejection_that_is_no_collision_is_told(some_accepted: ga.Result) -> None:
    result = some_accepted
    chart = next(
        int(i) for i in np.flatnonzero(~result.accepted) if not any(each.clash for each in result.rejections(int(i)))
    )
    scene = Scene(result, chart=chart, worst=False)
    words = caption(result, scene.exhibits[0])
    assert words.title == f"Chart {chart}, rejected"
    assert " ".join(words.alarms).startswith("rejected by force closure: no force closure, margin -")
    assert words.motion
    assert stripes(scene.exhibits[0]) == []


def test_a_picture_of_the_nearest(none_accepted: ga.Result, tmp_path: Path) -> None:
    save_picture(none_accepted, tmp_path / "nearest.png", width=640, height=400)
    seen = pixels(tmp_path / "nearest.png")
    assert share(seen, "red") > 0.004
    words = seen[int(0.7 * 400) : int(0.92 * 400)]
    assert share(words, "red") > 0.001  # what it lacks, in red letters


def test_the_live_view_has_the_same(none_accepted: ga.Result) -> None:
    paths = [command["path"] for command in commands(Scene(none_accepted), with_legend=True) if "object" in command]
    assert {f"/graspatlas/nearest/{name}" for name in ("hand", "object", "clash", "caption")} <= set(paths)


def test_view_shows_a_chart(
    some_accepted: ga.Result, tmp_path: Path, cli: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    some_accepted.save(tmp_path / "result.npz")
    asked: list[Any] = []
    monkeypatch.setattr("graspatlas.viewer.save_picture", lambda *a, **how: asked.append(how))
    monkeypatch.setattr("graspatlas.viewer.view", lambda *a, **how: asked.append(how))
    assert cli("view", tmp_path, "--picture", tmp_path / "a.png", "--chart", 3)[0] == 0
    assert cli("view", tmp_path, "--meshcat", "--chart", 3, "--alone")[0] == 0
    assert [(how["chart"], how["worst"]) for how in asked] == [(3, True), (3, False)]
    monkeypatch.undo()
    n = some_accepted.atlas.n_charts
    status, _, err = cli("view", tmp_path, "--picture", tmp_path / "b.png", "--chart", n)
    assert (status, not (tmp_path / "b.png").exists()) == (2, True)
    assert f"chart {n} does not exist; the atlas has charts 0 to {n - 1}" in err


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("browser")) as page:
        yield page


@pytest.mark.browser
@pytest.mark.parametrize("which", slow_but(["nearest", "chart"], "nearest"))
def test_the_page_opens_at_what_collides(
    which: str, none_accepted: ga.Result, some_accepted: ga.Result, tab: Tab, tmp_path: Path
) -> None:
    if which == "nearest":
        assert none_accepted.nearest is not None
        result, chart, opened = none_accepted, none_accepted.nearest.chart, None
    else:
        result, chart = some_accepted, chart_inside(some_accepted, "can")
        opened = chart
    ga.export_html(result, tmp_path / "page.html", chart=opened)
    tab.open((tmp_path / "page.html").as_uri())
    why = result.rejections(chart)[0].why
    assert tab.run("graspatlas.selection.shown.join()") == str(chart)
    assert why in tab.run("document.getElementById('captions').textContent")
    assert tab.run("graspatlas.hand.figures[0].clashes")
    tab.picture(tmp_path / "clash.png")
    shown = share(pixels(tmp_path / "clash.png"), "red")
    tab.run("graspatlas.selection.show(0)")
    tab.frames()
    assert not tab.run("graspatlas.hand.figures[0].clashes")
    assert why not in tab.run("document.getElementById('captions').textContent")
    tab.picture(tmp_path / "other.png")
    assert shown > share(pixels(tmp_path / "other.png"), "red") + 0.0015
    assert tab.complaints == []
