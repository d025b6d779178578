"""Recorded hand postures from CSV and NPZ files."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.storage.archives import DamagedArchive, read_arrays
from graspatlas.storage.files import opened, read_text
from graspatlas.support.arrays import Array

__all__ = ["read_postures"]


def read_postures(path: Path, name: str | None = None) -> tuple[Array, tuple[str, ...]]:
    """Postures of a hand, and the joints that their columns are of.

    Args:
        path: A CSV file whose first row names the joints, or an NPZ file with ``samples`` (z, h) and ``joints`` (h,);
            radians, and metres for joints that slide.
        name: The file's name for messages.

    Returns:
        The postures, one a row (z, h), and the names of the joints (h,).

    Raises:
        GraspAtlasError: If the file cannot be read or holds anything else.
    """
    label = name or str(path)
    try:
        return _read_npz(path, label) if path.suffix == ".npz" else _read_csv(path, label)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise GraspAtlasError(f"cannot read postures '{label}': {reason}") from None


def _read_csv(path: Path, label: str) -> tuple[Array, tuple[str, ...]]:
    with io.StringIO(read_text(path, "utf-8-sig"), newline="") as file:
        reader = csv.reader(file)
        names = tuple(name.strip() for name in next(reader, []))
        if not any(names):
            raise GraspAtlasError(f"'{label}' is empty; its first row must name the joints")
        rows = []
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            if len(row) != len(names):
                raise GraspAtlasError(f"'{label}', line {reader.line_num}: {len(row)} columns, but {len(names)} joints")
            rows.append([_number(cell, label, reader.line_num, joint) for cell, joint in zip(row, names, strict=True)])
    return np.array(rows, float).reshape(-1, len(names)), names


def _number(text: str, label: str, line: int, joint: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise GraspAtlasError(f"'{label}', line {line}: joint '{joint}' must be a finite number, got '{text.strip()}'")
    return value


def _read_npz(path: Path, label: str) -> tuple[Array, tuple[str, ...]]:
    try:
        with opened(path, "postures") as stream:
            arrays = read_arrays(stream)
        return np.array(arrays["samples"], float), tuple(map(str, arrays["joints"]))
    except GraspAtlasError:
        raise
    except (DamagedArchive, KeyError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise GraspAtlasError(f"'{label}' needs the arrays samples [z, h] and joints [h]: {reason}") from None
