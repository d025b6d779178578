"""The schema, and the documentation of the format."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from helpers import ROOT, slow_but
from problem_texts import ALLEGRO, CAN, ROBOTS, read

import graspatlas as ga
from graspatlas.patches import patch_types
from graspatlas.problem_files import ProblemFileError, documents, json_schema, read_problem

PAGE = (ROOT / "docs" / "problem_files.md").read_text(encoding="utf-8")


def test_the_example_of_the_documentation_holds():
    text, obstacles, arm = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    problem = read_problem(text, "example.yaml")
    assert len(read_problem(text + obstacles, "example.yaml").obstacles) == 3
    assert read_problem(text + arm, "example.yaml").arm.flange == "tool0"
    result = ga.optimize(problem)
    assert result.is_global
    assert 100 < result.accepted.sum() < len(result.accepted)
    assert result.check().passed


def test_the_documentation_names_every_field():
    schema = json_schema()
    for table in ("problem", "HandTable", "ObjectTable", "ArmTable", "ContactTable", "MotionsTable", "FirstGraspTable"):
        for field in (schema if table == "problem" else schema["$defs"][table])["properties"]:
            assert field.endswith("_text") or re.search(rf"\b{field}\b", PAGE), f"{table}.{field}"


def test_every_patch_and_requirement_is_in_the_schema():
    schema = json_schema()
    text = json.dumps(schema)
    for cls in patch_types():
        table = schema["$defs"][f"{cls.__name__}Table"]
        assert table["properties"]["type"]["const"] == cls.kind
        assert table["additionalProperties"] is False
        assert table["description"]
    for name in (*ga.quality.INDICES, *(r for r in ga.requirements.REQUIREMENTS)):
        assert f'"{name}"' in text


ODD = [None, True, 0, -1, 3.5, 1e30, np.nan, -np.inf, "", "x", [], [1], ["x"], [[]], {}, {"x": 1}, {"type": "point"}]


@pytest.mark.parametrize("text", slow_but([CAN, ALLEGRO], ALLEGRO), ids=["can", "allegro"])
def test_odd_values_anywhere_are_refused_in_one_line(text):
    """Any field replaced by anything, or dropped: a problem, or one line that names the file."""
    rng = np.random.default_rng(5)
    document = documents.parse(text)
    paths = [path for path in document.lines if path]
    refused = []
    for _ in range(150):
        data = json.loads(json.dumps(document.data))
        *path, last = paths[rng.integers(len(paths))]
        place = data
        for key in path:
            place = place[key]
        if rng.uniform() < 0.1:
            del place[last]
        else:
            place[last] = ODD[rng.integers(len(ODD))]
        try:
            read_problem(json.dumps(data), "odd.json", ROBOTS)
        except ProblemFileError as error:
            refused.append(str(error))
    assert len(refused) > 100
    assert [message for message in refused if not re.fullmatch(r"odd\.json:\d+: .+", message)] == []


def test_the_schema_takes_a_requirement_by_its_name_alone():
    choices = json_schema()["properties"]["requirements"]["items"]["anyOf"]
    assert {"enum": list(ga.requirements.REQUIREMENTS), "type": "string"} in choices
    assert {"$ref": "#/$defs/RequirementTable"} in choices
    assert str(
        read(CAN.replace("contacts:", "requirements: [collision_free, joint_margin:]\ncontacts:")).requirements[1]
    ) == ("joint_margin:0.05")


def fields_without_description(schema: dict[str, Any]) -> list[str]:
    tables = {"problem": schema, **schema["$defs"]}
    return [
        f"{name}.{field}"
        for name, table in tables.items()
        for field, entry in table.get("properties", {}).items()
        if field not in ("type",) and not entry.get("description") and "$ref" not in entry
    ]


def test_every_field_is_described():
    assert fields_without_description(json_schema()) == []
