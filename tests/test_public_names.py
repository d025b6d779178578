"""What users call keeps its name: public names, members of classes and keywords of functions, as first listed.

``data/public_names.json`` lists them. A name may be added at any time; one that goes must be deprecated first.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_origin

import pytest
from typing_extensions import Unpack, get_type_hints

import graspatlas as ga

LISTED = json.loads((Path(__file__).parent / "data" / "public_names.json").read_text(encoding="utf-8"))
#: Keywords that a decorator takes by their old names.
RENAMED = {"Result.save_grasps": {"feasible"}, "shortest_path": {"feasible"}}


def keywords(function: Callable[..., Any]) -> set[str]:
    """Names of the parameters, those of a ``**options: Unpack[Options]`` included."""
    names = set()
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is not inspect.Parameter.VAR_KEYWORD:
            names.add(name)
            continue
        hint = get_type_hints(inspect.unwrap(function), include_extras=True)[name]
        assert get_origin(hint) is Unpack
        names |= set(get_type_hints(get_args(hint)[0]))
    return names


@pytest.mark.parametrize("module", LISTED["names"])
def test_modules_keep_their_names(module: str) -> None:
    offered = import_module(module)
    assert [name for name in LISTED["names"][module] if not hasattr(offered, name)] == []


@pytest.mark.parametrize("name", LISTED["members"])
def test_classes_keep_their_members(name: str) -> None:
    cls = getattr(ga, name)
    kept = {*dir(cls), *getattr(cls, "__dataclass_fields__", {})}
    assert [member for member in LISTED["members"][name] if member not in kept] == []


@pytest.mark.parametrize("name", LISTED["parameters"])
def test_functions_keep_their_keywords(name: str) -> None:
    thing: Any = ga
    for part in name.split("."):
        thing = getattr(thing, part)
    kept = keywords(thing) | RENAMED.get(name, set())
    assert [keyword for keyword in LISTED["parameters"][name] if keyword not in kept] == []


@pytest.mark.parametrize("function", [ga.build_atlas, ga.optimize, ga.find_components], ids=lambda f: f.__name__)
def test_an_unknown_keyword_is_named(function: Callable[..., Any]) -> None:
    sphere: dict[str, Any] = {"system": ga.systems.Sphere(3), "x0": [0, 0, 1], "radius": 0.2, "epsilon": 0.2}
    given = sphere if function is ga.build_atlas else {"problem": ga.load_problem("planar_hand")}
    said = rf"{function.__name__}\(\) got an unexpected keyword argument 'max_chart'. Did you mean 'max_charts'"
    with pytest.raises(TypeError, match=said):
        function(**given, max_chart=3)
