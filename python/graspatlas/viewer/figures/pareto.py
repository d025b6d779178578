"""The Pareto front of two indices over an atlas, with three of the grasps along it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from graspatlas.analysis.pareto import knee, pareto_front, values_of
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array, IntArray
from graspatlas.viewer.figures.planar import draw_planar_grasp
from graspatlas.viewer.figures.portrait import common_direction, portrait
from graspatlas.viewer.figures.style import BLUE, INK, PAGE, RED, REJECTED, Picture, readable, styled

__all__ = ["plot_pareto"]


#: Largest over median value from which an axis is logarithmic, when all values are positive.
WIDE = 100.0
#: Pixels of a portrait.
PORTRAIT = (560, 430)
#: Share of its length that an axis extends beyond the values at either end.
ROOM = 0.04
#: Colours of the symbols for the best by either index; the knee is red.
GREEN, YELLOW = "#7fd18b", "#f2c14e"


def plot_pareto(result: Result, first: Quality, second: Quality) -> Picture:
    """Draw all grasps by two indices, the front of those that none dominates, and three grasps along it.

    A dot is a chart; pale grey ones do not meet the requirements, and those beyond the others are cut off. The front
    is drawn as stairs: they bound what some grasp reaches in both indices. Its knee is that of
    :func:`graspatlas.analysis.pareto.knee`.

    Args:
        result: The result.
        first: The index along the horizontal axis: its name, or a callable.
        second: The index along the vertical axis.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If an index is unknown or fails, both are the same, no grasp meets the requirements, or a mesh
            of the hand or the object cannot be read.
    """
    values = values_of(result, first, second)
    front = pareto_front(result, first, second)
    names = [quality_name(index).replace("_", " ") for index in (first, second)]
    shown = _chosen(values, front, names)
    with styled():
        figure = Picture(figsize=(PAGE, 4.4))
        axes = figure.add_axes((0.085, 0.11, 0.595, 0.82))
        _draw_dots(axes, result, values)
        stairs = values[front[::-1]]
        axes.step(*stairs.T, where="pre", color=INK, lw=0.9, zorder=3, solid_joinstyle="miter")
        label = f"Pareto front, {len(front)} grasp{'s' if len(front) > 1 else ''}"
        axes.plot(*stairs.T, marker="o", ms=2.8, color=INK, lw=0.0, zorder=4, label=label)
        _mark(axes, values[0], "s", 4.6, "white", label="first grasp")
        for portrayed in shown:
            _mark(axes, values[portrayed.chart], portrayed.marker, portrayed.size, portrayed.colour)
        within = np.vstack([values[result.accepted], values[:1]])
        for axis, name, column in zip("xy", names, within.T, strict=True):
            _scale(axes, axis, column)
            getattr(axes, f"set_{axis}label")(name)
        legend = {"columnspacing": 1.4, "handletextpad": 0.1, "borderpad": 0.0}
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.02), ncols=4, **legend)
        _draw_portraits(figure, result, shown, values)
    return figure


@dataclass(frozen=True)
class _Portrayed:
    """A grasp that is marked on the front and drawn beside it."""

    name: str
    chart: int
    marker: str
    size: float
    colour: str


def _chosen(values: Array, front: IntArray, names: list[str]) -> list[_Portrayed]:
    """The front's ends, and its knee where it has one."""
    at = knee(values[front])
    chosen = [_Portrayed(f"best {names[0]}", int(front[0]), "*", 9.5, GREEN)]
    if at is not None:
        chosen.append(_Portrayed("knee", int(front[at]), "D", 5.0, RED))
    if len(front) > 1:
        chosen.append(_Portrayed(f"best {names[1]}", int(front[-1]), "^", 6.5, YELLOW))
    return chosen


def _draw_dots(axes: Axes, result: Result, values: Array) -> None:
    """All charts: those that meet the requirements over the pale ones that do not."""
    kept = result.accepted
    dots = partial(axes.plot, ls="none", marker="o", mew=0.0, rasterized=True)
    dots(*values[kept].T, color=BLUE, ms=2.2, alpha=0.75, zorder=2, label="grasps")
    if not kept.all():
        dots(*values[~kept].T, color=REJECTED, ms=1.7, zorder=1, label="requirements not met")


def _mark(axes: Axes, point: Array, marker: str, size: float, colour: str, label: str = "") -> None:
    axes.plot(
        *point, ls="none", mec=INK, mew=0.7, zorder=5, clip_on=False, marker=marker, ms=size, mfc=colour, label=label
    )


def _scale(axes: Axes, axis: str, values: Array) -> None:
    """Fit an axis to values; logarithmic where they span many powers of ten."""
    low, high = float(values.min()), float(values.max())
    if low > 0.0 and high > WIDE * np.median(values):
        room = (high / low) ** ROOM
        getattr(axes, f"set_{axis}scale")("log")
        getattr(axes, f"set_{axis}lim")(low / room, high * room)
        return
    room = ROOM * (high - low) or ROOM * max(abs(high), 1.0)
    getattr(axes, f"set_{axis}lim")(low - room, high + room)


def _draw_portraits(figure: Figure, result: Result, shown: list[_Portrayed], values: Array) -> None:
    """The marked grasps, one above the other, seen from one side, with their symbols and values."""
    problem = result.problem
    grasps = [result.grasp(portrayed.chart) for portrayed in shown]
    planar = problem.object_joint_model.planar
    direction = None if planar else common_direction(problem, grasps)
    for number, (portrayed, grasp) in enumerate(zip(shown, grasps, strict=True)):
        bottom = 1.0 - (number + 1) / 3.0
        axes = figure.add_axes((0.72, bottom + 0.01, 0.27, 0.235))
        if planar:
            draw_planar_grasp(axes, problem, grasp)
        else:
            axes.imshow(portrait(problem, grasp, direction=direction, width=PORTRAIT[0], height=PORTRAIT[1]))
        axes.set_axis_off()
        pair = ", ".join(readable(float(value)) for value in values[portrayed.chart])
        marker, size, colour = portrayed.marker, portrayed.size, portrayed.colour
        handle = Line2D([], [], ls="none", mec=INK, mew=0.7, marker=marker, ms=size, mfc=colour)
        legend = figure.legend(
            [handle], [f"{portrayed.name}\n{pair}"], loc="center", bbox_to_anchor=(0.855, bottom + 0.285), borderpad=0.0
        )
        legend.set_zorder(6)
