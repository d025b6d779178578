"""Rounds of a search in files, one each, from which it goes on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.multistart.rounds import Plan, Round, RoundKind
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import requirement_name
from graspatlas.support.archives import DamagedArchive, read_arrays
from graspatlas.support.files import opened, replaced, stated_path

__all__ = ["RoundFolder"]

#: Changes when a round of an older version would not be the same.
VERSION = 1
_ARRAYS = {"x": "f", "value": "f", "kkt": "f", "met": "b", "converged": "b", "missed": "f"}


class RoundFolder:
    """A folder of numbered files, one for each round that has ended; each is written beside its place and renamed.

    Args:
        folder: The folder; made when the first file is written.
        plan: The search.
    """

    def __init__(self, folder: str | os.PathLike[str], plan: Plan) -> None:
        self.folder = stated_path(folder, "keep a checkpoint at")
        stated = [
            VERSION,
            plan.problem.to_dict(),
            quality_name(plan.quality),
            [requirement_name(requirement) for requirement in plan.requirements],
            plan.dimension,
            plan.radius,
            plan.epsilon,
            plan.seed,
            plan.max_steps,
        ]
        self.digest = hashlib.sha256(json.dumps(stated, sort_keys=True, default=str).encode()).hexdigest()

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
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise GraspAtlasError(f"cannot make folder '{self.folder}': {error.strerror or error}") from None
        values = {field.name: getattr(new, field.name) for field in fields(new)}
        with replaced(self._path(new.number)) as stream:
            np.savez(stream, digest=self.digest, **{**values, "kind": str(new.kind)})

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
        try:
            with opened(path, "checkpoint") as stream:
                part = read_arrays(stream)
            digest = str(part.pop("digest"))
            if digest != self.digest:
                raise GraspAtlasError(
                    f"'{self.folder}' holds the checkpoint of another problem, of other options or of another version: "
                    "finish that search, delete the folder, or choose another one"
                )
            n = len(part["x"])
            if any(part[name].dtype.kind != kind or len(part[name]) != n for name, kind in _ARRAYS.items()):
                raise DamagedArchive("its arrays do not fit together")
            return Round(
                number=number,
                kind=RoundKind(str(part["kind"])),
                tries=int(part["tries"]),
                drawn=int(part["drawn"]),
                seconds=float(part["seconds"]),
                **{name: part[name] for name in _ARRAYS},
            )
        except OSError as error:
            raise GraspAtlasError(f"cannot read checkpoint '{path}': {error.strerror or error}") from None
        except (DamagedArchive, KeyError, ValueError, TypeError) as error:
            if isinstance(error, GraspAtlasError):
                raise
            raise GraspAtlasError(
                f"'{path}' is damaged or no checkpoint ({error}); delete '{self.folder}' to begin anew"
            ) from None
