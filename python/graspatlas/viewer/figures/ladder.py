"""What each freedom of the hand is worth: the best grasp over k, with the size and the time of each rung."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

from graspatlas.optimizer.ladder_outcome import Ladder
from graspatlas.optimizer.rungs import Rung
from graspatlas.viewer.figures.style import BLUE, INK, PAGE, RED, Picture, readable, styled

__all__ = ["plot_ladder"]

#: Largest over smallest value from which an axis is logarithmic, when all values are positive.
WIDE = 30.0


def plot_ladder(ladder: Ladder) -> Picture:
    """Draw a ladder: the best chart and the refined best over k, and below them charts, time, and the motion freed.

    Hollow symbols are rungs whose atlas was cut short.

    Args:
        ladder: What :func:`graspatlas.ladder` found.

    Returns:
        The figure.
    """
    with styled():
        figure = Picture(figsize=(PAGE, 3.7))
        axes = figure.add_axes((0.1, 0.33, 0.87, 0.53))
        _draw_values(axes, ladder)
        _write_rungs(axes, ladder)
        figure.text(0.1, 0.95, ladder.problem.name.replace("_", " "), ha="left", va="center", fontsize=9.0)
        figure.text(0.1, 0.905, ladder.answer, ha="left", va="center", fontsize=7.5, style="italic")
    return figure


def _draw_values(axes: Axes, ladder: Ladder) -> None:
    """The two lines, and their values."""
    drawn = [("best chart", BLUE, "s", [(r, r.best) for r in ladder.rungs])]
    if ladder.refined:
        drawn.append(("refined", RED, "o", [(r, r.refined) for r in ladder.rungs]))
    everything = [value for *_, pairs in drawn for _, value in pairs if value is not None]
    for name, colour, marker, pairs in drawn:
        held = [(rung.dimension, value) for rung, value in pairs if value is not None]
        axes.plot(*zip(*held, strict=True) if held else ((), ()), color=colour, lw=1.0, zorder=2)
        for rung, value in pairs:
            if value is not None:
                face = colour if rung.complete else "white"
                axes.plot(rung.dimension, value, marker, mfc=face, mec=colour, ms=5.0, mew=1.0, zorder=3)
        axes.plot([], [], f"{marker}-", color=colour, ms=5.0, label=name)
    for rung in ladder.rungs:
        if rung.value is not None:
            axes.annotate(
                readable(rung.value),
                (rung.dimension, rung.value),
                (0, 7),
                textcoords="offset points",
                ha="center",
                bbox={"fc": "white", "ec": "none", "pad": 0.6},
                zorder=4,
            )
    if everything and min(everything) > 0.0 and max(everything) > WIDE * min(everything):
        axes.set_yscale("log")
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.margins(y=0.2)
    if any(not rung.complete for rung in ladder.rungs):
        axes.plot([], [], "o", mfc="white", mec=INK, ms=5.0, label="hollow: cut short")
    axes.set_ylabel(ladder.quality.replace("_", " "))
    axes.legend(loc="upper left")


def _write_rungs(axes: Axes, ladder: Ladder) -> None:
    """What stands under each k: charts, radius, seconds, and the motion freed."""
    ks = list(ladder.dimensions)
    axes.set_xlim(min(ks) - 0.5, max(ks) + 0.5)
    done = {rung.dimension: rung for rung in ladder.rungs}
    axes.set_xticks(ks, [_words(done[k]) if k in done else f"k = {k}\nnot begun" for k in ks])
    axes.tick_params(axis="x", length=0.0, labelsize=6.5 if len(ks) > 5 else 7.5)


def _words(rung: Rung) -> str:
    atlas, motion = rung.result.atlas, rung.motion
    lines = [f"k = {rung.dimension}", f"{atlas.n_charts:,} charts", f"r = {atlas.radius:.3g}", f"{rung.seconds:.2g} s"]
    if motion is not None:
        lines.append(f"frees motion {motion.number}")
        if motion.variance_share is not None:
            lines.append(f"{100.0 * motion.variance_share:.2g} % of variance")
        lines += [f"mostly {name.replace('_', ' ')}" for name in list(motion.joints)[:1]]
    return "\n".join(lines)
