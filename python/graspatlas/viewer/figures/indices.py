"""The three indices of the paper on one planar atlas, with grasps that stand for it: the paper's Fig. 9."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from matplotlib.figure import Figure

from graspatlas.analysis.peaks import local_maxima
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import batched, quality_name
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array
from graspatlas.viewer.figures.atlas import VIEWS, AtlasDrawing
from graspatlas.viewer.figures.ellipse import draw_ellipses, extreme_semi_axes, unit_of
from graspatlas.viewer.figures.planar import draw_planar_grasp, require_planar
from graspatlas.viewer.figures.style import PAGE, Picture, readable, styled
from graspatlas.viewer.scene.polygons import Coordinates, principal

__all__ = ["SINGULAR_BELOW", "in_units", "plot_planar_indices", "with_index"]


#: A grasp is singular when its index is smaller; lengths in the problem's length scale (the paper, Section V).
SINGULAR_BELOW = {"inverse_condition_number": 1e-3, "manipulability_volume": 1e-4, "smallest_semi_axis": 1e-3}


def in_units(name: str, length_unit: float) -> Callable[[Grasps], Array]:
    """A bundled index with lengths in another unit than millimetres.

    Args:
        name: Such as ``"manipulability_volume"``.
        length_unit: The unit [m].
    """
    bundled: Callable[..., Array] = INDICES[name]

    @batched
    def index(grasps: Grasps) -> Array:
        return bundled(grasps, length_unit=length_unit)

    index.__name__ = name
    return index


def with_index(result: Result, name: str, length_unit: float | None = None) -> Result:
    """The same atlas with another bundled index, lengths in the problem's length scale unless told otherwise."""
    index = in_units(name, result.problem.length_scale if length_unit is None else length_unit)
    grasps = Grasps(result.problem, result.atlas.centers, result.system)
    return replace(result, quality=index, qualities=evaluate(index, grasps))


def plot_planar_indices(result: Result, *, coordinates: Coordinates | None = None) -> Picture:
    """Draw a planar atlas with three indices, from above and from below, and three grasps that stand for it.

    The grasps are the best, the worst and a local maximum of the inverse condition number, each with its manipulability
    ellipsoid on the plane of the longest and the shortest semi-axis. Singular charts are black, by the paper's
    thresholds. Lengths are in units of the problem's length scale.

    Args:
        result: A result of a planar problem, k = 2; its own index plays no part.
        coordinates: Three coordinates to draw the atlas in; principal ones by default.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If the problem is not planar, or its atlas is no surface.

    Source: "Global Optimization of Robotic Grasps", Fig. 9.
    """
    require_planar(result.problem)
    chosen = coordinates or principal(result.atlas)
    rows = [with_index(result, name) for name in SINGULAR_BELOW]
    with styled():
        figure = Picture(figsize=(PAGE, 7.7))
        for number, (row, letter) in enumerate(zip(rows, "abc", strict=True)):
            _draw_index(figure, row, chosen, 0.667 - 0.325 * number, f"({letter})")
        _draw_insets(figure, rows[0])
        for x, words in ((0.395, "from above"), (0.72, "from below")):
            figure.text(x, 0.983, words, ha="center")
    return figure


def _draw_index(figure: Figure, result: Result, coordinates: Coordinates, bottom: float, letter: str) -> None:
    name = quality_name(result.quality)
    drawing = AtlasDrawing(result, coordinates, singular=SINGULAR_BELOW[name])
    n_singular = int((result.qualities < SINGULAR_BELOW[name]).sum())
    for number, view in enumerate(VIEWS):
        axes = drawing.draw(figure, (0.24 + 0.325 * number, bottom, 0.31, 0.3), view)
        drawing.mark(axes, [result.best.chart], marker="*", s=55.0)
        drawing.mark(axes, [int(c) for c in local_maxima(result)[1:]], s=9.0)
    drawing.add_colour_bar(figure, (0.93, bottom + 0.055, 0.011, 0.18))
    words = f"{letter} {name.replace('_', ' ')}; star: best, circles: other local maxima; {n_singular} singular (black)"
    figure.text(0.575, bottom - 0.008, words, ha="center", fontsize=8.0)


def _draw_insets(figure: Figure, result: Result) -> None:
    """Best, worst and a local maximum, one below the other."""
    maxima = local_maxima(result)
    charts = [int(maxima[0]), result.worst.chart, int(maxima[min(1, len(maxima) - 1)])]
    names = ("best", "worst", "local maximum")
    grasps = [result.grasp(chart) for chart in charts]
    longest = max(extreme_semi_axes(result.problem, grasp)[0] for grasp in grasps)
    for number, (name, grasp) in enumerate(zip(names, grasps, strict=True)):
        bottom = 0.667 - 0.325 * number
        axes = figure.add_axes((0.01, bottom + 0.1, 0.235, 0.2))
        draw_planar_grasp(axes, result.problem, grasp, thickness=0.9)
        axes.set_axis_off()
        figure.text(0.13, bottom + 0.298, f"{name}: {readable(grasp.quality)}", ha="center", fontsize=8.0)
        _draw_inset_ellipse(figure, result, grasp, bottom, longest, last=number == 2)


def _draw_inset_ellipse(
    figure: Figure, result: Result, grasp: Grasp, bottom: float, longest: float, *, last: bool
) -> None:
    axes = figure.add_axes((0.055, bottom + 0.03, 0.16, 0.06))
    draw_ellipses(axes, result.problem, {"": grasp}, equal=True)
    axes.set_xlim(-1.1 * longest, 1.1 * longest)
    axes.set_ylim(-0.42 * longest, 0.42 * longest)
    axes.tick_params(labelsize=6.0, length=2.0)
    if last:
        axes.set_xlabel(f"semi-axes [{unit_of(result.problem)}]", fontsize=7.0, labelpad=1.5)
