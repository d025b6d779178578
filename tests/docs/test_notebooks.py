"""The notebooks in examples/notebooks are made from the plain files beside them, run, and small."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers import ROOT

FOLDER = ROOT / "examples" / "notebooks"
SOURCES = sorted(path for path in FOLDER.glob("*.py") if path.stem != "make")
#: Largest notebook [bytes].
LARGEST = 1_000_000
#: Places of some machine; and pages, which are too large to be kept.
NOT_KEPT = re.compile(r"/(root|home|tmp|usr|Users|work|opt)/|[A-Z]:\\\\|<iframe|site-packages")


def cells(path: Path) -> list[dict[str, Any]]:
    return list(json.loads(path.read_text(encoding="utf-8"))["cells"])


def texts(value: Any) -> Iterator[str]:
    """All texts in plain data."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from texts(part)


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_has_the_cells_of_its_source(source: Path) -> None:
    parts = re.split(r"^# %%(?: \[markdown\])?\n", source.read_text(encoding="utf-8"), flags=re.MULTILINE)
    told = [part.strip() for part in parts[1:]]
    found = cells(source.with_suffix(".ipynb"))
    shown = [
        "".join(cell["source"])
        if cell["cell_type"] == "code"
        else re.sub(r"^(?=.)", "# ", "".join(cell["source"]), flags=re.MULTILINE).replace("\n\n", "\n#\n")
        for cell in found
    ]
    assert shown == told, "make it again: python examples/notebooks/make.py"


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_is_run_and_small(source: Path) -> None:
    path = source.with_suffix(".ipynb")
    assert path.stat().st_size < LARGEST
    code = [cell for cell in cells(path) if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in code for output in cell["outputs"]]
    assert sum("text/html" in output.get("data", {}) for output in outputs) >= 1
    assert {output["output_type"] for output in outputs} <= {"execute_result", "display_data", "stream"}
    assert [text for text in texts(outputs) if NOT_KEPT.search(text)] == []


def test_there_are_notebooks() -> None:
    assert {path.stem for path in SOURCES} == {path.stem for path in FOLDER.glob("*.ipynb")}
    assert len(SOURCES) >= 3
    manual = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    assert all(f"(../examples/notebooks/{path.stem}.ipynb)" in manual for path in SOURCES)


@pytest.mark.slow
@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_runs(source: Path, tmp_path: Path) -> None:
    words = [str(FOLDER / "make.py"), source.stem, "--output", str(tmp_path)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, timeout=180)
    assert done.returncode == 0, done.stderr
    made, kept = (cells(folder / f"{source.stem}.ipynb") for folder in (tmp_path, FOLDER))
    assert [cell["source"] for cell in made] == [cell["source"] for cell in kept]
    assert all(cell.get("outputs") or "=" in "".join(cell["source"]) for cell in made if cell["cell_type"] == "code")
