"""Polygons in three-dimensional axes: what all pictures of an atlas share."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axis3d import Axis

from graspatlas.support.arrays import Array, BoolArray
from graspatlas.viewer.figures.style import INK, QUALITY, REJECTED, SINGULAR
from graspatlas.viewer.scene.polygons import Coordinates

__all__ = ["Place", "View", "add_axes", "add_polygons", "quality_colours", "scale_of"]


#: Largest over median quality from which the colour scale is logarithmic.
WIDE = 100.0
#: Percentiles of the qualities at the ends of a logarithmic scale.
CLIPPED = (1.0, 99.0)
#: Share of their place that the axes fill; the rest is for letters.
FILLED = 0.81
#: Share of an axis at either end that carries no tick, so that the numbers of two axes do not meet.
CORNER = 0.06
#: Smallest share of its length that the box round an atlas is high or wide.
FLATTEST = 0.35
#: Elevation and azimuth of the eye [degrees].
View = tuple[float, float]
#: Left, bottom, width and height as shares of a figure.
Place = tuple[float, float, float, float]


def scale_of(values: Array, singular: float, logarithmic: bool | None) -> ScalarMappable:
    """Colour scale up to the largest quality; a logarithmic one spans all but the last percents at either end.

    Args:
        values: Qualities [n].
        singular: Grasps with less are singular.
        logarithmic: Whether the scale is; by default when the largest quality is a hundred times the median.
    """
    regular = values[values >= singular]
    regular = regular if regular.size else values
    low, high = float(regular.min()), float(regular.max())
    if logarithmic is None:
        logarithmic = low > 0.0 and high > WIDE * float(np.median(regular))
    if logarithmic and low > 0.0:
        low, high = (float(value) for value in np.percentile(regular, CLIPPED))
    high = high if high > low else low + 1.0
    norm = LogNorm(low, high) if logarithmic and low > 0.0 else Normalize(min(low, 0.0), high)
    return ScalarMappable(norm=norm, cmap=QUALITY)


def quality_colours(values: Array, scale: ScalarMappable, singular: float, rejected: BoolArray) -> Array:
    """Colours of qualities [n, 4]: red to green, black when singular, and grey when rejected."""
    colours = np.asarray(scale.to_rgba(values))
    colours[values < singular] = to_rgba(SINGULAR)
    colours[rejected] = to_rgba(REJECTED)
    return colours


def add_axes(figure: Figure, place: Place, coordinates: Coordinates, points: Array, view: View) -> Axes3D:
    """Axes for an atlas: upright, without perspective, to scale when the coordinates have one unit.

    Args:
        figure: The figure.
        place: Left, bottom, width and height as shares of the figure; filled but for the letters at the axes.
        coordinates: What the axes show.
        points: Points that must be visible [n, 3].
        view: Elevation and azimuth of the eye [degrees].
    """
    low, high, box = _limits(coordinates, points)
    inches = figure.get_size_inches()
    width, height = place[2] * inches[0], place[3] * inches[1]
    side = max(width, height)
    middle = np.array([place[0] + place[2] / 2.0, place[1] + place[3] / 2.0])
    corner = middle - side / inches / 2.0
    axes: Axes3D = figure.add_axes((*corner, *(side / inches)), projection="3d", computed_zorder=False)
    axes.set_proj_type("ortho")
    axes.view_init(elev=view[0], azim=view[1])
    reach = _reach(box, view)
    axes.set_box_aspect(box, zoom=float(min(width / reach[0], height / reach[1])) * FILLED / side)
    axes.patch.set_visible(False)
    ends = zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", low, high, coordinates.labels, strict=True)
    for axis, name, a, b, label in ends:
        getattr(axes, f"set_{name}lim")(a, b)
        ticks = MaxNLocator(4).tick_values(a, b)
        axis.set_ticks([t for t in ticks if a + CORNER * (b - a) < t < b - CORNER * (b - a)])
        _style(axis, label)
    return axes


def _limits(coordinates: Coordinates, points: Array) -> tuple[Array, Array, Array]:
    """Lowest and highest corner of the box round points [3 each], and its shape [3]."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-3 * float((high - low).max()) + 1e-12)
    if not coordinates.equal:
        return low, low + size, np.ones(3)
    box = np.maximum(size / size.max(), FLATTEST)
    middle, half = (low + high) / 2.0, box * size.max() / 2.0
    return middle - half, middle + half, box


def _reach(box: Array, view: View) -> Array:
    """Half width and half height of a box as seen, when matplotlib draws it with zoom 1 into axes of half width 1."""
    elevation, azimuth = np.radians(view)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.array([-np.sin(elevation) * np.cos(azimuth), -np.sin(elevation) * np.sin(azimuth), np.cos(elevation)])
    size = box / np.linalg.norm(box)
    return np.array([np.abs(right) @ size, np.abs(up) @ size])


def _style(axis: Axis, label: str) -> None:
    axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    axis.line.set_color(INK)
    axis.line.set_linewidth(0.6)
    axis._axinfo["grid"].update(color="#dcdcdc", linewidth=0.4)
    axis._axinfo["tick"].update(inward_factor=0.0, outward_factor=0.15)
    axis.set_label_text(label)
    axis.labelpad = -1.5
    axis.set_tick_params(pad=-1.8, labelsize=6.5)


def add_polygons(axes: Axes3D, polygons: list[Array], colours: Array | str, edge: float = 0.25) -> None:
    """Lay polygons into axes, nearer ones over farther ones.

    Args:
        axes: The axes.
        polygons: Corners of each [v, 3].
        colours: One colour, or one for each [n, 4].
        edge: Width of their edges [points].
    """
    faces = Poly3DCollection(polygons, facecolors=colours, edgecolors=(0.1, 0.1, 0.1, 0.55), linewidths=edge, zorder=2)
    axes.add_collection3d(faces)
