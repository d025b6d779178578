"""What Jupyter shows: cards of problems, results, atlases, grasps, paths and components, and the page of a result."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsing import LOADED, Tab, browser

import graspatlas as ga
from graspatlas.sweep import Sweep
from graspatlas.sweep.rows import COLUMNS
from graspatlas.viewer.notebook import pictures
from graspatlas.viewer.notebook.card import bars, card, curve, table

EVIL = '</td></table><script>alert(1)</script><img src=x onerror="alert(2)">&amp;'
#: Elements that have no end.
VOID = {"img", "rect", "path", "polyline"}


class Elements(HTMLParser):
    """Reads HTML, and makes sure that every element ends where it must."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.names: list[str] = []
        self.text = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.names.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def planar() -> ga.Result:
    return ga.optimize(ga.load_problem("planar_hand"), refine=True)


def things(result: ga.Result) -> dict[str, Any]:
    path = ga.shortest_path(result, 0, 200)
    return {
        "problem": result.problem,
        "result": result,
        "atlas": result.atlas,
        "grasp": result.best,
        "path": path,
        "components": components(result),
    }


def components(result: ga.Result) -> ga.Components:
    status = ga.SearchStatus.COVERED
    return ga.Components((result,), (3,), found=3, covered=2, holes=0, tries=7, status=status, seconds=0.1)


@pytest.mark.parametrize("kind", ["problem", "result", "atlas", "grasp", "path", "components"])
def test_cards_have_a_table_and_a_picture(planar: ga.Result, kind: str) -> None:
    html = things(planar)[kind]._repr_html_()
    found = Elements(html)
    assert "table" in found.names
    assert {"img", "svg"} & set(found.names)
    assert ("planar_hand" in found.text) == (kind != "atlas")
    # Colours are those of the page around it, so that it can be read in light and dark themes.
    assert not re.search(r"(?<![-\w])(color|background)[^;\"']*(#|rgb|white|black)", html)


def test_cards_say_what_matters(planar: ga.Result) -> None:
    shown = {kind: Elements(thing._repr_html_()).text for kind, thing in things(planar).items()}
    assert f"{planar.atlas.n_charts} charts, k = 2" in shown["result"]
    assert f"{planar.refined_best.quality:.5g}, {planar.refinement.statuses[0]}" in shown["result"]
    assert "complete" in shown["atlas"]
    assert "t = 3" in shown["problem"]
    for name, position in planar.best.joint_positions.items():
        assert f"{name}{position:.4f}" in shown["grasp"]
    assert "the last grasps found were all covered" in shown["components"]
    assert "inverse_condition_number along the path" in shown["path"]


def test_names_are_shown_as_they_are(planar: ga.Result) -> None:
    def index(grasp: ga.Grasp) -> float:
        return float(grasp.chart)

    index.__name__ = EVIL
    named = replace(planar.problem, name=EVIL, object=replace(planar.problem.object, name=EVIL))
    found = replace(planar.by(index), problem=named, rejected={EVIL: 1})
    for kind, thing in (things(found) | {"problem": named}).items():
        html = thing._repr_html_()
        assert "script" not in Elements(html).names, kind
        assert "onerror=" not in html.replace("onerror=&quot;", "")
    assert EVIL in Elements(card(EVIL, [table({EVIL: EVIL}, [EVIL])])).text
    assert "script" not in Elements(curve(np.arange(3.0), np.arange(3.0), EVIL) + bars([1.0], EVIL)).names


def test_a_card_stands_without_its_picture(planar: ga.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*args: object) -> None:
        raise MemoryError

    for name in ("painted", "_dots"):
        monkeypatch.setattr(pictures, name, broken)
    for kind, thing in things(planar).items():
        found = Elements(thing._repr_html_())
        assert "table" in found.names, kind
        assert "img" not in found.names


def test_results_without_a_grasp_have_a_card(planar: ga.Result) -> None:
    nothing = replace(planar, accepted=np.zeros(planar.atlas.n_charts, bool), refinement=None)
    assert "img" in Elements(nothing._repr_html_()).names
    assert "none" in Elements(components(nothing)._repr_html_()).text


