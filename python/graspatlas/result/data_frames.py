"""Atlas and result as pandas tables: one row a chart, and one a pair of neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graspatlas.atlas.atlas import Atlas, Closed
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.contacts import Contact
from graspatlas.quality.evaluation import quality_name
from graspatlas.result.exports import grasp_columns
from graspatlas.support.columns import joined, to_frame

if TYPE_CHECKING:
    from pandas import DataFrame

    from graspatlas.result.result import Result

__all__ = ["atlas_frame", "neighbour_frame", "result_frame"]


def atlas_frame(atlas: Atlas, volumes: bool) -> DataFrame:
    """One row a chart; see :meth:`Atlas.to_pandas`."""
    centers = {f"x{i}": column for i, column in enumerate(atlas.centers.T)}
    return to_frame(joined(centers, _chart_columns(atlas, volumes)))


def neighbour_frame(atlas: Atlas) -> DataFrame:
    """One row a pair of neighbours; see :meth:`Atlas.neighbours_to_pandas`."""
    pairs, x, difference = atlas.neighbour_pairs, atlas.centers, atlas.system.difference
    distances = [float(np.linalg.norm(difference(x[a], x[b]))) for a, b in pairs]
    columns = {"chart": pairs[:, 0], "neighbour": pairs[:, 1], "distance": np.array(distances)}
    return to_frame(columns, index=None)


def result_frame(result: Result, volumes: bool) -> DataFrame:
    """One row a chart; see :meth:`graspatlas.Result.to_pandas`."""
    grasps = Grasps(result.problem, result.atlas.centers)
    return to_frame(
        joined(
            {"feasible": result.feasible},
            {quality_name(result.quality): result.qualities, **result.others},
            grasp_columns(grasps),
            _parameter_columns(grasps),
            _chart_columns(result.atlas, volumes),
        )
    )


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
