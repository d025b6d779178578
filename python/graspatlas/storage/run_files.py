"""Files that keep what a long run has done: arrays, with the digest of the run that they belong to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.storage.archives import DamagedArchive, read_arrays
from graspatlas.storage.files import opened, replaced
from graspatlas.support.arrays import AnyArray

__all__ = ["damaged", "read_run_file", "write_run_file"]


def write_run_file(path: Path, digest: str, arrays: dict[str, Any]) -> None:
    """Write a file beside its place and rename it, so that one that is there is whole; its folder is made.

    Args:
        path: The file.
        digest: Of the run.
        arrays: What it holds.

    Raises:
        GraspAtlasError: If it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GraspAtlasError(f"cannot make folder '{path.parent}': {error.strerror or error}") from None
    with replaced(path) as stream:
        np.savez(stream, digest=digest, **arrays)


def read_run_file(path: Path, digest: str) -> dict[str, AnyArray]:
    """The arrays of a file that :func:`write_run_file` wrote.

    Args:
        path: The file.
        digest: Of the run that wants to go on.

    Raises:
        GraspAtlasError: If it cannot be read, is damaged, or belongs to another run.
    """
    try:
        with opened(path, "checkpoint") as stream:
            arrays = read_arrays(stream)
        written_by = str(arrays.pop("digest"))
    except OSError as error:
        raise GraspAtlasError(f"cannot read checkpoint '{path}': {error.strerror or error}") from None
    except (DamagedArchive, KeyError) as error:
        raise damaged(path, error) from None
    if written_by != digest:
        raise GraspAtlasError(
            f"'{path.parent}' holds the checkpoint of another problem, of other options or of another version: finish "
            "that run, delete the folder, or choose another one"
        )
    return arrays


def damaged(path: Path, reason: object = "") -> GraspAtlasError:
    """What to say of a file whose arrays make no sense."""
    why = f" ({reason})" if str(reason) else ""
    return GraspAtlasError(f"'{path}' is damaged or no checkpoint{why}; delete '{path.parent}' to start over")
