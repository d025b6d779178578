"""What a program waits for before it works: modules are imported when they are needed, which is counted here."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import graspatlas as ga
from graspatlas import cli

#: Packages that take long to import, and that none of the common commands needs.
SLOW = {"scipy", "matplotlib", "pinocchio", "coal", "meshcat", "tqdm", "trimesh", "mujoco", "pandas", "PIL"}
CAN = "optimize schunk_can --max-charts 50 --require force_closure:0.5:0.02 --require collision_free"


def modules_after(code: str) -> set[str]:
    """Names of the modules that a new process holds after some code."""
    code = f"import sys\n{code}\nprint('\\n' + ' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split())


def command(words: str) -> str:
    return f"from graspatlas.cli import main\nmain({words.split()})"


def packages(modules: set[str]) -> set[str]:
    return {name.partition(".")[0] for name in modules}


def test_importing_the_package_imports_little_but_the_core() -> None:
    loaded = modules_after("import graspatlas")
    assert not packages(loaded) & (SLOW | {"numpy", "pydantic", "yaml"})
    assert {name for name in loaded if name.startswith("graspatlas.")} <= {
        "graspatlas._core",
        "graspatlas.libraries",
        "graspatlas.start_up",
        "graspatlas.version",
    }


@pytest.mark.parametrize(("words", "also"), [("list", {"pydantic"}), (CAN, set())], ids=["list", "optimize"])
def test_common_commands_import_nothing_slow(words: str, also: set[str]) -> None:
    assert not packages(modules_after(command(words))) & (SLOW | also)


def test_pictures_and_pages_import_nothing_that_they_do_not_need(can_result: ga.Result, tmp_path: Path) -> None:
    can_result.save(tmp_path / "result.npz")
    words = f"view {tmp_path} --picture {tmp_path / 'can.png'} --html {tmp_path / 'can.html'}"
    assert not packages(modules_after(command(words))) & (SLOW - {"PIL"})


def test_names_are_declared_as_they_are_imported() -> None:
    """Type checkers read the imports; a program follows the table."""
    tree = ast.parse(Path(ga.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    declared = {
        alias.name: str(node.module).removeprefix("graspatlas").removeprefix(".")
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(declared) == ga.__all__
    modules = {"patches", "quality", "systems"}
    assert {name: home for name, home in declared.items() if name not in modules} == ga._MODULE_OF
    for name in ga.__all__:
        place = f"graspatlas.{declared[name]}".rstrip(".")
        assert getattr(ga, name) is getattr(importlib.import_module(place), name)


def test_all_names_are_listed_before_they_are_imported() -> None:
    assert set(ga.__all__) <= set(dir(ga))
    code = "import graspatlas; assert set(graspatlas.__all__) <= set(dir(graspatlas))"
    assert "numpy" not in modules_after(code)


def test_modules_of_the_package_are_at_hand() -> None:
    code = "import graspatlas as ga; ga.viewer.save_picture; ga.requirements.CollisionFree; ga.motions.HandMotions"
    assert "graspatlas.viewer" in modules_after(code)
    with pytest.raises(AttributeError, match="module 'graspatlas' has no attribute 'nothing'"):
        _ = ga.nothing


def test_problems_know_the_requirements_that_they_state() -> None:
    table = ga.load_problem("schunk_can").to_dict()
    modules_after(f"import graspatlas as ga; p = ga.Problem.from_dict({table!r}); assert len(p.requirements) == 2")


def test_the_command_line_finds_every_command_in_its_module() -> None:
    for module, names in cli.COMMANDS.items():
        parser = cli.parser_for([names[0]])
        (commands,) = (action for action in parser._actions if action.choices)
        assert tuple(commands.choices) == names, module
