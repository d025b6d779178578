"""Tables as columns by name: side by side, as a pandas table, and in files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from graspatlas.errors import GraspAtlasError
from graspatlas.storage.files import replaced, write_csv
from graspatlas.support.arrays import AnyArray, Array

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["FRAME_ENDINGS", "joined", "pose_columns", "save_frame", "to_frame"]

#: What a file of a table may end in.
FRAME_ENDINGS = (".csv", ".parquet")


def to_frame(columns: Mapping[str, AnyArray], index: str | None = "chart") -> DataFrame:
    """Columns as a pandas table.

    Args:
        columns: The columns [n] by name.
        index: Name of the index, which counts the rows.

    Raises:
        GraspAtlasError: If pandas is not installed.
    """
    try:
        import pandas as pd  # slow to import
    except ImportError:
        raise GraspAtlasError("a table of charts needs pandas: pip install 'graspatlas[tables]'") from None
    frame: DataFrame = pd.DataFrame(dict(columns))
    frame.index.name = index
    return frame


def save_frame(frame: DataFrame, path: Path) -> None:
    """Write a table as CSV or Parquet; an existing file is replaced at once or not.

    Args:
        frame: The table; its index becomes the first column.
        path: Ends in one of ``FRAME_ENDINGS``.

    Raises:
        GraspAtlasError: If the file cannot be written, or for Parquet pyarrow is not installed.
    """
    columns = {str(name): column.to_numpy() for name, column in frame.reset_index().items()}
    if path.suffix == ".csv":
        write_csv(path, columns)
        return
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise GraspAtlasError(
            f"'{path}' needs pyarrow: pip install 'graspatlas[sweep]'; or choose a file that ends in .csv"
        ) from None
    with replaced(path) as stream:
        pq.write_table(pa.table(columns), stream)


def joined(*tables: Mapping[str, AnyArray]) -> dict[str, AnyArray]:
    """Columns of several tables side by side.

    Raises:
        GraspAtlasError: If two have one name, as a joint called ``quality`` would.
    """
    columns: dict[str, AnyArray] = {}
    for table in tables:
        for name in table:
            if name in columns:
                raise GraspAtlasError(f"two columns of the table would be called '{name}'; rename the joint or index")
        columns |= table
    return columns


def pose_columns(name: str, xyz: Array, quat_xyzw: Array) -> dict[str, Array]:
    """Columns of poses: ``<name>_x``, ``_y``, ``_z`` and ``<name>_qx``, ``_qy``, ``_qz``, ``_qw``.

    Args:
        name: What has the poses.
        xyz: Positions [n, 3], metres.
        quat_xyzw: Unit quaternions [n, 4].
    """
    places = {f"{name}_{axis}": xyz[:, i] for i, axis in enumerate("xyz")}
    return {**places, **{f"{name}_q{axis}": quat_xyzw[:, i] for i, axis in enumerate("xyzw")}}
