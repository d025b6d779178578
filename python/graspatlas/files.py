"""Files that are either written completely or not at all, tables in them, and folders for them."""

from __future__ import annotations

import csv
import io
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from graspatlas.errors import GraspAtlasError

__all__ = ["replaced", "writable_folder", "write_csv"]


@contextmanager
def replaced(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A temporary file beside a path, which takes its place when everything went well.

    Args:
        path: The path.

    Raises:
        GraspAtlasError: If it cannot be written.
    """
    target = Path(path)
    if target.is_dir():
        raise GraspAtlasError(f"cannot write '{target}': it is a folder; add the name of a file")
    try:
        descriptor, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise _unwritable(target, error) from None
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
        os.chmod(temporary, 0o644)
        os.replace(temporary, target)
    except OSError as error:
        raise _unwritable(target, error) from None
    finally:
        if os.path.exists(temporary):
            os.unlink(temporary)


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder, and make sure that files can be written there.

    Raises:
        GraspAtlasError: If they cannot.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise GraspAtlasError(f"cannot write to folder '{folder}': {error.strerror or error}; choose another") from None
    return folder


def write_csv(path: str | os.PathLike[str], columns: Mapping[str, Iterable[Any]]) -> None:
    """Write a table as CSV: a row of names, then one row an entry; UTF-8, commas, a dot in numbers.

    Numbers have as many digits as it takes to read the same ones back; flags are ``true`` and ``false``, and a NaN
    leaves its cell empty.

    Args:
        path: Such as ``"path.csv"``; an existing file is replaced.
        columns: Columns of one length, by name.

    Raises:
        GraspAtlasError: If the file cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    plain = [column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values()]
    table.writerows([_cell(value) for value in row] for row in zip(*plain, strict=True))
    with replaced(path) as stream:
        stream.write(text.getvalue().encode("utf-8"))


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value != value else value


def _unwritable(target: Path, error: OSError) -> GraspAtlasError:
    return GraspAtlasError(f"cannot write '{target}': {error.strerror or error}; choose a path that can be written")
