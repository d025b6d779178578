"""docs/glossary.md explains every word that the package prints by itself, and claims to print no other."""

from __future__ import annotations

import csv
import importlib
import pkgutil
import re
from collections.abc import Iterable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT

import graspatlas
import graspatlas as ga
from graspatlas.atlas.status import Closed
from graspatlas.commands.diagnosis import NOTE, OK, PROBLEM
from graspatlas.formats.export import FORMATS
from graspatlas.problem_files import json_schema
from graspatlas.proposals.outcome import COLUMNS as PROPOSALS
from graspatlas.quality import INDICES
from graspatlas.reproduce.tables import COLUMNS as NUMBERS
from graspatlas.requirements import REQUIREMENTS
from graspatlas.simulation import PROTOCOLS
from graspatlas.simulation.outcome import Simulation, TrialRecord
from graspatlas.support.words import Word
from graspatlas.sweep.rows import COLUMNS as RUNS

PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
#: Names that end in a number, or have one, which counts contacts or coordinates.
COUNTED = re.compile(r"^(x|contact|pregrasp_distance|other_)\d+")


def explained() -> list[str]:
    """Terms of the page that are printed: code in the first cell of a row."""
    rows = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    return [term for row in rows for term in re.findall(r"`([^`]+)`", row)]


EXPLAINED = explained()


def missing(printed: Iterable[str]) -> list[str]:
    """Those that the page does not explain."""
    return sorted(set(printed) - set(EXPLAINED))


def words() -> set[str]:
    """The values of all enumerations of words in the package."""
    for module in pkgutil.walk_packages(graspatlas.__path__, "graspatlas."):
        if not module.name.endswith(("__main__", "_core")):
            importlib.import_module(module.name)
    kinds, left = set(), [Word]
    while left:
        kinds |= (found := set(left.pop().__subclasses__()))
        left += found
    assert len(kinds) > 6
    return {str(word) for kind in kinds for word in kind}


def names() -> set[str]:
    """Names of requirements, indices, protocols, formats, patches and reasons, and the marks of ``check``."""
    closed = {reason.name.lower() for reason in Closed if reason is not Closed.OPEN}
    stated = set(constants(json_schema()))
    assert {"planar", "cylinder"} <= stated
    return {*closed, *stated, *REQUIREMENTS, *INDICES, *PROTOCOLS, *FORMATS, OK, NOTE, PROBLEM}


def constants(schema: Any) -> Iterator[str]:
    """The words that a field of a schema may be."""
    if isinstance(schema, dict):
        yield from (word for word in (schema.get("const"), *schema.get("enum", ())) if isinstance(word, str))
    for part in schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ():
        yield from constants(part)


def columns(result: ga.Result, folder: Path) -> set[str]:
    """Columns of all tables and arrays of all files, numbers and joints left out."""
    path = ga.shortest_path(result, int(result.atlas.neighbour_pairs[0, 0]), int(result.atlas.neighbour_pairs[0, 1]))
    path.save_csv(folder / "path.csv", joint_speed=1.0)
    ga.Path(result.atlas, path.x, path.arc_length, path.residuals, path.tight).save_csv(folder / "points.csv")
    ga.ladder(result.problem, dimensions=[2], refine=True).save_csv(folder / "ladder.csv")
    result.save_grasps(folder / "grasps.csv", pregrasp=0.005, charts=[result.best.chart])
    result.save(folder / "result.npz")
    found = {*RUNS, *PROPOSALS, *NUMBERS, *TrialRecord.__annotations__, *(f.name for f in fields(Simulation))}
    for file in folder.glob("*.csv"):
        with file.open(encoding="utf-8") as stream:
            found |= set(next(csv.reader(stream)))
    with np.load(folder / "result.npz") as arrays:
        found |= set(arrays.files)
    atlas = result.atlas
    for frame in (result.to_pandas(volumes=True), atlas.to_pandas(volumes=True), atlas.neighbours_to_pandas()):
        found |= {frame.index.name or "chart", *frame.columns}
    found |= {name for problem in ga.bundled_problems() for name in ga.load_problem(problem).parameter_names}
    joint = re.compile("|".join(map(re.escape, result.problem.hand.joints)))
    return {COUNTED.sub(r"\1<i>", joint.sub("<joint>", name)) for name in found}


def test_every_word_is_explained() -> None:
    assert missing(words()) == []
    assert missing(names()) == []


def test_every_column_is_explained(refined: ga.Result, tmp_path: Path) -> None:
    assert missing(columns(refined, tmp_path)) == []


def test_what_is_explained_is_printed(refined: ga.Result, tmp_path: Path) -> None:
    printed = words() | names() | columns(refined, tmp_path)
    assert sorted(set(EXPLAINED) - printed) == [], "the code prints no such word"


@pytest.fixture(scope="module")
def refined() -> ga.Result:
    """Of a small problem, with another index."""
    quality = ["inverse_condition_number", "joint_centrality"]
    return ga.optimize(ga.load_problem("planar_hand"), refine=True, quality=quality)
