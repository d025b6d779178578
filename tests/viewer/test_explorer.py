"""The page of a whole atlas: what is in it, and what it does with real pointers and keys in a browser."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from browsing import Tab, browser
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from screens import pixels, share

import graspatlas as ga
from graspatlas.analysis.peaks import local_maxima
from graspatlas.viewer import export_html
from graspatlas.viewer.scene.bodies import BodyShapes

Array = NDArray[np.float64]
EVIL = "</script><img src=x onerror=alert(1)>&quot;"
#: Half a pixel of a 4K screen on a hand is about this long [m].
PRECISE = 1e-4


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("browser")) as tab:
        yield tab


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Callable[[ga.Result], str]:
    """Writes the page of a result once, and says where it is."""
    folder, written = tmp_path_factory.mktemp("pages"), {}

    def address(result: ga.Result) -> str:
        if id(result) not in written:
            path = folder / f"{len(written)}.html"
            export_html(result, path)
            written[id(result)] = path.as_uri()
        return str(written[id(result)])

    return address


@pytest.fixture(autouse=True)
def no_complaints(request: pytest.FixtureRequest) -> Iterator[None]:
    """No page writes an error or a warning to the console, or asks for anything but itself."""
    yield
    if "tab" in request.fixturenames:
        tab = request.getfixturevalue("tab")
        complaints, requests = tab.complaints[:], tab.requests[:]
        tab.complaints.clear()
        tab.requests.clear()
        assert not complaints
        assert {address.split(":")[0] for address in requests} <= {"file", "about", "data", "blob"}


def place_of(tab: Tab, chart: int) -> tuple[float, float]:
    """Where a chart is on the screen."""
    return tuple(
        tab.run(
            f"""(() => {{
            const {{ atlas }} = graspatlas, box = atlas.canvas.getBoundingClientRect();
            const place = atlas.faces ? graspatlas.atlas.centers : atlas.points.geometry.attributes.position.array;
            const vector = atlas.lamp.position.clone().set(...place.slice({3 * chart}, {3 * chart + 3}));
            const at = atlas.project(vector, box.width, box.height);
            return [box.x + at.x, box.y + at.y];
        }})()"""
        )
    )


def picked(tab: Tab, chart: int) -> int:
    """The chart that is seen where a chart is."""
    x, y = place_of(tab, chart)
    box = "graspatlas.atlas.canvas.getBoundingClientRect()"
    return int(tab.run(f"graspatlas.atlas.pick({x} - {box}.x, {y} - {box}.y)"))


def visible_chart(tab: Tab, among: Any) -> int:
    """A chart that nothing hides."""
    return next(int(chart) for chart in among if picked(tab, int(chart)) == chart)


def shown(tab: Tab) -> list[int]:
    return list(tab.run("graspatlas.hand.panes"))


def drawn_vertices(tab: Tab, pane: int, what: str) -> Array:
    """Some vertices of the hand's or the object's meshes as they are drawn (n, 3)."""
    groups = "figure.joints" if what == "hand" else "[figure.object]"
    return np.array(
        tab.run(
            f"""(() => {{
        const figure = graspatlas.hand.figures[{pane}], out = [];
        figure.scene.updateMatrixWorld(true);
        for (const group of {groups}) for (const mesh of group.children) {{
          const {{ position }} = mesh.geometry.attributes, p = figure.lamps[0].position.clone();
          for (let i = 0; i < position.count; i += 23)
            out.push(p.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld).toArray());
        }}
        return out;
    }})()"""
        )
    )


def assert_drawn(tab: Tab, result: ga.Result, chart: int, pane: int = 0) -> None:
    """The drawn hand and object stand where Pinocchio places them."""
    shapes, grasp = BodyShapes(result.problem), result.grasp(chart)
    for what, parts in (("hand", shapes.hand(grasp.q)), ("object", shapes.object())):
        T = np.eye(4) if what == "hand" else grasp.T_palm_object
        placed = np.concatenate([mesh.moved(T @ T_part).vertices for mesh, T_part, _ in parts])
        drawn = drawn_vertices(tab, pane, what)
        assert len(drawn) > 10
        assert cKDTree(placed).query(drawn)[0].max() < PRECISE
    contacts = tab.run(f"graspatlas.hand.figures[{pane}].contacts.map((c) => c.matrix.elements.slice(12, 15))")
    assert np.abs(np.array(contacts) - grasp.contact_points).max() < PRECISE


# The file


def test_page_needs_no_network(result: ga.Result, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    export_html(result, path)
    text = path.read_text(encoding="utf-8")
    assert f"<title>graspatlas: {result.problem.name}</title>" in text
    for words in ("manipulability volume: best ", "worst ", "contact point", "complete"):
        assert words in text
    addresses = set(re.findall(r"(?:https?:)?//[\w.-]+\.[a-z]{2,}[^\s\"'<>)]*", text.replace("http://www.w3.org/", "")))
    assert not re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)\s*=", text)
    assert not {address for address in addresses if address.startswith("http")}
    assert len(text) < 4e6


def hostile(result: ga.Result) -> ga.Result:
    """The same result with markup in the names of problem, index, object and requirements."""

    def index(grasp: ga.Grasp) -> float:
        return float(grasp.q[0])

    index.__name__ = EVIL
    problem = replace(result.problem, name=EVIL, object=replace(result.problem.object, name=EVIL))
    found = replace(result.by(index), problem=problem)
    return replace(found, requirements=(lambda grasp: True,), rejected={EVIL: 0})


def test_names_cannot_break_the_page(small_result: ga.Result, tmp_path: Path) -> None:
    export_html(hostile(small_result), tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<img" not in text
    assert "&lt;/script&gt;&lt;img" in text


def test_a_page_opens_at_a_chart_that_exists(planar_result: ga.Result, tmp_path: Path) -> None:
    with pytest.raises(ga.GraspAtlasError, match="chart 756 does not exist"):
        export_html(planar_result, tmp_path / "page.html", chart=756)
    with pytest.raises(ga.GraspAtlasError, match="only a result has charts"):
        export_html(ga.shortest_path(planar_result, 0, 5), tmp_path / "page.html", chart=0)


def test_view_opens_the_page_at_a_chart(planar_result: ga.Result, tmp_path: Path, cli: Callable[..., Any]) -> None:
    planar_result.save(tmp_path / "result.npz")
    place = tmp_path / "page.html"
    assert cli("view", tmp_path, "--html", place, "--chart", "worst")[0] == 0
    assert f'"opens_at": {planar_result.worst.chart},' in place.read_text(encoding="utf-8")
    status, _, err = cli("view", tmp_path, "--html", place, "--chart", "756")
    assert status != 0
    assert "chart 756 does not exist; the atlas has charts 0 to 755" in err


def test_the_page_is_written_where_no_grasp_meets_the_requirements(small_result: ga.Result, tmp_path: Path) -> None:
    nothing = replace(small_result, accepted=np.zeros(small_result.atlas.n_charts, bool))
    export_html(nothing, tmp_path / "page.html")
    assert "no grasp meets the requirements" in (tmp_path / "page.html").read_text(encoding="utf-8")


# In a browser


@pytest.mark.browser
def test_pointing_clicking_and_walking(planar_result: ga.Result, page: Callable[..., str], tab: Tab) -> None:
    tab.open(page(planar_result))
    assert shown(tab) == [planar_result.best.chart, planar_result.worst.chart]
    chart = visible_chart(tab, np.random.default_rng(0).permutation(planar_result.atlas.n_charts))
    tab.mouse("mouseMoved", *place_of(tab, chart))
    tab.frames(1)
    assert shown(tab) == [planar_result.best.chart, chart]
    assert_drawn(tab, planar_result, chart, pane=1)
    assert f"Chart {chart}" in tab.run("document.getElementById('captions').textContent")
    tab.click(*place_of(tab, chart))
    assert tab.run("graspatlas.selection.pins") == [planar_result.best.chart, chart]
    tab.wait_for(f"location.hash === '#chart={planar_result.best.chart},{chart}'")
    tab.press("ArrowUp")
    assert shown(tab)[1] in planar_result.atlas.neighbours[chart]
    tab.press("Escape")
    assert tab.run("graspatlas.selection.pins") == []


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.parametrize("name", ["schunk_can", "planar_hand", "gripper_skittle", "three_finger_cup"])
def test_the_drawn_hand_is_where_pinocchio_places_it(name: str, tab: Tab, tmp_path: Path) -> None:
    """Revolute, continuous and sliding joints, and joints that mimic others."""
    result = ga.optimize(ga.load_problem(name), require=[], max_charts=400)
    export_html(result, tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri())
    for chart in np.random.default_rng(1).integers(result.atlas.n_charts, size=8):
        tab.run(f"graspatlas.selection.show({chart})")
        assert_drawn(tab, result, int(chart))


@pytest.mark.browser
@pytest.mark.slow
def test_the_table_is_level_and_the_hand_where_it_is_to_it(planar_result: ga.Result, tab: Tab, tmp_path: Path) -> None:
    table = ga.Obstacle.plane("table", (0.0, 0.0, -0.1), (0.6, 0.0, 0.8))
    result = replace(planar_result, problem=replace(planar_result.problem, obstacles=(table,)))
    export_html(result, tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri() + "#chart=33")
    figure, pose = "graspatlas.hand.figures[0]", result.grasp(33).T_palm_object
    palm, body = (
        np.array(tab.run(f"{figure}.{which}.matrix.elements")).reshape(4, 4).T for which in ("palm", "object")
    )
    assert np.abs(body - pose).max() < PRECISE
    assert np.abs(palm[:3, :3] @ pose[:3, :3] @ [0.6, 0.0, 0.8] - [0.0, 0.0, 1.0]).max() < PRECISE
    assert tab.run(f"{figure}.joints.every((joint) => joint.parent === {figure}.palm)")


@pytest.mark.browser
@pytest.mark.slow
def test_hands_without_meshes_are_sketched(planar_result: ga.Result, tab: Tab, tmp_path: Path) -> None:
    problem = planar_result.problem
    bare = re.sub(r"<(visual|collision)\b.*?</\1>", "", problem.hand.urdf, flags=re.DOTALL)
    result = replace(planar_result, problem=replace(problem, hand=replace(problem.hand, urdf=bare)))
    export_html(result, tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri() + "#chart=33")
    tips = tab.run("graspatlas.hand.figures[0].sticks.tips.map((t) => t.matrix.elements.slice(12, 15))")
    assert np.abs(np.array(tips)[-3:] - result.grasp(33).contact_points).max() < PRECISE


@pytest.mark.browser
@pytest.mark.slow
def test_all_parts_share_one_selection(gripper: ga.Result, page: Callable[..., str], tab: Tab) -> None:
    tab.open(page(gripper))
    assert shown(tab) == [gripper.atlas.n_charts, gripper.worst.chart]  # the refined maximum stands after the charts
    assert tab.run("graspatlas.selection.extreme(1)") == gripper.best.chart
    maxima = tab.run("graspatlas.selection.graph.localMaxima(graspatlas.selection.values, graspatlas.selection.counts)")
    assert maxima == local_maxima(gripper).tolist()
    front = ga.pareto_front(gripper, gripper.quality, "joint_centrality")
    tab.choose("#other", "joint centrality")
    assert tab.run("graspatlas.scatter.front()") == front.tolist()
    assert f"Pareto front: {len(front)} grasp" in tab.run("document.getElementById('front-text').textContent")
    for key, chart in (("b", gripper.best.chart), ("w", gripper.worst.chart), ("x", 0), ("m", maxima[0])):
        tab.press(key)
        assert shown(tab)[-1] == chart


@pytest.mark.browser
@pytest.mark.slow
def test_brush_and_switches_grey_charts_out(can: ga.Problem, tab: Tab, tmp_path: Path) -> None:
    result = ga.optimize(can, require=[ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree()])
    export_html(result, tmp_path / "can.html", chart=17)
    assert (tmp_path / "can.html").stat().st_size < 4e6
    tab.open((tmp_path / "can.html").as_uri())
    assert shown(tab) == [17]
    tab.picture(tmp_path / "can.png")
    seen = pixels(tmp_path / "can.png")[:, 500:]
    for colour in ("blue", "grey", "red"):
        assert share(seen, colour) > 0.0001
    count = "graspatlas.selection.inside.reduce((a, b) => a + b, 0)"
    assert tab.run(count) == result.accepted.sum()
    box = tab.box("#histogram")
    y, right = box["y"] + 40.0, box["x"] + box["width"]
    tab.drag((box["x"] + 0.5 * box["width"], y), (right - 1.0, y))
    low, high = tab.run("graspatlas.selection.range")
    inside = result.accepted & (result.qualities >= low) & (result.qualities <= high)
    assert tab.run(count) == inside.sum()
    assert 0 < inside.sum() < result.accepted.sum()
    tab.click(*tab.middle("#unbrush"))
    assert tab.run(count) == result.accepted.sum()
    for _ in result.requirements:
        tab.run("document.querySelector('#requirements input:checked').click()")
    assert tab.run(count) == result.atlas.n_charts


@pytest.mark.browser
@pytest.mark.slow
def test_what_is_copied_is_what_files_hold(
    planar_result: ga.Result, page: Callable[..., str], tab: Tab, tmp_path: Path
) -> None:
    tab.open(page(planar_result) + "#chart=7,30")
    assert shown(tab) == [7, 30]
    planar_result.save_grasps(tmp_path / "grasps.json", charts=[7, 30])
    expected = json.loads((tmp_path / "grasps.json").read_text(encoding="utf-8"))
    for name, read in (("json", json.loads), ("yaml", yaml.safe_load)):
        tab.click(*tab.middle(f"#copy-{name}"))
        tab.wait_for("graspatlas.table.copied")
        copied = read(tab.run("graspatlas.table.copied"))
        assert set(copied) == set(expected)
        assert {k: v for k, v in copied.items() if k != "grasps"} == {
            k: v for k, v in expected.items() if k != "grasps"
        }
        for ours, theirs in zip(copied["grasps"], expected["grasps"], strict=True):
            assert set(ours) == set(theirs)
            assert ours["chart"] == theirs["chart"]
            assert ours["joints"] == pytest.approx(theirs["joints"], abs=2e-4)
            assert ours["palm_in_object"]["xyz"] == pytest.approx(theirs["palm_in_object"]["xyz"], abs=PRECISE)
            same = np.dot(ours["palm_in_object"]["quat_xyzw"], theirs["palm_in_object"]["quat_xyzw"])
            assert abs(same) == pytest.approx(1.0, abs=1e-6)
            assert ours["indices"][planar_result.quality] == pytest.approx(
                theirs["indices"][planar_result.quality], rel=1e-6
            )
            for a, b in zip(ours["contacts"], theirs["contacts"], strict=True):
                assert a["frame"] == b["frame"]
                assert a["point"] == pytest.approx(b["point"], abs=PRECISE)
                assert a["normal"] == pytest.approx(b["normal"], abs=1e-3)


@pytest.mark.browser
@pytest.mark.slow
def test_the_path_from_pin_to_pin_goes_through_neighbours(
    planar_result: ga.Result, page: Callable[..., str], tab: Tab
) -> None:
    tab.open(page(planar_result) + "#chart=0,400")
    tab.press("p")
    chain = tab.run("graspatlas.path.chain")
    assert (chain[0], chain[-1]) == (0, 400)
    assert all(b in planar_result.atlas.neighbours[a] for a, b in pairwise(chain))
    tab.wait_for("!graspatlas.path.playing")
    assert tab.run("graspatlas.selection.current") == 400


@pytest.mark.browser
@pytest.mark.slow
def test_fingers_on_a_phone(planar_result: ga.Result, page: Callable[..., str], tab: Tab) -> None:
    tab.open(page(planar_result), 390, 844, touch=True)
    assert tab.run("document.documentElement.scrollWidth") <= 390
    tab.run("document.getElementById('atlas-stage').scrollIntoView({ block: 'center' })")
    tab.frames(3)
    chart = visible_chart(tab, np.random.default_rng(2).permutation(planar_result.atlas.n_charts))
    x, y = place_of(tab, chart)
    tab.touch([(x, y)])
    assert chart in tab.run("graspatlas.selection.pins")
    before = tab.run("[graspatlas.atlas.orbit.azimuth, graspatlas.atlas.orbit.zoom]")
    tab.touch([(150.0, y), (180.0, y), (230.0, y + 5)])
    turned = tab.run("[graspatlas.atlas.orbit.azimuth, graspatlas.atlas.orbit.zoom]")
    assert turned[0] != before[0]
    tab.touch([(180.0, y), (140.0, y)], [(220.0, y), (260.0, y)])
    assert tab.run("graspatlas.atlas.orbit.zoom") > turned[1]


@pytest.mark.browser
@pytest.mark.slow
def test_hostile_names_are_only_text(small_result: ga.Result, tab: Tab, tmp_path: Path) -> None:
    export_html(hostile(small_result), tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri())
    tab.wait_for("document.querySelector('#table table')")
    assert tab.run("document.querySelectorAll('img').length") == 0
    assert EVIL.replace("_", " ") in tab.run("document.getElementById('words').textContent")


@pytest.mark.browser
@pytest.mark.slow
def test_a_grasp_takes_little_of_a_frame(planar_result: ga.Result, page: Callable[..., str], tab: Tab) -> None:
    """Script time of a grasp that is pointed at: reading it, telling all parts, drawing it."""
    tab.open(page(planar_result))
    median = tab.run(
        """(async () => {
        const { selection, hand, facts } = graspatlas, times = [];
        for (let k = 0; k < 21; k++) {
          selection.point((k * 7919) % facts.n_charts);
          await new Promise(requestAnimationFrame);
          times.push(selection.milliseconds + hand.stage.milliseconds);
        }
        return times.sort((a, b) => a - b)[10];
    })()"""
    )
    assert 0.0 < median < 8.0  # twice what it must take, since tests share their machine
