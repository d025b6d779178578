"""Make the notebooks from the plain files beside this one, and run them.

``# %%`` begins a cell of code, ``# %% [markdown]`` one of text. Outputs are kept, but for pages within a notebook:
these are large, and come back when their cell is run. It needs ``pip install 'graspatlas[test]'``.

Run it with ``python examples/notebooks/make.py`` for all notebooks, or with the names of some.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

HERE = Path(__file__).parent
CELL = re.compile(r"^# %%( \[markdown\])?\n", re.MULTILINE)
#: Longest output that is kept as HTML [characters].
LONGEST = 200_000
#: Longest time of a cell [s].
PATIENCE = 120


def sources() -> list[Path]:
    """The plain files."""
    return sorted(path for path in HERE.glob("*.py") if path.name != Path(__file__).name)


def notebook_of(source: Path) -> nbformat.NotebookNode:
    """The notebook of a plain file, without outputs."""
    _, *parts = CELL.split(source.read_text(encoding="utf-8"))
    cells = []
    for number, (kind, text) in enumerate(zip(parts[::2], parts[1::2], strict=True)):
        if kind:
            cells.append(new_markdown_cell(re.sub(r"^# ?", "", text.strip(), flags=re.MULTILINE)))
        else:
            cells.append(new_code_cell(text.strip()))
        cells[-1]["id"] = f"cell-{number}"  # the same each time
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return new_notebook(cells=cells, metadata={"kernelspec": kernel, "language_info": {"name": "python"}})


def run(notebook: nbformat.NotebookNode, folder: Path) -> None:
    """Run all cells in a folder, and keep their outputs.

    Raises:
        CellExecutionError: If a cell fails.
    """
    told = {key: dict(value) for key, value in notebook.metadata.items()}
    place = {"metadata": {"path": str(folder)}}
    NotebookClient(notebook, timeout=PATIENCE, record_timing=False, resources=place).execute()
    notebook.metadata.update(told)
    notebook.metadata["language_info"] = told["language_info"]
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if len(data.get("text/html", "")) > LONGEST:
                del data["text/html"]


def main() -> None:
    """Make notebooks."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("name", nargs="*", help="such as can_in_a_minute; all by default")
    parser.add_argument("--output", type=Path, default=HERE, metavar="FOLDER", help="where the notebooks go")
    options = parser.parse_args()
    for source in sources():
        if not options.name or source.stem in options.name:
            notebook = notebook_of(source)
            run(notebook, HERE)
            nbformat.validate(notebook)
            nbformat.write(notebook, options.output / f"{source.stem}.ipynb")
            print(f"{source.stem}.ipynb: {(options.output / f'{source.stem}.ipynb').stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
