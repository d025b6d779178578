"""Links and pictures of every page exist, anchors included."""

from __future__ import annotations

import re

import pytest
from helpers import ROOT
from pages import LINK

PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]


def slugs_of(text: str) -> list[str]:
    """The anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)", text, re.MULTILINE)
    return [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_exist(page) -> None:
    text = page.read_text(encoding="utf-8")
    for target, anchor in LINK.findall(text):
        if target.startswith("http"):
            continue
        path = page.parent / target
        assert path.exists(), target
        if anchor:
            assert anchor in slugs_of(path.read_text(encoding="utf-8")), f"{target}#{anchor}"
    for anchor in re.findall(r"\]\(#([^)]+)\)", text):
        assert anchor in slugs_of(text), f"#{anchor}"


def test_there_are_pages_with_links() -> None:
    assert {"README.md", "patches.md", "gallery.md"} <= {page.name for page in PAGES}
    assert sum(len(LINK.findall(page.read_text(encoding="utf-8"))) for page in PAGES) > 50