def test_other_manifolds_have_cards() -> None:
    for system, start in ((ga.systems.Sphere(3), [0.0, 0.0, 1.0]), (ga.systems.Torus(2.0, 0.5), [2.5, 0.0, 0.0])):
        atlas = ga.build_atlas(system, start, radius=0.4, epsilon=0.5)
        path = ga.shortest_path(atlas, 0, atlas.n_charts - 1)
        assert "img" in Elements(atlas._repr_html_()).names
        assert "points" in Elements(path._repr_html_()).text


def test_cards_are_quick(can_result: ga.Result) -> None:
    """Half a second on a machine of its own; other tests may have most of this one, so that the best of some counts."""
    spent = []
    for _ in range(3):
        start = time.process_time()
        can_result._repr_html_()
        spent.append(time.process_time() - start)
    assert min(spent) < 1.2


def test_sweeps_have_cards() -> None:
    row = dict.fromkeys(COLUMNS) | {"problem": EVIL, "quality": "min_weight", "quality_best": 0.5, "status": "complete"}
    failed = dict.fromkeys(COLUMNS) | {"error": "no such problem"}
    found = Elements(Sweep(Path("runs.parquet"), [row] * 30 + [failed], 0, 2)._repr_html_())
    assert {"table", "svg"} <= set(found.names)
    assert "31 runs ended, 1 of them failed, 2 are missing, the first 20 below" in found.text
    assert "no such problem" in Elements(Sweep(Path("runs.parquet"), [failed], 0, 0)._repr_html_()).text


def test_bars_and_curves_take_what_comes() -> None:
    for values in ([], [0.0], [-1.0, 2.0], [np.nan, np.inf]):
        with np.errstate(all="raise"):
            drawn = curve(np.arange(len(values)), np.array(values), "a curve")
        assert "nan" not in drawn
    assert bars([3.0, 1.0, -1.0], "bars").count("<rect") == 3
    assert "nan" not in bars([], "bars")


# The page of a result


def test_wrong_pages_are_refused(planar: ga.Result) -> None:
    with pytest.raises(ga.GraspAtlasError, match="chart 9999 does not exist"):
        planar.explore(9999)
    with pytest.raises(ga.GraspAtlasError, match="height must be a whole number from 200 to 4000"):
        planar.explore(height=10)


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("browser")) as tab:
        yield tab


@pytest.mark.browser
@pytest.mark.parametrize("width", [390, 1000])
def test_the_page_works_within_another(planar: ga.Result, tab: Tab, tmp_path: Path, width: int) -> None:
    """As in the output of a cell, where it has no address of its own."""
    named = replace(planar, problem=replace(planar.problem, name=EVIL))
    page = named.explore(5, height=500)
    assert "EmbeddedPage" in repr(page)
    assert len(repr(page)) < 300
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><body>{page._repr_html_()}</body>", encoding="utf-8")
    tab.open((tmp_path / "notebook.html").as_uri(), width, 700, ready=LOADED)
    frame = "document.querySelector('iframe')"
    tab.wait_for(f"{frame}.contentDocument?.documentElement?.dataset.ready === 'yes'")
    assert tab.run(f"{frame}.getBoundingClientRect().height") == 500
    assert tab.run(f"{frame}.contentWindow.graspatlas.hand.panes") == [5]
    assert EVIL in tab.run(f"{frame}.contentDocument.body.textContent")
    assert tab.run(f"document.documentElement.scrollWidth <= {width}")
    tab.run(f"{frame}.contentWindow.graspatlas.selection.show(7)")
    tab.wait_for(f"{frame}.contentWindow.graspatlas.hand.panes.includes(7)")
    tab.frames(12)  # as long as an address takes to be written, where a page has one
    assert tab.complaints == []
    assert {address.split(":")[0] for address in tab.requests} <= {"file", "about", "data", "blob"}
