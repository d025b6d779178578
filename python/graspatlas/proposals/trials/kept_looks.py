"""Looks at assignments that are kept in files, so that a search that was broken off does none twice."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from graspatlas.hand.body import Body
from graspatlas.hand.mesh_files import meshes_digest
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.proposals.assignments.matching import Assignment
from graspatlas.proposals.plan import Plan
from graspatlas.proposals.trials.trial import Look, LookEnd
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import requirement_name
from graspatlas.storage.run_files import damaged, read_run_file, write_run_file

__all__ = ["KeptLooks"]

#: Changes when a look of an older version would not be the same.
VERSION = 2
_KINDS = {"end": "U", "why": "U", "lack": "U", "value": "f", "x": "f", "postures": "f"}


class KeptLooks:
    """A folder with a file for each look.

    Where the index or a requirement is a function of the user's, nothing is kept: another function of the same name
    could not be told from it.

    Args:
        folder: The folder.
        plan: What the looks belong to.
        assignments: The assignments, in their order.
    """

    def __init__(self, folder: Path, plan: Plan, assignments: Sequence[Assignment]) -> None:
        self.folder = folder
        stated = [
            VERSION,
            dict(plan.source),
            plan.surface,
            quality_name(plan.quality),
            [requirement_name(requirement) for requirement in plan.requirements],
            plan.length_scale,
            plan.seed,
            [obstacle.to_dict() for obstacle in plan.obstacles],
            meshes_digest(_bodies(plan, assignments)),
            [(each.name, each.score, each.fingers.hand.urdf) for each in assignments],
        ]
        stated_all = all(isinstance(requirement, StatedRequirement) for requirement in plan.requirements)
        self._keeps = isinstance(plan.quality, str) and stated_all
        self._digest = hashlib.sha256(json.dumps(stated, sort_keys=True, default=str).encode()).hexdigest()

    def look(self, number: int) -> Look | None:
        """The look at an assignment; None where it is still to be done.

        Raises:
            GraspAtlasError: If its file is damaged, or belongs to another hand, mesh or other arguments.
        """
        path = self._path(number)
        if not self._keeps or not path.exists():
            return None
        part = read_run_file(path, self._digest)
        if set(part) != set(_KINDS) or any(array.dtype.kind != _KINDS[name] for name, array in part.items()):
            raise damaged(path)
        words = {name: str(part[name]) for name in ("why", "lack")}
        return Look(LookEnd(str(part["end"])), float(part["value"]), part["x"], part["postures"], **words)

    def keep(self, number: int, look: Look) -> Look:
        """Keep a look, and hand it back.

        Raises:
            GraspAtlasError: If its file cannot be written.
        """
        if not self._keeps:
            return look
        words = {"end": str(look.end), "why": look.why, "lack": look.lack}
        values = {**words, "value": look.value, "x": look.x, "postures": look.postures}
        write_run_file(self._path(number), self._digest, values)
        return look

    def _path(self, number: int) -> Path:
        return self.folder / f"{number:05}.npz"


def _bodies(plan: Plan, assignments: Sequence[Assignment]) -> list[Body]:
    """What may touch: the hand, which is the same in all assignments, and obstacles that are no planes."""
    hands = [each.fingers.hand for each in assignments[:1]]
    return [*hands, *(obstacle.body for obstacle in plan.obstacles if obstacle.body is not None)]
