"""The manipulability ellipsoid, projected on the plane of its longest and its shortest semi-axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.problem.problem import Problem
from graspatlas.viewer.figures.style import COLUMN, Picture, readable, styled

__all__ = ["BEST", "WORST", "draw_ellipses", "extreme_semi_axes", "plot_ellipsoid", "unit_of"]


#: Colours of the ellipses: the first grasp's is that of a high quality, the second's that of a low one.
BEST, WORST = "#2f9e44", "#a01220"
COLOURS = (BEST, WORST, "#4f7fb5", "#8a5ab0", "#555555")


def extreme_semi_axes(problem: Problem, grasp: Grasp, length_unit: float | None = None) -> tuple[float, float]:
    """Longest and shortest semi-axis of a grasp's manipulability ellipsoid.

    Args:
        problem: The problem.
        grasp: One of its grasps.
        length_unit: Unit of lengths in the object's velocity [m]; the problem's length scale by default.

    Returns:
        The two semi-axes [rad, or lengths in that unit, for a joint velocity of one].
    """
    unit = problem.length_scale if length_unit is None else length_unit
    axes = np.asarray(_core.semi_axes(problem.full_system, np.asarray(grasp.x)[None], unit))[0]
    regular = axes[-_connectivity(problem, unit) :]
    return float(regular[-1]), float(regular[0])


def _connectivity(problem: Problem, unit: float) -> int:
    """Number of the object's motions that are coordinated at x1."""
    at_x1 = np.asarray(_core.semi_axes(problem.full_system, problem.x1_array[None], unit))
    return max(1, int((at_x1 > 0.0).sum()))


def unit_of(problem: Problem, length_unit: float | None = None) -> str:
    """The unit of semi-axes in words: a radian, and the unit of length."""
    unit = problem.length_scale if length_unit is None else length_unit
    length = f"{1e3 * unit:g} mm"
    return f"rad, {'mm' if length == '1 mm' else length}"


def plot_ellipsoid(
    problem: Problem, grasps: Grasp | Mapping[str, Grasp], *, length_unit: float | None = None
) -> Picture:
    """Draw the manipulability ellipsoids of some grasps, projected on the plane of their extreme semi-axes.

    The ellipsoid holds the velocities that joint velocities of norm one give the object. Each is turned so that its
    longest semi-axis lies to the right and its shortest points up; the two directions have scales of their own.

    Args:
        problem: The problem.
        grasps: One grasp, or grasps by name: ``{"best": result.best, "worst": result.worst}``.
        length_unit: Unit of lengths in the object's velocity [m]; the problem's length scale by default.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If there is no grasp.

    Source: "Global Optimization of Robotic Grasps", Figs. 9 and 10.
    """
    named = {"grasp": grasps} if isinstance(grasps, Grasp) else dict(grasps)
    if not named:
        raise GraspAtlasError("plot_ellipsoid needs at least one grasp")
    with styled():
        figure = Picture(figsize=(COLUMN, 2.3))
        axes = figure.add_axes((0.19, 0.2, 0.78, 0.74))
        draw_ellipses(axes, problem, named, length_unit=length_unit)
        axes.set_xlabel(f"along the longest semi-axis [{unit_of(problem, length_unit)}]")
        axes.set_ylabel("along the shortest")
    return figure


def draw_ellipses(
    axes: Axes,
    problem: Problem,
    grasps: Mapping[str, Grasp],
    *,
    length_unit: float | None = None,
    equal: bool = False,
    colours: Sequence[str] | None = None,
) -> None:
    """Draw the ellipses of grasps by name into axes; `equal` draws both directions to one scale."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    lengths = [extreme_semi_axes(problem, grasp, length_unit) for grasp in grasps.values()]
    for (longest, shortest), name, colour in zip(lengths, grasps, cycle(colours or COLOURS), strict=False):
        x, y = longest * np.cos(turn), shortest * np.sin(turn)
        axes.fill(x, y, color=colour, alpha=0.16, lw=0.0)
        axes.plot(x, y, color=colour, lw=1.1, label=f"{name}: {readable(longest)}, {readable(shortest, 2)}")
    wide, high = (1.12 * max(1e-9, *column) for column in zip((0.0, 0.0), *lengths, strict=True))
    high = wide if equal else high * (1.0 if len(grasps) == 1 else 1.55)
    axes.set_xlim(-wide, wide)
    axes.set_ylim(-high / (1.0 if equal or len(grasps) == 1 else 1.38), high)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if equal:
        axes.set_aspect("equal")
    axes.axhline(0.0, color="#cfcfcf", lw=0.5, zorder=0)
    axes.axvline(0.0, color="#cfcfcf", lw=0.5, zorder=0)
    if len(grasps) > 1:
        axes.legend(loc="upper center", ncols=2, handlelength=1.2, columnspacing=1.2, borderpad=0.1)
