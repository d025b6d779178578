"""The code and the problem files in docs/patches.md are right, and the page names every patch."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from graspatlas import patches

PAGE = Path(__file__).parents[1] / "docs" / "patches.md"
TEXT = PAGE.read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def test_the_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("trimesh")
    assert len(blocks("python")) >= 6
    exec(compile("\n".join(blocks("python")), str(PAGE), "exec"), {})
    assert "mm at most" in capsys.readouterr().out


def test_every_patch_has_its_plain_data_and_its_row() -> None:
    kinds = set()
    for block in blocks("json"):
        for table in json.loads(block):
            patch = patches.patch_from_dict(table)
            kinds.add(patch.kind)
            assert {name: patch.to_dict()[name] for name in table}.keys() == table.keys()
            assert f"`{type(patch).__name__}`" in TEXT
    classes = [c for c in vars(patches).values() if isinstance(c, type) and issubclass(c, patches.Patch)]
    assert kinds == {c.kind for c in classes if c is not patches.Patch}


def test_links_exist() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (PAGE.parent / target).exists(), target
