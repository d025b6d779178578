"""Predicted against simulated: the force that grasps are said to withstand, and the push that takes the object."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.holding_force import holding_force
from graspatlas.result.result import Result
from graspatlas.simulation.outcome import Simulation
from graspatlas.simulation.protocols import find_protocol
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.validation import number_array
from graspatlas.viewer.figures.style import BLUE, COLUMN, INK, RED, REJECTED, Picture, styled

__all__ = ["plot_holding"]

#: Share of the largest force that the axes extend beyond it.
ROOM = 0.06


def plot_holding(result: Result, simulation: Simulation, predicted: ArrayLike | None = None) -> Picture:
    """Draw the predicted holding force of grasps against the push under which the simulation loses the object.

    A dot is a grasp: blue where friction of the protocol closes it, grey where it does not, red where the object was
    lost while the hand closed. The legend counts them, and says how well predictions agree: Spearman's rank correlation
    and the median of the differences. Where no push took the object there is no dot.

    Args:
        result: The result.
        simulation: Its trials, with breaking forces: ``ga.simulate(result, sample=100, breaking=True)``.
        predicted: Predicted forces of the grasps of the simulation (n,) [N]; by default the holding force with the
            friction of the protocol, and with as much normal force as the fingers squeeze with.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If the simulation is of another problem or has fewer than two breaking forces, or the
            predictions are not as many.
    """
    if simulation.problem != result.problem.name:
        raise GraspAtlasError(f"the simulation is of '{simulation.problem}', the result of '{result.problem.name}'")
    simulated = simulation.breaking_forces
    known = np.isfinite(simulated)
    if known.sum() < 2:
        raise GraspAtlasError(
            f"the simulation has {known.sum()} breaking forces, at least 2 are needed: "
            "simulate(result, sample=100, breaking=True)"
        )
    forces = _predicted(result, simulation) if predicted is None else number_array(predicted, "predicted")
    if forces.shape != simulated.shape:
        raise GraspAtlasError(f"predicted must have one force for each of {len(simulated)} grasps, got {forces.shape}")
    with styled():
        figure = Picture(figsize=(COLUMN, 1.3 * COLUMN))
        axes = figure.add_axes((0.14, 0.09, 0.82, 0.82 / 1.3))
        end = (1.0 + ROOM) * float(max(simulated[known].max(), forces[known].max(), 1e-9))
        axes.plot([0.0, end], [0.0, end], color=INK, lw=0.6, ls=(0, (4, 3)), zorder=1, label="as predicted")
        _draw_dots(axes, simulation, forces, known)
        axes.set(xlim=(-0.02 * end, end), ylim=(-0.02 * end, end), aspect="equal")
        axes.set_xlabel("predicted holding force [N]")
        axes.set_ylabel("simulated breaking force [N]")
        title = f"{simulation.problem}, {simulation.protocol}\n{known.sum()} grasps"
        axes.legend(
            title=title + _agreement(forces[known], simulated[known]),
            title_fontsize=7.5,
            alignment="left",
            loc="lower left",
            bbox_to_anchor=(-0.14, 1.01),
            borderpad=0.0,
            handletextpad=0.4,
        )
    return figure


def _predicted(result: Result, simulation: Simulation) -> Array:
    """Holding forces of the grasps of a simulation (n,), with its friction and normal forces [N]."""
    X = result.atlas.centers[np.maximum(simulation.charts, 0)].copy()
    if simulation.refined.any():
        X[simulation.refined] = result.refined_best.x
    protocol = find_protocol(simulation.protocol)
    budget = simulation.normal_force * len(simulation.contacts)
    grasps = Grasps(result.problem, X)
    return holding_force(grasps, friction=protocol.friction, normal_force=budget, torsional=protocol.torsional)


def _draw_dots(axes: Axes, simulation: Simulation, forces: Array, known: BoolArray) -> None:
    simulated, lost = simulation.breaking_forces, simulation.lost_closing
    kinds = (
        (simulation.closes & ~lost, BLUE, "closed by friction"),
        (~simulation.closes & ~lost, REJECTED, "not closed by friction"),
        (lost, RED, "lost while closing"),
    )
    dots = partial(axes.plot, ls="none", marker="o", ms=3.2, mew=0.3, mec=INK, zorder=3, clip_on=False)
    for chosen, colour, label in kinds:
        rows = chosen & known
        if rows.any():
            words = f"{rows.sum()} {label}{_agreement(forces[rows], simulated[rows])}"
            dots(forces[rows], simulated[rows], mfc=colour, label=words)
    if np.isinf(simulated).any():
        axes.plot([], [], ls="none", label=f"{np.isinf(simulated).sum()} never lost, not drawn")


def _agreement(predicted: Array, simulated: Array) -> str:
    """How well predictions agree, in words; nothing where all are alike."""
    from scipy.stats import spearmanr  # slow to import

    if min(np.ptp(predicted), np.ptp(simulated)) == 0.0:
        return ""
    rank, median = spearmanr(predicted, simulated).statistic, np.median(np.abs(simulated - predicted))
    return f": rank correlation {rank:.2f}, median difference {median:.2g} N"
