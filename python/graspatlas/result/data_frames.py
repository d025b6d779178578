"""Atlas and result as pandas tables: one row a chart, and one a pair of neighbours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graspatlas.atlas.atlas import Atlas, Closed
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.contacts import Contact
from graspatlas.quality.evaluation import quality_name
from graspatlas.result.exports import grasp_columns
from graspatlas.support.files import replaced, write_csv
from graspatlas.support.validation import joined

if TYPE_CHECKING:
    from pandas import DataFrame

    from graspatlas.result.result import Result

__all__ = ["FRAME_ENDINGS", "atlas_frame", "neighbour_frame", "result_frame", "save_frame"]

#: What a file of a table of charts may end in.
FRAME_ENDINGS = (".csv", ".parquet")


def atlas_frame(atlas: Atlas, volumes: bool) -> DataFrame:
    """One row a chart; see :meth:`Atlas.to_pandas`."""
    centers = {f"x{i}": column for i, column in enumerate(atlas.centers.T)}
    return _frame(joined(centers, _chart_columns(atlas, volumes)))


def neighbour_frame(atlas: Atlas) -> DataFrame:
    """One row a pair of neighbours; see :meth:`Atlas.neighbours_to_pandas`."""
    pairs, x, difference = atlas.neighbour_pairs, atlas.centers, atlas.system.difference
    distances = [float(np.linalg.norm(difference(x[a], x[b]))) for a, b in pairs]
    columns = {"chart": pairs[:, 0], "neighbour": pairs[:, 1], "distance": np.array(distances)}
    return _frame(columns, index=None)


def result_frame(result: Result, volumes: bool) -> DataFrame:
    """One row a chart; see :meth:`graspatlas.Result.to_pandas`."""
    grasps = Grasps(result.problem, result.atlas.centers)
    return _frame(
        joined(
            {"feasible": result.feasible},
            {quality_name(result.quality): result.qualities, **result.others},
            grasp_columns(grasps),
            _parameter_columns(grasps),
            _chart_columns(result.atlas, volumes),
        )
    )


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


def _frame(columns: dict[str, Any], index: str | None = "chart") -> DataFrame:
    try:
        import pandas as pd
    except ImportError:
        raise GraspAtlasError("a table of charts needs pandas: pip install 'graspatlas[tables]'") from None
    frame: DataFrame = pd.DataFrame(columns)
    frame.index.name = index
    return frame


def _chart_columns(atlas: Atlas, volumes: bool) -> dict[str, NDArray[Any]]:
    """What is known of each chart besides its centre."""
    n = atlas.n_charts
    chart_of_vertex = np.repeat(np.arange(n), np.diff(atlas.vertex_start))
    columns: dict[str, NDArray[Any]] = {
        "residual": atlas.residuals,
        "n_neighbours": np.bincount(atlas.neighbour_pairs.ravel(), minlength=n),
        "n_facets": np.diff(atlas.facet_start),
        "n_vertices": np.diff(atlas.vertex_start),
    }
    for reason in Closed:
        if reason is not Closed.OPEN:
            closed = chart_of_vertex[atlas.vertex_closed == reason.value]
            columns[f"closed_{reason.name.lower()}"] = np.bincount(closed, minlength=n)
    return {**columns, "volume": atlas.volumes} if volumes else columns


def _parameter_columns(grasps: Grasps) -> dict[str, NDArray[np.float64]]:
    """The free patch parameters, which are the last numbers of x: ``contact0_hand_u`` and so on."""
    names = [name for i, contact in enumerate(grasps.problem.contacts) for name in _parameter_names(i, contact)]
    return {name: grasps.x[:, at - len(names)] for at, name in enumerate(names)}


def _parameter_names(number: int, contact: Contact) -> list[str]:
    sides = (("hand", contact.hand, contact.hand_frozen), ("object", contact.object, contact.frozen))
    return [
        f"contact{number}_{side}_{name}"
        for side, patch, frozen in sides
        for name in patch.parameters
        if name not in frozen
    ]
