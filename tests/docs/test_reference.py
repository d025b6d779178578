"""The reference has an entry for every public name, and the site has every page."""

from __future__ import annotations

import re
from importlib import import_module

import pytest
from helpers import ROOT

import graspatlas as ga

DOCS = ROOT / "docs"
ENTRY = re.compile(r"^\.\. auto(?:class|data|function|exception):: (\S+)", re.MULTILINE)
MODULE = re.compile(r"^\.\. automodule:: (\S+)", re.MULTILINE)
#: Packages whose names are public beside those of graspatlas itself.
PACKAGES = [
    *("atlas", "collision", "execution", "formats", "hand", "hand.motions", "patches", "problem_files", "problems"),
    *("proposals", "quality", "regions", "reproduce", "requirements", "search", "simulation", "sweep", "systems"),
    *("testing", "viewer", "viewer.figures"),
]


def entries() -> list[str]:
    """Full names of what the reference describes."""
    texts = [page.read_text(encoding="utf-8") for page in sorted((DOCS / "reference").glob("*.rst"))]
    return [name for text in texts for name in (*ENTRY.findall(text), *MODULE.findall(text))]


def thing(name: str) -> object:
    """What a full name stands for: a module, or what a module holds."""
    module, _, last = name.rpartition(".")
    try:
        return getattr(import_module(module), last)
    except AttributeError:
        return import_module(name)


ENTRIES = entries()


def test_entries_exist_and_stand_once() -> None:
    assert [name for name in ENTRIES if thing(name) is None] == []
    assert sorted(set(ENTRIES)) == sorted(ENTRIES)


@pytest.mark.parametrize("package", ["", *PACKAGES])
def test_every_public_name_has_an_entry(package: str) -> None:
    module = import_module(f"graspatlas.{package}".rstrip("."))
    described = {id(thing(name)) for name in ENTRIES} | {
        id(getattr(ga, name)) for name in ga.__all__ if f"graspatlas.{name}" in ENTRIES
    }
    missing = [name for name in module.__all__ if id(getattr(module, name)) not in described]
    assert missing == [], "give each an entry in docs/reference"


def test_every_page_is_in_the_contents() -> None:
    """The contents of the site name each page of docs/ once."""
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    named = [line for block in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL) for line in block.split("\n")]
    pages = {page.stem for page in DOCS.glob("*.md")} - {"index"} | {"reference/index"}
    assert sorted(line for line in named if line and not line.startswith(":")) == sorted(pages)
