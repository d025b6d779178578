"""The quality indices of the package by name, and the value of one of them, or of one of your own, at grasps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.grasps.callables import GraspFunction, called_numbers
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.quality.force_closure import force_closure_margin
from graspatlas.quality.holding_force import holding_force
from graspatlas.quality.manipulability import (
    inverse_condition_number,
    joint_centrality,
    manipulability_volume,
    smallest_semi_axis,
)
from graspatlas.quality.wrench_space import (
    ferrari_canny_epsilon,
    ferrari_canny_volume,
    grasp_isotropy,
    min_weight,
    soft_finger_epsilon,
)
from graspatlas.support.arrays import Array

__all__ = ["INDICES", "evaluate", "find_index"]

#: Indices by name, as ``optimize(quality=...)``, problem files and the command line state them.
INDICES: dict[str, Callable[[Grasps], Array]] = {
    index.__name__: index
    for index in (
        inverse_condition_number,
        manipulability_volume,
        smallest_semi_axis,
        force_closure_margin,
        ferrari_canny_epsilon,
        soft_finger_epsilon,
        ferrari_canny_volume,
        min_weight,
        grasp_isotropy,
        joint_centrality,
        holding_force,
    )
}
#: Indices of this package, whose values need no check.
_OWN = tuple(INDICES.values())


def find_index(quality: Quality) -> GraspFunction:
    """The index of a name, or the callable itself.

    Raises:
        GraspAtlasError: If there is no index of that name.
    """
    if callable(quality):
        return quality
    if not isinstance(quality, str) or quality not in INDICES:
        raise unknown_name("quality index", quality, INDICES)
    return INDICES[quality]


def evaluate(quality: Quality, grasps: Grasps) -> Array:
    """Value of a quality index at each grasp (n,).

    Args:
        quality: Name of an index, or a callable: see :mod:`graspatlas.quality.batched`.
        grasps: The grasps.

    Raises:
        GraspAtlasError: If there is no such index, or a callable raises, or returns anything but finite numbers; see
            :mod:`graspatlas.grasps.callables`.
    """
    index, name = find_index(quality), quality_name(quality)
    if index not in _OWN:
        return called_numbers(index, name, grasps)
    values = np.asarray(index(grasps), float)
    if np.isnan(values).any():
        raise GraspAtlasError(f"quality index '{name}' is NaN for grasp {int(np.isnan(values).argmax())}")
    return values
