"""The house: imports point downwards, from one floor to the floors below it, and no two files import each other."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import graspatlas

PACKAGE = Path(graspatlas.__file__).parent
NAME = "graspatlas"

#: The floors from the lowest to the highest: packages, and files that lie beside them. Each may import those below it.
FLOORS = (
    *("_core", "version", "errors", "start_up", "libraries", "doctor"),
    *(
        "support",
        "storage",
        "numerics",
        "cluster",
        "systems",
        "meshes",
        "patches",
        "regions",
        "hand",
        "world",
        "problem",
        "collision",
        "pads",
        "execution",
        "reach",
    ),
    *("atlas", "grasps", "search", "quality", "requirements"),
    *(
        "testing",
        "result",
        "problem_files",
        "problems",
        "analysis",
        "paths",
        "multistart",
        "optimizer",
        "simulation",
        "formats",
    ),
    *(
        "viewer.scene",
        "viewer.films",
        "viewer.render",
        "viewer.web",
        "viewer.explorer",
        "viewer.live",
        "viewer.figures",
        "viewer.notebook",
        "viewer",
    ),
    *("reproduce", "sweep", "proposals", "commands", "cli", "__main__"),
)
#: Packages whose ``__init__`` is no face but defines what it offers.
DEFINING = {f"{NAME}.{name}" for name in ("problems", "problem_files", "viewer", "viewer.figures", "reproduce")}
#: Files of a folder, at most, its ``__init__`` not counted.
MOST_FILES = 12


def modules() -> dict[str, Path]:
    """All files of the package by the dotted names of their modules; robots, which are installed in it, are data."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        if parts[0] == "robots":
            continue
        found[".".join((NAME, *(part for part in parts if part != "__init__")))] = path
    return found


MODULES = modules()


def imported(path: Path) -> Iterator[str]:
    """The modules of the package that a file imports: at its top, in functions, and for its types alone."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == NAME)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == NAME:
            for alias in node.names:
                below = f"{node.module}.{alias.name}"
                yield below if below in MODULES or below == f"{NAME}._core" else str(node.module)


def floor(module: str) -> int:
    """The number of a module's floor."""
    place = module.removeprefix(f"{NAME}.")
    parts = place.split(".")
    for name in (".".join(parts[:2]), parts[0]):
        if name in FLOORS:
            return FLOORS.index(name)
    raise AssertionError(f"{module} lies on no floor: move it into a package, or name its floor here")


IMPORTS = {module: sorted(set(imported(path))) for module, path in MODULES.items()}


def test_imports_are_seen() -> None:
    assert f"{NAME}.systems.system" in IMPORTS[f"{NAME}.atlas.atlas"]
    assert len(MODULES) > 100


@pytest.mark.parametrize("module", [m for m in MODULES if m != NAME])
def test_imports_point_downwards(module: str) -> None:
    upwards = [other for other in IMPORTS[module] if other == NAME or floor(other) > floor(module)]
    assert not upwards, f"{module} imports from a floor above its own"


def test_no_files_import_each_other() -> None:
    graph = {module: [other for other in others if other != NAME] for module, others in IMPORTS.items()}
    try:
        list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"files import each other in a circle: {' <- '.join(error.args[1])}")


def test_every_floor_exists() -> None:
    places = {module.removeprefix(f"{NAME}.") for module in MODULES} | {"_core"}
    assert [name for name in FLOORS if name not in places] == []


@pytest.mark.parametrize("folder", [path.parent for path in MODULES.values() if path.name == "__init__.py"], ids=str)
def test_folders_are_small(folder: Path) -> None:
    files = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
    assert len(files) <= MOST_FILES, f"{folder} holds {len(files)} files: part it"


@pytest.mark.parametrize("module", [m for m, path in MODULES.items() if path.name != "__init__.py"])
def test_files_import_from_where_a_name_is_defined(module: str) -> None:
    """Inside the package the faces of packages, their ``__init__``, are for users alone."""
    faces = {m for m, path in MODULES.items() if path.name == "__init__.py"}
    assert [other for other in IMPORTS[module] if other in faces - DEFINING] == []


def test_a_picture_of_the_house_is_in_the_guide() -> None:
    """CONTRIBUTING has one row for each package."""
    guide = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    packages = {name.split(".")[0] for name in FLOORS if (PACKAGE / name.split(".")[0]).is_dir()}
    assert [name for name in sorted(packages) if f"| `{name}/`" not in guide] == []
