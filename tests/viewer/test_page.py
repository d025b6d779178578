"""Pages that open from disk, and the live view."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from screens import browse, pixels, share

import graspatlas as ga
from graspatlas.viewer import export_html, view
from graspatlas.viewer.web.browser import close

Array = NDArray[np.float64]


# The page of a result, and its live view


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
    assert len(text) < 6e6


def test_names_cannot_break_the_page(can_result: ga.Result, tmp_path: Path) -> None:
    named = replace(can_result, problem=replace(can_result.problem, name="<script>alert(1)</script> & $title"))
    export_html(named, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; $title" in text


def test_view_serves_the_page_and_ends(can_result: ga.Result, capsys: pytest.CaptureFixture[str]) -> None:
    visualizer = view(can_result, open_browser=False, wait=False)
    try:
        assert visualizer.url() in capsys.readouterr().err
        assert visualizer.static_html().count("fetch(") > 12
    finally:
        close(visualizer)
    assert not visualizer.window.server.running


def test_view_ends_cleanly_when_interrupted(can_result: ga.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("graspatlas.viewer.web.browser.time.sleep", interrupt)
    visualizer = view(can_result, open_browser=False)
    assert not visualizer.window.server.running


@pytest.mark.browser
def test_page_renders_in_a_browser(bottle_result: ga.Result, tmp_path: Path) -> None:
    export_html(bottle_result, tmp_path / "page.html")
    screenshot = tmp_path / "page.png"
    browse((tmp_path / "page.html").as_uri(), tmp_path, f"--screenshot={screenshot}")
    shown = pixels(screenshot)
    for half in (shown[:, :600], shown[:, 600:]):
        assert share(half, "yellow") > 0.02
        assert share(half, "grey") > 0.02
        assert share(half, "red") > 0.0001
