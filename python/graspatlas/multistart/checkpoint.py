"""Rounds of a search in files, one each, from which it goes on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from graspatlas.hand.mesh_files import meshes_digest
from graspatlas.multistart.rounds import Plan, Round, RoundKind
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import RequirementLike, requirement_name
from graspatlas.storage.files import stated_path
from graspatlas.storage.run_files import damaged, read_run_file, write_run_file

__all__ = ["RoundFolder"]

#: Changes when a round of an older version would not be the same.
VERSION = 1
#: Arrays of a round with a row or number for each climb, and the kinds of all that a file holds.
_ARRAYS = ("x", "value", "kkt", "missed", "met", "converged", "stalled")
_KINDS = {
    **dict.fromkeys(("x", "value", "kkt", "missed", "seconds"), "f"),
    **dict.fromkeys(("met", "converged", "stalled"), "b"),
    **dict.fromkeys(("number", "tries"), "i"),
    "kind": "U",
}


class RoundFolder:
    """A folder of numbered files, one for each round that has ended; each is written beside its place and renamed.

    Args:
        folder: The folder; made when the first file is written.
        plan: The search.
    """

    def __init__(self, folder: str | os.PathLike[str], plan: Plan) -> None:
        self.folder = stated_path(folder, "keep a checkpoint at")
        stated = {field.name: getattr(plan, field.name) for field in fields(plan) if field.name != "threads"}
        stated["problem"] = plan.problem.to_dict()
        stated["meshes"] = meshes_digest(plan.problem.bodies)
        stated["quality"] = quality_name(plan.quality)
        stated["requirements"] = [_stated(requirement) for requirement in plan.requirements]
        # Functions that share a name differ in what they say of a grasp.
        x1 = plan.problem.x1_array[None]
        said = [float(plan.objective.values(x1)[0]), bool(plan.objective.meets(x1)[0])]
        self.digest = hashlib.sha256(json.dumps([VERSION, stated, said], sort_keys=True).encode()).hexdigest()

    def load(self) -> Iterator[Round]:
        """The rounds that are kept, in their order, up to the first that is missing.

        Raises:
            GraspAtlasError: If a file is damaged, or of another search.
        """
        number = 0
        while self._path(number).exists():
            yield self._read(number)
            number += 1

    def write(self, new: Round) -> None:
        """Keep a round.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        values = {field.name: getattr(new, field.name) for field in fields(new)}
        write_run_file(self._path(new.number), self.digest, {**values, "kind": str(new.kind)})

    @staticmethod
    def remove(folder: Path) -> None:
        """Remove the rounds of a search, and the folder if nothing else is in it."""
        for path in folder.glob("round[0-9]*.npz"):
            path.unlink()
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()

    def _path(self, number: int) -> Path:
        return self.folder / f"round{number:06}.npz"

    def _read(self, number: int) -> Round:
        path = self._path(number)
        part = read_run_file(path, self.digest)
        n = len(part.get("x", ()))
        whole = all(name in part and part[name].dtype.kind == kind for name, kind in _KINDS.items())
        if not whole or str(part["kind"]) not in list(RoundKind) or any(len(part[name]) != n for name in _ARRAYS):
            raise damaged(path)
        return Round(
            number=number,
            kind=RoundKind(str(part["kind"])),
            tries=int(part["tries"]),
            seconds=float(part["seconds"]),
            **{name: part[name] for name in _ARRAYS},
        )


def _stated(requirement: RequirementLike) -> object:
    """A requirement as plain data; of a function its name."""
    return requirement.to_dict() if isinstance(requirement, StatedRequirement) else requirement_name(requirement)
