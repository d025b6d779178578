"""The pages in docs/ are right: their code runs, their files load, and what they print is printed."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import pytest
from helpers import ROOT
from pages import DOCS, Block, Run, blocks_of, read

from graspatlas import patches
from graspatlas.patches import patch_from_dict
from graspatlas.problems import load_problem

#: Pages that another test runs, and looks at what they leave.
ELSEWHERE = ("results.md",)
PAGES = [page.name for page in sorted(DOCS.glob("*.md")) if page.name not in ELSEWHERE]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_the_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # Pages show what is counted where there is time for it, also on a machine that is busy with other tests.
    monkeypatch.setattr("graspatlas.commands.diagnosis.ESTIMATE_SECONDS", 20.0)
    if page == "patches.md":
        pytest.importorskip("trimesh")
    run = Run(page)
    for block in blocks_of(page):
        try:
            run.run(block)
        except Exception as error:
            raise AssertionError(f"docs/{page}:{block.line}: {error}") from error


def test_pages_say_what_their_blocks_are() -> None:
    """And what is Python compiles: the pages themselves are run by the slow tests."""
    blocks = [(page, block) for page in PAGES for block in blocks_of(page)]
    assert len(blocks) > 50
    for page, block in blocks:
        if block.language == "python" and block.word != "not run":
            compile("\n" * block.line + block.text, str(DOCS / page), "exec")


def test_the_example_is_the_file_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who follows docs/from_urdf.md has examples/own_hand/jar.yaml in the end."""
    monkeypatch.chdir(tmp_path)
    run = Run("from_urdf.md")
    for block in blocks_of("from_urdf.md"):
        if block.language == "yaml":
            run.run(block)
    written, kept = (load_problem(path) for path in ("jar.yaml", ROOT / "examples/own_hand/jar.yaml"))
    assert {**written.to_dict(), "description": ""} == {**kept.to_dict(), "description": ""}


def test_every_patch_has_its_plain_data_and_its_row() -> None:
    text, kinds = read("patches.md"), set()
    for block in blocks_of("patches.md"):
        for table in json.loads(block.text) if block.language == "json" else ():
            patch = patch_from_dict(table)
            kinds.add(patch.kind)
            assert {name: patch.to_dict()[name] for name in table}.keys() == table.keys()
            assert f"`{type(patch).__name__}`" in text
    classes = [c for c in vars(patches).values() if isinstance(c, type) and issubclass(c, patches.Patch)]
    assert kinds == {c.kind for c in classes if c is not patches.Patch}


@pytest.mark.parametrize(
    ("said", "good"),
    [
        ("11 charts in 7.25 s", True),  # another machine's time
        ("12 charts in 7.25 s", True),
        ("20 charts in 0.02 s", False),
        ("11 maps in 0.02 s", False),
        ("one\n...\n11 charts in 0.02 s", True),
        ("11 charts in 0.02 s\n...\none", False),  # in another order
        ("one\n11 charts in 0.02 s", False),  # a line is missing
    ],
)
def test_what_counts_as_printed(said: str, good: bool) -> None:
    run = Run("patches.md")
    run.printed = "one\ntwo\n11 charts in 0.02 s\n"
    with contextlib.nullcontext() if good else pytest.raises(AssertionError, match="not printed"):
        run.run(Block("", "", "", said + "\n", 1))
