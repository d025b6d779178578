"""An atlas between its worst and its best grasp: the paper's Fig. 10."""

from __future__ import annotations

from matplotlib.figure import Figure

from graspatlas.result.result import Result
from graspatlas.viewer.figures.atlas import VIEWS, AtlasDrawing
from graspatlas.viewer.figures.ellipse import BEST, WORST, draw_ellipses, extreme_semi_axes, unit_of
from graspatlas.viewer.figures.planar import draw_planar_grasp
from graspatlas.viewer.figures.portrait import common_direction, portrait
from graspatlas.viewer.figures.style import PAGE, Picture, readable, styled
from graspatlas.viewer.scene.polygons import Coordinates

__all__ = ["plot_best_and_worst"]

#: Ellipses whose longest semi-axes differ by more are not drawn to one scale.
ONE_SCALE = 20.0
#: Pixels of a portrait.
PORTRAIT = (520, 620)


def plot_best_and_worst(
    result: Result,
    *,
    coordinates: Coordinates | None = None,
    singular: float = 0.0,
    label: str | None = None,
) -> Picture:
    """Draw a result: its worst grasp, the atlas coloured by quality, and its best grasp.

    Below the grasps are their manipulability ellipsoids, on the plane of the longest and the shortest semi-axis.

    Args:
        result: The result.
        coordinates: Three coordinates to draw the atlas in; principal ones by default.
        singular: Charts with a smaller quality are black.
        label: What stands at the colour bar; the name of the index by default.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If a mesh of the hand or the object cannot be read.

    Source: "Global Optimization of Robotic Grasps", Fig. 10.
    """
    drawing = AtlasDrawing(result, coordinates, singular=singular)
    with styled():
        figure = Picture(figsize=(PAGE, 4.1))
        axes = drawing.draw(figure, (0.28, 0.2, 0.405, 0.76), VIEWS[0])
        drawing.mark(axes, [result.best.chart], marker="*", s=70.0)
        drawing.mark(axes, [result.worst.chart], marker="v", s=26.0)
        drawing.add_colour_bar(figure, (0.36, 0.135, 0.28, 0.018), label, orientation="horizontal")
        _draw_grasps(figure, result)
        figure.text(0.5, 0.955, f"{result.atlas.n_charts} charts; star: best, triangle: worst", ha="center")
        if drawing.rejected.any():
            figure.text(0.5, 0.915, f"grey: {int(drawing.rejected.sum())} rejected", ha="center", fontsize=8.0)
    return figure


def _draw_grasps(figure: Figure, result: Result) -> None:
    problem = result.problem
    grasps = {"worst": result.worst, "best": result.best}
    planar = problem.object_joint_model.planar
    direction = None if planar else common_direction(problem, list(grasps.values()))
    lengths = [extreme_semi_axes(problem, grasp)[0] for grasp in grasps.values()]
    to_scale = max(lengths) <= ONE_SCALE * min(lengths)
    panels = []
    for (name, grasp), left in zip(grasps.items(), (0.0, 0.725), strict=True):
        axes = figure.add_axes((left, 0.33, 0.275, 0.61))
        if planar:
            draw_planar_grasp(axes, problem, grasp)
        else:
            axes.imshow(portrait(problem, grasp, direction=direction, width=PORTRAIT[0], height=PORTRAIT[1]))
        axes.set_axis_off()
        figure.text(left + 0.1375, 0.955, f"{name} grasp: {readable(grasp.quality)}", ha="center")
        panel = figure.add_axes((left + 0.07, 0.12, 0.19, 0.17))
        draw_ellipses(panel, problem, {"": grasp}, colours=[BEST if name == "best" else WORST])
        panel.set_xlabel(f"longest semi-axis [{unit_of(problem)}]", fontsize=7.0, labelpad=1.5)
        panel.set_ylabel("shortest", fontsize=7.0, labelpad=1.5)
        panel.tick_params(labelsize=6.5, length=2.0)
        panels.append(panel)
    for panel in panels:
        if not to_scale:
            panel.set_title("own scale", fontsize=7.0, pad=2.0, loc="right", style="italic")
        else:
            panel.set_xlim(*max((p.get_xlim() for p in panels), key=lambda ends: ends[1]))
            panel.set_ylim(*max((p.get_ylim() for p in panels), key=lambda ends: ends[1]))
