"""Runs of a sweep: one problem with one choice of options each."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.mesh_files import meshes_digest
from graspatlas.problems import load_problem
from graspatlas.support.validation import PlainTable
from graspatlas.sweep.rows import COLUMNS, Row
from graspatlas.version import __version__

__all__ = ["Run", "runs_of"]


@dataclass(frozen=True)
class Run:
    """One problem with one choice of options.

    Attributes:
        file: Name or path of the problem, as the user gave it.
        problem: The problem as plain data; None when it could not be loaded.
        error: Why it could not be loaded; empty otherwise.
        dimension, radius, epsilon, quality, require, refine, max_charts, max_seconds: See :func:`graspatlas.optimize`.
        meshes: Digest of the mesh files that the problem names.
    """

    file: str
    problem: PlainTable | None
    error: str = ""
    dimension: int | None = None
    radius: float | None = None
    epsilon: float | None = None
    quality: str | None = None
    require: tuple[str, ...] = ()
    refine: bool = False
    max_charts: int | None = None
    max_seconds: float | None = None
    meshes: str = ""

    @property
    def key(self) -> str:
        """Digest of the problem and the options, by which a finished run is known again."""
        content = {**asdict(self), "file": self.file if self.problem is None else ""}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]

    def row(self, **values: object) -> Row:
        """A row of the table: what was asked for, and what is known."""
        asked = {name: getattr(self, name) for name in COLUMNS if name in self.__dataclass_fields__}
        name = self.problem["name"] if self.problem else ""
        known = {"run": self.key, "problem": name, "require": list(self.require), "version": __version__}
        return {**dict.fromkeys(COLUMNS), **asked, **known, **values}


def runs_of(file: str, fixed: Run, choices: Sequence[Sequence[int | float | str | None]]) -> Iterator[Run]:
    """The runs of one problem; a problem that cannot be loaded has one, which says so."""
    try:
        problem = load_problem(file)
        meshes = meshes_digest(problem.bodies)
    except GraspAtlasError as error:
        yield replace(fixed, file=file, error=str(error))
        return
    data = problem.to_dict()
    for choice in choices:
        names = ("dimension", "radius", "epsilon", "quality")
        options: dict[str, Any] = {
            name: problem.defaults.get(name) if value is None else value
            for name, value in zip(names, choice, strict=True)
        }
        yield replace(fixed, file=file, problem=data, meshes=meshes, **options)
