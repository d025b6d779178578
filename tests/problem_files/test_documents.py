"""YAML and JSON as documents: numbers, words, and the lines of fields."""

from __future__ import annotations

import json

import numpy as np
import pytest

from graspatlas.problem_files import documents

NUMBERS = {
    "1e-3": 1e-3, "-.5": -0.5, "1.": 1.0, "+2": 2, "0": 0, "017": 17, ".inf": np.inf, "-Infinity": -np.inf, "1E5": 1e5,
    "0x10": "0x10", "e5": "e5", "12:30": "12:30",
    "true": True, "null": None, "~": None, "": None, "yes": "yes", "y": "y", "1_000": "1_000",
    "'1'": "1", "2001-01-01": "2001-01-01",
}  # fmt: skip


@pytest.mark.parametrize("text", NUMBERS)
def test_numbers_and_words_of_yaml(text):
    value = documents.parse(f"a: {text}").data["a"]
    assert value == NUMBERS[text]
    assert type(value) is type(NUMBERS[text])


@pytest.mark.parametrize(
    "data", [float("nan"), -1e-300, 5e-324, "x\ny\t\"'", [], {}, None, True, [[1, 2.5]], "Ünïcode"]
)
def test_json_is_read_as_json(data):
    text = json.dumps({"a": data}, indent=1)
    assert json.dumps(documents.parse(text).data) == json.dumps({"a": data})


def test_lines_of_fields():
    document = documents.parse("a:\n  b: [1,\n    2]\nc:\n  - d: 3\n")
    assert [document.line(path) for path in [("a",), ("a", "b"), ("a", "b", 1), ("c", 0, "d"), ("c", 0, "x", 5)]] == [
        1, 2, 3, 5, 5,
    ]  # fmt: skip
