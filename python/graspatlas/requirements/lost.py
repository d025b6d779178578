"""A requirement that was a function of the user's: a file keeps its name alone, so that it cannot be asked again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.requirements.base import Requirement, RequirementLike

__all__ = ["Lost", "kept"]


@dataclass(frozen=True)
class Lost(Requirement):
    """Stands for a function that a result file did not keep.

    Attributes:
        label: Its name.
    """

    label: str = ""

    def met(self, grasps: Grasps) -> NoReturn:
        """Raise what says that it cannot be asked.

        Raises:
            GraspAtlasError: Always.
        """
        raise GraspAtlasError(
            f"requirement '{self.label}' is a function, which files do not keep: compute the result again in this "
            "program, or do not ask for accepted grasps"
        )

    def slacks_near(self, grasp: Grasps) -> NoReturn:
        """Raise what says that it cannot be asked; see :meth:`met`."""
        self.met(grasp)

    def __str__(self) -> str:
        return self.label


def kept(requirements: tuple[RequirementLike, ...]) -> tuple[RequirementLike, ...]:
    """The requirements that can be asked: all but those that a file did not keep."""
    return tuple(r for r in requirements if not isinstance(r, Lost))
