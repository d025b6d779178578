"""The live view."""

from __future__ import annotations

import pytest

import graspatlas as ga
from graspatlas.viewer import view
from graspatlas.viewer.web.browser import close


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
