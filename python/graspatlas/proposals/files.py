"""What is written of a proposal: a problem file that can be edited, its result, and what is needed to read them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from graspatlas.problem.problem import Problem
from graspatlas.problem_files.first_grasp_in_file import with_x1
from graspatlas.proposals.plan import Plan
from graspatlas.storage.files import replaced

__all__ = ["folder_name", "problem_file", "write_text"]

_HEAD = """\
# {name}
# Proposed for this hand and this mesh. Solve it again, finer or with other requirements:
#   graspatlas optimize problem.yaml --radius 0.1 --refine feasible --output out
"""


def folder_name(number: int, name: str) -> str:
    """Name of the folder of an assignment, the same in every search: its number, and what touches what."""
    words = re.sub(r"[^A-Za-z0-9-]+", "_", name.replace(" on ", "-")).strip("_")
    return f"{number:05}_{words}"[:80]


def problem_file(plan: Plan, problem: Problem, locked: Mapping[str, float], folder: str) -> str:
    """The problem as YAML.

    Args:
        plan: The plan.
        problem: The problem, with its first grasp.
        locked: Positions of the joints that are locked [rad or m].
        folder: Where hand and object are, as seen from the file.
    """
    hand: dict[str, Any] = dict(plan.source)
    if problem.hand.srdf and "mjcf" not in hand:
        hand["srdf"] = f"{folder}/hand.srdf"
    if locked:
        hand["locked"] = {name: round(float(value), 9) for name, value in locked.items()}
    table: dict[str, Any] = {
        "name": problem.name,
        "hand": hand,
        "object": {"name": problem.object.name, "urdf": f"{folder}/object.urdf"},
        "contacts": [contact.to_dict() for contact in problem.contacts],
        "length_scale": problem.length_scale,
        "defaults": dict(problem.defaults),
        "requirements": [requirement.to_dict() for requirement in problem.requirements],
    }
    if problem.motions is not None:
        motions = problem.motions
        table["hand_motions"] = {
            "joints": list(motions.joints),
            "mean": np.asarray(motions.mean).tolist(),
            "covariance": np.asarray(motions.covariance).tolist(),
        }
    lines = [_HEAD.format(name=" ".join(problem.name.split()))]
    for key, value in table.items():
        lines.append(f"{key}:{_value(value)}")
    text = "\n".join(lines) + "\n"
    return text if problem.x1 is None else with_x1(text, problem.x1)


def _value(value: object, indent: int = 2) -> str:
    """What follows a key in YAML: tables and lists of tables line by line, all else in JSON, which YAML holds."""
    space = " " * indent
    if isinstance(value, dict) and value:
        return "\n" + "\n".join(f"{space}{json.dumps(str(k))}:{_value(v, indent + 2)}" for k, v in value.items())
    if isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
        return "\n" + "\n".join(f"{space}- {json.dumps(_plain(each))}" for each in value)
    return " " + json.dumps(_plain(value))


def _plain(value: object) -> Any:
    """Data without tuples and NumPy's numbers."""
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def write_text(text: str, path: Path) -> None:
    """Write a text, whole or not at all."""
    with replaced(path) as stream:
        stream.write(text.encode("utf-8"))
