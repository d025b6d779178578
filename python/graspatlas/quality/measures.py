"""Quality indices as climbs in the compiled core follow them."""

from __future__ import annotations

import numpy as np

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality
from graspatlas.quality.evaluation import evaluate
from graspatlas.support.arrays import Array

__all__ = ["index_measure"]

#: Indices that the core reads off semi-axes, and its names for them.
_OF_SEMI_AXES = {
    "manipulability_volume": "volume",
    "inverse_condition_number": "inverse_condition_number",
    "smallest_semi_axis": "smallest",
}
#: Friction of the index of force closure where none is stated.
_FRICTION = 0.5


def index_measure(quality: Quality, problem: Problem, system: _core.GraspSystem, X: Array) -> _core.Measure:
    """A quality index, to climb on: in the compiled core where that knows it, or else by a function that it calls.

    Args:
        quality: The index.
        problem: The problem.
        system: Its system, of the grasps that are climbed on.
        X: Some of these [n, configuration_size], which tell how many motions of the object are coordinated.
    """
    if isinstance(quality, str) and quality in _OF_SEMI_AXES:
        known = [X[:1]] if problem.x1 is None else [X[:1], problem.x1_array[None]]
        axes = np.asarray(_core.semi_axes(system, np.vstack(known), Grasps.LENGTH_UNIT))
        connectivity = int((axes > 0.0).sum(axis=1).max())
        return _core.axes_measure(_OF_SEMI_AXES[quality], connectivity, Grasps.LENGTH_UNIT)
    if quality == "force_closure_margin":
        return _core.closure_index_measure(_FRICTION)
    return _core.numbers_measure(lambda X: evaluate(quality, Grasps(problem, X, system)))
