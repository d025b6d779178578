"""Rows of a sweep in a Parquet file: their columns, reading and writing."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from graspatlas.errors import GraspAtlasError
from graspatlas.storage.files import opened, replaced

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["COLUMNS", "ROWS", "Row", "read_rows", "write_rows"]

#: Name of the file in the folder of a sweep that has a row for each run.
ROWS = "runs.parquet"
_TEXT, _NUMBER, _WHOLE, _FLAG, _NUMBERS, _TEXTS = "string", "float64", "int64", "bool_", "floats", "strings"
#: Columns of a row and their types.
COLUMNS = {
    "run": _TEXT,
    "problem": _TEXT,
    "file": _TEXT,
    "dimension": _WHOLE,
    "radius": _NUMBER,
    "epsilon": _NUMBER,
    "quality": _TEXT,
    "require": _TEXTS,
    "refine": _FLAG,
    "max_charts": _WHOLE,
    "max_seconds": _NUMBER,
    "status": _TEXT,
    "error": _TEXT,
    "is_global": _FLAG,
    "n_charts": _WHOLE,
    "n_accepted": _WHOLE,
    "seconds": _NUMBER,
    "seconds_atlas": _NUMBER,
    "seconds_quality": _NUMBER,
    "max_residual": _NUMBER,
    "quality_best": _NUMBER,
    "refined_status": _TEXT,
    "quality_worst": _NUMBER,
    "quality_at_x1": _NUMBER,
    "best_chart": _WHOLE,
    "best_joints": _TEXTS,
    "best_q": _NUMBERS,
    "best_object_xyz": _NUMBERS,
    "best_object_quat_xyzw": _NUMBERS,
    "version": _TEXT,
}

#: A row: its values by column, of the types above or None.
Row: TypeAlias = dict[str, Any]


def _schema() -> pa.Schema:
    import pyarrow as pa

    types = {_NUMBERS: pa.list_(pa.float64()), _TEXTS: pa.list_(pa.string())}
    return pa.schema([(name, types.get(kind) or getattr(pa, kind)()) for name, kind in COLUMNS.items()])


def read_rows(path: Path) -> dict[str, Row]:
    """Rows that earlier starts have written, by run."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not os.path.lexists(path):
        return {}
    try:
        with opened(path) as stream:
            table = pq.read_table(stream, schema=_schema())
    except (OSError, pa.ArrowException) as error:
        raise GraspAtlasError(
            f"'{path}' is not the file of a sweep ({error}); move it away or choose another folder"
        ) from None
    return {row["run"]: row for row in table.to_pylist()}


def write_rows(path: Path, rows: dict[str, Row]) -> None:
    """Replace the file of rows, at once or not at all."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_pylist(list(rows.values()), schema=_schema())
    with replaced(path) as stream:
        pq.write_table(table, stream)
