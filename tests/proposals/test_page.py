"""The page of proposals: pictures that open what they show, and names that are names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from browsing import LOADED, Tab, browser

import graspatlas as ga
from graspatlas.proposals.page import write_page

HOSTILE = "<script>document.title='x'</script>&\"'"


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


@pytest.mark.parametrize(("width", "dark"), [(1400, False), (390, True)])
def test_all_pictures_are_there_and_fit(tab: Tab, proposed: ga.Proposals, output: Path, width: int, dark: bool) -> None:
    tab.open((output / "proposals.html").as_uri(), width, 900, dark=dark, ready=LOADED)
    assert tab.run("document.images.length") == len(proposed.proposals) + 1, "each grasp, and the regions"
    assert tab.run("[...document.images].every(image => image.naturalWidth > 300)")
    assert tab.run("document.documentElement.scrollWidth") <= width
    assert tab.run("document.querySelectorAll('tbody tr').length") == len(proposed.tried)
    assert tab.complaints == []
    assert all(address.startswith(("file:", "about:", "data:")) for address in tab.requests)


def test_a_picture_opens_its_grasps(tab: Tab, proposed: ga.Proposals, output: Path) -> None:
    tab.open((output / "proposals.html").as_uri(), ready=LOADED)
    links = tab.run("[...document.links].map(link => link.href)")
    assert len(links) == 3 * len(proposed.proposals)
    tab.open(links[0])
    assert tab.complaints == []
    assert tab.run("document.title").endswith("can by allegro_right_hand")


def test_markup_in_names_is_text(tab: Tab, proposed: ga.Proposals, output: Path) -> None:
    tried = tuple(replace(each, links=(HOSTILE,) * 3, why=HOSTILE, lack=HOSTILE) for each in proposed.tried)
    proposals = tuple(replace(each, tried=tried[0]) for each in proposed.proposals)
    hostile = replace(proposed, proposals=proposals, tried=tried, notes=(HOSTILE,))
    write_page(hostile, HOSTILE, output / "hostile.html")
    tab.open((output / "hostile.html").as_uri(), ready=LOADED)
    assert tab.run("document.title") == HOSTILE
    assert tab.run("document.scripts.length") == 0
    assert tab.run("document.querySelector('tbody td').textContent").count(HOSTILE) == 3


def test_proposals_have_a_card_in_notebooks(proposed: ga.Proposals) -> None:
    html = proposed._repr_html_()
    assert html.count("<img") == 1
    assert all(each.tried.name in html for each in proposed.proposals)
    assert "why others were refused" in html
