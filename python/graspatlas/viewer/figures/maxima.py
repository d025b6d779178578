"""Local maxima: where they lie on the atlas, and how many starts of a local optimiser end at each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from graspatlas.analysis.climb import Climb, climb
from graspatlas.analysis.peaks import Peak, local_maxima, peaks_of
from graspatlas.errors import GraspAtlasError
from graspatlas.quality.batched import quality_name
from graspatlas.result.result import Result
from graspatlas.viewer.figures.atlas import VIEWS, AtlasDrawing
from graspatlas.viewer.figures.style import INK, PAGE, Picture, readable, styled
from graspatlas.viewer.scene.polygons import Coordinates

__all__ = ["plot_climbs", "plot_local_maxima"]

#: Rows of a bar chart; what is beyond is summed up.
ROWS = 12
#: Colours of the bars: the peak to which the best chart leads, other peaks, and the rest.
HOME, ELSEWHERE, OTHERS = "#2f9e44", "#c9803a", "#bdbdbd"


def plot_local_maxima(result: Result, *, coordinates: Coordinates | None = None, label: str | None = None) -> Picture:
    """Draw an atlas with its local maxima, and how good they are.

    Args:
        result: The result.
        coordinates: Three coordinates to draw the atlas in; principal ones by default.
        label: Name of the index; its own by default.

    Returns:
        The figure.
    """
    drawing, best = AtlasDrawing(result, coordinates), result.best.chart
    maxima = local_maxima(result)
    name = label or quality_name(result.quality).replace("_", " ")
    with styled():
        figure = Picture(figsize=(PAGE, 3.1))
        axes = drawing.draw(figure, (0.0, 0.06, 0.475, 0.86), VIEWS[0])
        drawing.mark(axes, [int(c) for c in maxima[1:]], s=16.0)
        drawing.mark(axes, [best], marker="*", s=75.0)
        drawing.add_colour_bar(figure, (0.535, 0.2, 0.013, 0.6), name)
        words = f"{len(maxima)} local maxima among {result.atlas.n_charts} charts; star: the best"
        figure.text(0.25, 0.935, words, ha="center")
        bars = figure.add_axes((0.69, 0.15, 0.29, 0.75))
        values = result.qualities[maxima[:ROWS]]
        colours = drawing.scale.to_rgba(values) if drawing.scale is not None else None
        bars.barh(range(1, len(values) + 1), values, color=colours, edgecolor=INK, linewidth=0.4, height=0.72)
        _finish_bars(bars, len(values), name, isinstance(drawing.scale.norm, LogNorm) if drawing.scale else False)
        bars.set_ylabel("local maximum, best first" + (f" (first {ROWS})" if len(maxima) > ROWS else ""))
    return figure


def plot_climbs(
    result: Result, climbs: Sequence[Climb], *, from_best: Climb | None = None, label: str | None = None
) -> Picture:
    """Draw how many runs of the local optimiser ended at each peak of the index.

    The peak to which a climb from the best chart of the atlas leads is green, others are brown.

    Args:
        result: The result on which they climbed.
        climbs: What :func:`graspatlas.analysis.climb.climb` returned, one for each start.
        from_best: The climb from the best chart; it is made when not given.
        label: Name of the index; its own by default.

    Returns:
        The figure.

    Raises:
        GraspAtlasError: If there is no climb.
    """
    if not climbs:
        raise GraspAtlasError("plot_climbs needs at least one climb: climb(result, chart)")
    home = from_best or climb(result, result.best.chart)
    peaks = peaks_of(result, [*climbs, home])
    name = label or quality_name(result.quality).replace("_", " ")
    with styled():
        figure = Picture(figsize=(PAGE, 3.1))
        _draw_starts(figure, result, climbs, name)
        bars = figure.add_axes((0.66, 0.15, 0.32, 0.75))
        shown, others = _chosen(peaks, len(climbs))
        counts = [int((peak.climbs < len(climbs)).sum()) for peak in shown]
        labels = [_words(peak) for peak in shown]
        colours = [HOME if len(climbs) in peak.climbs else ELSEWHERE for peak in shown]
        if others:
            counts.append(len(climbs) - sum(counts))
            labels.append(f"{len(others)} others")
            colours.append(OTHERS)
        bars.barh(range(1, len(counts) + 1), counts, color=colours, edgecolor=INK, linewidth=0.4, height=0.72)
        for row, count in enumerate(counts, start=1):
            bars.text(count + 0.015 * max(counts), row, f"{count}", va="center", fontsize=7.0)
        _finish_bars(bars, len(counts), f"starts that end there, of {len(climbs)}", logarithmic=False)
        bars.set_xlim(0.0, 1.1 * max(counts))
        bars.set_yticks(range(1, len(counts) + 1), labels)
        bars.set_ylabel(f"{name} at the end")
        words = "green: where the best chart leads"
        if any(not peak.converged for peak in peaks):
            words += "; > : no maximum, or given up on the way"
        figure.text(0.98, 0.945, words, ha="right", fontsize=7.5)
    return figure


def _draw_starts(figure: Figure, result: Result, climbs: Sequence[Climb], name: str) -> None:
    """The index where the climbs started and where they ended."""
    axes = figure.add_axes((0.09, 0.15, 0.38, 0.75))
    starts, ends = (np.array([c.qualities[k] for c in climbs]) for k in (0, -1))
    best = result.best.quality
    axes.plot(starts, ends, ls="", marker="o", ms=2.6, mfc="#4f7fb5", mec="white", mew=0.25)
    axes.axhline(best, color="#2f9e44", lw=1.0, label="best chart of the atlas")
    if ends.min() > 0.0 and starts.min() > 0.0 and max(ends.max(), best) > 100.0 * float(np.median(starts)):
        axes.set_xscale("log")
        axes.set_yscale("log")
    axes.set_xlabel(f"{name} at the start")
    axes.set_ylabel("at the end of the climb")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderpad=0.0)


def _chosen(peaks: list[Peak], home: int) -> tuple[list[Peak], list[Peak]]:
    """Peaks that get a bar of their own, the one with climb number `home` among them, and the others."""
    most = sorted(peaks, key=lambda peak: (home not in peak.climbs, -len(peak.climbs)))[:ROWS]
    return [peak for peak in peaks if peak in most], [peak for peak in peaks if peak not in most]


def _words(peak: Peak) -> str:
    return readable(peak.quality, 4) if peak.converged else f"> {readable(peak.quality, 2)}"


def _finish_bars(axes: Axes, rows: int, label: str, logarithmic: bool) -> None:
    axes.set_ylim(rows + 0.6, 0.4)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if logarithmic:
        axes.set_xscale("log")
    else:
        axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel(label)
    axes.tick_params(axis="y", length=0.0)
