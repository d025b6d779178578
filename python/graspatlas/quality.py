r"""Quality indices of grasps.

An index is a function of grasps: larger is better, and a grasp to which it does not apply has 0. Those below read the
manipulability ellipsoid of the object (Bicchi and Prattichizzo 2000): its semi-axes are the inverses of the singular
values of :math:`J^+ G^\top` over the coordinated motions, with lengths in millimetres.

Your own index is any function of one :class:`~graspatlas.grasps.Grasp` that returns a number. One that takes a whole
:class:`~graspatlas.grasps.Grasps` batch and returns an array [n] is marked by :func:`batched`::

    @ga.batched
    def spread(grasps):
        points = grasps.contact_points                      # [n, m, 3]
        return np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).min(axis=1)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from graspatlas import _core
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.grasps import Grasp, Grasps
from graspatlas.tables import number

__all__ = [
    "INDICES",
    "Quality",
    "batched",
    "evaluate",
    "force_closure_margin",
    "inverse_condition_number",
    "manipulability_volume",
    "quality_name",
    "smallest_semi_axis",
]

Array = NDArray[np.float64]
Quality = str | Callable[[Any], Any]
F = TypeVar("F", bound=Callable[[Grasps], Any])


def batched(index: F) -> F:
    """Mark a quality index as one that takes a :class:`Grasps` batch and returns an array [n]."""
    index.batched = True  # type: ignore[attr-defined]
    return index


def _axes(grasps: Grasps, length_unit: float) -> Array:
    """Semi-axes over the motions that are usually coordinated [n, connectivity]; zero where a grasp has lost one.

    What is usual is the largest connectivity of x1 and of the grasps at hand.
    """
    if not 0.0 < number(length_unit, "length_unit") < np.inf:
        raise GraspAtlasError(f"length_unit must be positive, got {length_unit}")
    x1 = grasps.problem.x1_array
    axes = np.asarray(_core.semi_axes(grasps.system, np.vstack([x1, grasps.x]), length_unit))
    connectivity = int((axes > 0.0).sum(axis=1).max())
    return axes[1:, axes.shape[1] - connectivity :]


@batched
def inverse_condition_number(grasps: Grasps, length_unit: float = Grasps.LENGTH_UNIT) -> Array:
    """Smallest over largest semi-axis of the manipulability ellipsoid, lengths in mm; 0 is a singular grasp.

    Args:
        grasps: The grasps.
        length_unit: Unit of lengths in the object's velocity [m]; millimetres by default.

    Returns:
        One value for each grasp [n].

    Source: "Global Optimization of Robotic Grasps", Section V, first index.
    """
    axes = _axes(grasps, length_unit)
    if axes.shape[1] == 0:
        return np.zeros(len(grasps))
    largest = axes[:, -1]
    return np.divide(axes[:, 0], largest, out=np.zeros(len(grasps)), where=largest > 0.0)


@batched
def manipulability_volume(grasps: Grasps, length_unit: float = Grasps.LENGTH_UNIT) -> Array:
    """Product of the ellipsoid's semi-axes, translations [mm] and rotations; unbounded near indeterminacy.

    Near a grasp that leaves the object loose, one semi-axis grows without bound: ask for force closure first.

    Args:
        grasps: The grasps.
        length_unit: Unit of lengths in the object's velocity [m]; millimetres by default.

    Returns:
        One value for each grasp [n].

    Source: "Global Optimization of Robotic Grasps", Section V, second index.
    """
    axes = _axes(grasps, length_unit)
    return np.asarray(axes.prod(axis=1)) if axes.shape[1] else np.zeros(len(grasps))


@batched
def smallest_semi_axis(grasps: Grasps, length_unit: float = Grasps.LENGTH_UNIT) -> Array:
    """Smallest semi-axis of the manipulability ellipsoid, lengths in mm.

    Args:
        grasps: The grasps.
        length_unit: Unit of lengths in the object's velocity [m]; millimetres by default.

    Returns:
        One value for each grasp [n].

    Source: "Global Optimization of Robotic Grasps", Section V, third index.
    """
    axes = _axes(grasps, length_unit)
    return axes[:, 0].copy() if axes.shape[1] else np.zeros(len(grasps))


@batched
def force_closure_margin(grasps: Grasps, friction: float = 0.5) -> Array:
    r"""Distance of the contact forces from their friction cones that internal forces allow; 0 without force closure.

    .. math:: \max_{G f = 0,\; \sum_i n_i^\top f_i = 1} \; \min_i \;
        \frac{\mu \, n_i^\top f_i - \| f_i - n_i n_i^\top f_i \|}{\sqrt{1 + \mu^2}}

    The margin has no unit: normal forces add up to one. It is exact for round cones (a second-order cone programme).

    Args:
        grasps: The grasps.
        friction: Coefficient of friction mu.

    Returns:
        One value for each grasp [n].

    Source: Force closure as in V.-D. Nguyen, "Constructing Force-Closure Grasps", IJRR 1988, the paper's reference 14.
    """
    return np.asarray(_core.force_closure_margins(grasps.system, grasps.x, friction))


#: Indices by name.
INDICES: dict[str, Callable[[Grasps], Array]] = {
    index.__name__: index
    for index in (inverse_condition_number, manipulability_volume, smallest_semi_axis, force_closure_margin)
}


def find_index(quality: Quality) -> Callable[[Any], Any]:
    """The index of a name, or the callable itself.

    Raises:
        GraspAtlasError: If there is no index of that name.
    """
    if callable(quality):
        return quality
    if not isinstance(quality, str) or quality not in INDICES:
        raise unknown_name("quality index", quality, INDICES)
    return INDICES[quality]


def quality_name(quality: Quality) -> str:
    """The name of an index."""
    return quality if isinstance(quality, str) else getattr(quality, "__name__", type(quality).__name__)


def evaluate(quality: Quality, grasps: Grasps) -> Array:
    """Value of a quality index at each grasp [n].

    Args:
        quality: Name of an index, or a callable: see the top of this module.
        grasps: The grasps.

    Raises:
        GraspAtlasError: If there is no such index, or a callable raises, or returns the wrong shape or a NaN.
    """
    index, name = find_index(quality), quality_name(quality)
    try:
        if getattr(index, "batched", False):
            values = np.asarray(index(grasps), float)
        else:
            values = np.array([_number(index, grasp, name) for grasp in grasps], float).reshape(len(grasps))
    except GraspAtlasError:
        raise
    except Exception as error:
        raise GraspAtlasError(f"quality index '{name}' raised {type(error).__name__}: {error}") from error
    if values.shape != (len(grasps),):
        raise GraspAtlasError(
            f"quality index '{name}' must return {len(grasps)} numbers for {len(grasps)} grasps; "
            f"it returned an array of shape {values.shape}"
        )
    if np.isnan(values).any():
        raise GraspAtlasError(f"quality index '{name}' returned NaN for grasp {int(np.isnan(values).argmax())}")
    return values


def _number(index: Callable[[Grasp], Any], grasp: Grasp, name: str) -> float:
    value = np.asarray(index(grasp), float)
    if value.ndim != 0:
        raise GraspAtlasError(
            f"quality index '{name}' must return one number for one grasp; it returned an array of shape {value.shape} "
            "(an index that takes all grasps at once is marked with graspatlas.batched)"
        )
    return float(value)
