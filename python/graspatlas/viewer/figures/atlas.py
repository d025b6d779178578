"""Pictures of an atlas: its charts as polygons, coloured by quality; and its growth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import ArrayLike

from graspatlas.atlas.atlas import Atlas
from graspatlas.errors import GraspAtlasError
from graspatlas.quality.batched import quality_name
from graspatlas.result.result import Result
from graspatlas.support.arrays import Array
from graspatlas.viewer.figures.drawing.surface import Place, View, add_axes, add_polygons, quality_colours, scale_of
from graspatlas.viewer.figures.style import BLUE, INK, PAGE, RED, REJECTED, SINGULAR, Picture, styled
from graspatlas.viewer.scene.polygons import Coordinates, chart_polygons, default_coordinates, open_charts

__all__ = ["VIEWS", "AtlasDrawing", "plot_atlas", "plot_growth"]


#: Elevation and azimuth of the views from above and from below [degrees].
VIEWS = ((28.0, -58.0), (-28.0, -58.0))


class AtlasDrawing:
    """An atlas ready to be drawn into axes: polygons where it is a surface, else the chart centres.

    Args:
        source: A result, or an atlas.
        coordinates: Three coordinates to draw it in; chosen by the source when not given.
        values: One number for each chart, by which it is coloured [n]; the qualities of a result by default.
        singular: Charts with less are black.
        logarithmic: Whether the colour scale is logarithmic; chosen by the values when not given.
    """

    def __init__(
        self,
        source: Result | Atlas,
        coordinates: Coordinates | None = None,
        values: ArrayLike | None = None,
        singular: float = 0.0,
        logarithmic: bool | None = None,
    ) -> None:
        if not isinstance(source, Result | Atlas):
            raise GraspAtlasError(f"source must be a graspatlas.Result or an Atlas, got {type(source).__name__}")
        self.atlas = source.atlas if isinstance(source, Result) else source
        self.coordinates = coordinates or default_coordinates(self.atlas)
        self.name = quality_name(source.quality).replace("_", " ") if isinstance(source, Result) else "value"
        self.singular = singular
        self.values = self._checked(values if values is not None or isinstance(source, Atlas) else source.qualities)
        self.centers = self.coordinates.of(self.atlas.centers)
        self.rejected = np.zeros(self.atlas.n_charts, bool)
        if isinstance(source, Result) and values is None:
            self.rejected = ~source.accepted
        self.polygons = chart_polygons(self.atlas, self.coordinates) if self.atlas.dimension == 2 else None
        self.scale = None
        if self.values is not None:
            shown = self.values if self.rejected.all() else self.values[~self.rejected]
            self.scale = scale_of(shown, singular, logarithmic)

    def _checked(self, values: ArrayLike | None) -> Array | None:
        if values is None:
            return None
        array = np.asarray(values, float)
        if array.shape != (self.atlas.n_charts,) or not np.isfinite(array).all():
            raise GraspAtlasError(
                f"values must be {self.atlas.n_charts} finite numbers, one for each chart; got shape {array.shape}"
            )
        return array

    def draw(self, figure: Figure, place: Place, view: View) -> Axes3D:
        """Draw the atlas into new axes of a figure; see :func:`graspatlas.viewer.figures.drawing.surface.add_axes`."""
        points = np.concatenate(self.polygons) if self.polygons else self.centers
        axes = add_axes(figure, place, self.coordinates, points, view)
        colours: Array | str = BLUE
        if self.values is not None and self.scale is not None:
            colours = quality_colours(self.values, self.scale, self.singular, self.rejected)
        if self.polygons:
            add_polygons(axes, self.polygons, colours, edge=0.25 if len(self.polygons) < 3000 else 0.12)
        else:
            axes.scatter(*self.centers.T, c=colours, s=1.2, linewidths=0.0, zorder=2, depthshade=False)
        return axes

    def mark(self, axes: Axes3D, charts: Sequence[int], **style: str | float) -> None:
        """Mark charts by symbols that nothing hides."""
        options = {"marker": "o", "s": 22.0, "facecolors": "white", "edgecolors": INK, "linewidths": 0.8}
        axes.scatter(*self.centers[list(charts)].T, zorder=5, depthshade=False, **(options | style))

    def add_colour_bar(
        self,
        figure: Figure,
        place: Place,
        label: str | None = None,
        orientation: str = "vertical",
    ) -> None:
        """Add the colour bar; `place` is left, bottom, width and height as shares of the figure."""
        if self.scale is None:
            return
        extend = "both" if isinstance(self.scale.norm, LogNorm) else "neither"
        bar = figure.colorbar(self.scale, cax=figure.add_axes(place), extend=extend, orientation=orientation)
        bar.outline.set_linewidth(0.5)
        bar.set_label(label or self.name, fontsize=8.0)
        bar.ax.tick_params(labelsize=6.5, length=2.0, pad=2.0)


def plot_atlas(
    source: Result | Atlas,
    *,
    values: ArrayLike | None = None,
    coordinates: Coordinates | None = None,
    singular: float = 0.0,
    logarithmic: bool | None = None,
    label: str | None = None,
) -> Picture:
    """Draw an atlas from above and from below, one polygon a chart, from red (low quality) to green (high quality).

    A surface (k = 2) is drawn by polygons; of other atlases the chart centres are drawn.

    Args:
        source: A result, or an atlas.
        values: One number for each chart [n]; the qualities of a result by default.
        coordinates: Three coordinates to draw it in: see :mod:`graspatlas.viewer.scene.polygons`. By default x
            itself when it has three numbers, else principal coordinates.
        singular: Charts with a smaller value are black.
        logarithmic: Whether the colour scale is logarithmic; by default when the largest value is a hundred times the
            median.
        label: What stands at the colour bar; the name of the index by default.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If the source is neither, or the values have another shape.

    Source: "Global Optimization of Robotic Grasps", Fig. 9.
    """
    drawing = AtlasDrawing(source, coordinates, values, singular, logarithmic)
    best = source.best.chart if isinstance(source, Result) and values is None else None
    with styled():
        figure = Picture(figsize=(PAGE, 2.8))
        for number, (view, title) in enumerate(zip(VIEWS, ("from above", "from below"), strict=True)):
            axes = drawing.draw(figure, (0.005 + 0.44 * number, 0.04, 0.42, 0.86), view)
            figure.text(0.215 + 0.44 * number, 0.945, title, ha="center")
            if best is not None:
                drawing.mark(axes, [best], marker="*", s=70.0)
        drawing.add_colour_bar(figure, (0.915, 0.2, 0.013, 0.6), label)
        _add_legend(figure, drawing, with_best=best is not None)
    return figure


def plot_growth(stages: Sequence[Atlas], *, coordinates: Coordinates | None = None) -> Picture:
    """Draw stages of an atlas' growth: charts under expansion in red, bounded ones in blue.

    Stages are atlases of one system from one first point, cut short by ``max_charts``::

        stages = [ga.build_atlas(system, x0, radius=0.3, epsilon=0.2, max_charts=n) for n in (20, 60, 10000)]

    Args:
        stages: Atlases of dimension 2.
        coordinates: Three coordinates to draw them in; those of the last stage by default.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If there is no stage, or one is no surface.

    Source: "Global Optimization of Robotic Grasps", Fig. 7.
    """
    if not stages:
        raise GraspAtlasError("plot_growth needs at least one atlas")
    chosen = coordinates or default_coordinates(stages[-1])
    drawn = [chart_polygons(atlas, chosen) for atlas in stages]
    points = np.concatenate([corners for polygons in drawn for corners in polygons])
    with styled():
        figure = Picture(figsize=(PAGE, 0.45 + PAGE / max(3, len(stages))))
        for number, (atlas, polygons) in enumerate(zip(stages, drawn, strict=True)):
            width = 1.0 / len(stages)
            place = (number * width, 0.13, width - 0.025, 0.78)
            axes = add_axes(figure, place, chosen, points, VIEWS[0])
            is_open = open_charts(atlas)
            add_polygons(axes, polygons, np.where(is_open, RED, BLUE), edge=0.35)
            state = "complete" if atlas.complete else f"{int(is_open.sum())} under expansion"
            figure.text((number + 0.5) * width, 0.945, f"{atlas.n_charts} charts, {state}", ha="center")
        handles = [Patch(facecolor=RED, label="under expansion"), Patch(facecolor=BLUE, label="bounded")]
        figure.legend(handles=handles, loc="lower center", ncols=2)
    return figure


def _add_legend(figure: Figure, drawing: AtlasDrawing, *, with_best: bool) -> None:
    """Say what star, black and grey stand for, where they occur."""
    marks: list[Artist] = []
    if with_best:
        marks.append(Line2D([], [], ls="none", marker="*", ms=8.0, mfc="white", mec=INK, mew=0.8, label="best"))
    if drawing.values is not None and (drawing.values < drawing.singular).any():
        marks.append(Patch(facecolor=SINGULAR, label="singular"))
    if drawing.rejected.any():
        marks.append(Patch(facecolor=REJECTED, label="requirements not met"))
    if marks:
        figure.legend(handles=marks, loc="lower center", bbox_to_anchor=(0.44, 0.0), ncols=3, columnspacing=1.4)
