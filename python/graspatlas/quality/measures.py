"""Quality indices as climbs in the compiled core follow them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from graspatlas import _core
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.quality.evaluation import INDICES, evaluate, find_index
from graspatlas.quality.holding_force import holding_limits
from graspatlas.quality.wrench_space import EDGES, FRICTION, TORSIONAL, torque_divisor
from graspatlas.support.arrays import Array

__all__ = ["index_measure"]

#: Indices that the core reads off semi-axes, and its names for them.
_OF_SEMI_AXES = {
    "manipulability_volume": "volume",
    "inverse_condition_number": "inverse_condition_number",
    "smallest_semi_axis": "smallest",
}
#: Those that it reads off the contacts or joints of one problem.
_OF_PROBLEM: dict[str, Callable[[Problem], _core.Measure]] = {
    "force_closure_margin": lambda problem: _core.closure_index_measure(FRICTION),
    "holding_force": lambda problem: _core.holding_index_measure(holding_limits(problem)),
    "ferrari_canny_epsilon": lambda problem: _core.epsilon_measure(FRICTION, EDGES, 0.0, torque_divisor(problem)),
    "soft_finger_epsilon": lambda problem: _core.epsilon_measure(FRICTION, EDGES, TORSIONAL, torque_divisor(problem)),
    "joint_centrality": lambda problem: _core.centrality_measure(len(problem.hand.model.hand_joints)),
}


def index_measure(quality: Quality, problem: Problem, system: _core.GraspSystem, X: Array) -> _core.Measure:
    """A quality index, to climb on: in the compiled core where that knows it, or else by a function that it calls.

    Args:
        quality: The index.
        problem: The problem.
        system: Its system, of the grasps that are climbed on.
        X: Some of these [n, configuration_size], which tell how many motions of the object are coordinated.
    """
    name = quality_name(quality)
    if find_index(quality) is not INDICES.get(name):  # a function of the user's, whatever its name
        return _asked(quality, problem, system)
    if name in _OF_SEMI_AXES:
        known = [X[:1]] if problem.x1 is None else [X[:1], problem.x1_array[None]]
        axes = np.asarray(_core.semi_axes(system, np.vstack(known), Grasps.LENGTH_UNIT))
        connectivity = int((axes > 0.0).sum(axis=1).max())
        return _core.axes_measure(_OF_SEMI_AXES[name], connectivity, Grasps.LENGTH_UNIT)
    if name in _OF_PROBLEM:
        return _OF_PROBLEM[name](problem)
    return _asked(quality, problem, system)


def _asked(quality: Quality, problem: Problem, system: _core.GraspSystem) -> _core.Measure:
    return _core.numbers_measure(lambda X: evaluate(quality, Grasps(problem, X, system)))
