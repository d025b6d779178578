r"""How large a function may be within each chart, estimated from its values at the charts' centres alone.

A facet that neighbour j leaves on chart i bisects the way to j, so its offset and normal n say where j lies in the
tangent space of i: at :math:`u_{ij} = 2 \, \mathrm{offset} \, n`. The differences :math:`d_{ij} = f_j - f_i` give

.. math::

    g_i = \arg\min_g \sum_j \frac{(d_{ij} - g \cdot u_{ij})^2}{|u_{ij}|^2}, \qquad
    c_{ij} = 2 \, \frac{d_{ij} - g_i \cdot u_{ij}}{|u_{ij}|^2},

the slope, and the curvature along the way to each neighbour. With c- and c+, the smallest and the largest curvature at
the chart and its neighbours, the function is assumed to be nowhere within the chart more curved than c+ and once more
by as much as the curvature changes around there: C = max(0, c+ + (c+ - c-)). Neighbours on one side alone tilt the
slope, by h for each unit of curvature, with h the slope of :math:`|u|^2 / 2`. The estimate is

.. math::

    b_i = f_i + \max_{u \in P_i} \max_{c \in \{c_-, c_+\}} (g_i - c \, h_i) \cdot u + \tfrac{1}{2} C_i |u|^2

over the chart's polytope. What is maximised is convex, so the largest is at a vertex.

**It is an estimate and no proof.** Values at the centres know nothing of a spike that is narrower than a chart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.atlas.atlas import Atlas
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.validation import number_array

__all__ = ["estimate_upper_bounds"]

#: Directions to the neighbours must spread: the smallest eigenvalue of the sum of e e', over unit vectors e to them.
LEAST_SPREAD = 0.1


@dataclass(frozen=True)
class _Ways:
    """The ways from charts to the neighbours with which they share a facet; those of a chart lie together.

    Attributes:
        start: First facet of each chart [n].
        i, j: The chart of each facet and its neighbour [f]; the chart itself where the facet is of no neighbour.
        leads: Which facets are those of a neighbour [f].
        u: Where the neighbour is in the tangent space of the chart [f, k].
        squared, weights: |u|^2, and its inverse [f]; 0 where the facet is of no neighbour.
    """

    start: IntArray
    i: IntArray
    j: IntArray
    leads: BoolArray
    u: Array
    squared: Array
    weights: Array

    @classmethod
    def of(cls, atlas: Atlas) -> _Ways:
        i = np.repeat(np.arange(atlas.n_charts), np.diff(atlas.facet_start))
        leads = atlas.facet_tags >= 0
        u = np.where(leads[:, None], 2.0 * atlas.facet_offsets[:, None] * atlas.facet_normals, 0.0)
        squared = np.einsum("fk,fk->f", u, u)
        weights = np.divide(1.0, squared, out=np.zeros_like(squared), where=squared > 0.0)
        return cls(atlas.facet_start[:-1], i, np.where(leads, atlas.facet_tags, i), leads, u, squared, weights)

    def sums(self, values: Array) -> Array:
        """Sum over the facets of each chart [n, ...] of values [f, ...]."""
        return np.asarray(np.add.reduceat(values, self.start, axis=0))

    def counts(self, flags: BoolArray | bool = True) -> IntArray:
        """How many ways from each chart have a flag [n], of flags [f]."""
        return np.asarray(np.add.reduceat((self.leads & flags).astype(np.int64), self.start))

    def largest(self, values: Array) -> Array:
        """Largest over the ways from each chart [n] of values [f]; -inf where it has none."""
        return np.asarray(np.maximum.reduceat(np.where(self.leads, values, -np.inf), self.start))

    def largest_around(self, values: Array) -> Array:
        """Largest over each chart and its neighbours [n] of values [n]."""
        return np.maximum(values, self.largest(values[self.j]))


def estimate_upper_bounds(atlas: Atlas, values: ArrayLike) -> Array:
    """Estimate how large a function may be within each chart, from its values at the centres of it and its neighbours.

    The formulas stand at the top of :mod:`graspatlas.atlas.upper_bounds`. It is an estimate, not proved: it holds for
    functions whose curvature changes between neighbouring charts by no more than it has changed around them. Of the
    charts of all bundled problems one in some thousands holds a sample above it.

    Args:
        atlas: Any atlas.
        values: The function at the charts' centres [n].

    Returns:
        One number a chart, not below its value [n]; infinite where there are too few neighbours to tell, or the chart
        or a neighbour has a value that is not finite.

    Raises:
        GraspAtlasError: If there is not one number a chart, or one is NaN.
    """
    f = number_array(values, "values")
    if f.shape != (atlas.n_charts,) or np.isnan(f).any():
        what = "NaN among them" if f.shape == (atlas.n_charts,) else f"shape {f.shape}"
        raise GraspAtlasError(f"values must be {atlas.n_charts} numbers, one a chart, got {what}")
    ways = _Ways.of(atlas)
    finite = np.isfinite(f)
    known = finite & (ways.counts(~finite[ways.j]) == 0)
    f = np.where(finite, f, 0.0)
    with np.errstate(over="ignore", invalid="ignore"):  # of values near the largest number
        d = f[ways.j] - f[ways.i]
        slopes, enough = _slopes(ways, np.column_stack([d, 0.5 * ways.squared]))
        g, h = slopes[..., 0], slopes[..., 1]
        curved = 2.0 * (d - np.einsum("fk,fk->f", ways.u, g[ways.i])) * ways.weights
        # As many neighbours as dimensions are met exactly, and say nothing of the curvature.
        tells = known & enough & (ways.counts() > atlas.dimension)
        high = ways.largest_around(np.where(tells, ways.largest(curved), -np.inf))
        low = -ways.largest_around(np.where(tells, ways.largest(-curved), -np.inf))
        known &= enough & np.isfinite(high)
        bounds = f + _largest_rise(atlas, g, h, np.where(known, low, 0.0), np.where(known, high, 0.0))
    return np.where(known & np.isfinite(bounds), bounds, np.inf)


def _slopes(ways: _Ways, differences: Array) -> tuple[Array, BoolArray]:
    """Slopes [n, k, c] that fit differences [f, c] best, and where the neighbours spread enough for it [n]."""
    weighted = ways.weights[:, None] * ways.u
    matrices = ways.sums(weighted[:, :, None] * ways.u[:, None, :])
    sides = ways.sums(weighted[:, :, None] * differences[:, None, :])
    enough = np.linalg.eigvalsh(matrices)[:, 0] >= LEAST_SPREAD
    matrices[~enough] = np.eye(ways.u.shape[1])
    return np.asarray(np.linalg.solve(matrices, sides), float), enough


def _largest_rise(atlas: Atlas, g: Array, h: Array, low: Array, high: Array) -> Array:
    """Largest rise over each chart [n], for slopes g and their tilts h [n, k] and curvatures [n].

    Over its polytope, or over the ball of its radius where the atlas does not hold all vertices of that.
    """
    if not atlas.lists_all_vertices:
        steepest = np.linalg.norm(g, axis=1) + np.maximum(abs(low), abs(high)) * np.linalg.norm(h, axis=1)
        bend = 0.5 * np.maximum(0.0, high + (high - low)) * atlas.radius**2
        return np.asarray(atlas.radius * steepest + bend)
    chart = np.repeat(np.arange(atlas.n_charts), np.diff(atlas.vertex_start))
    v = atlas.vertices
    along, tilt = np.einsum("vk,vk->v", v, g[chart]), np.einsum("vk,vk->v", v, h[chart])
    tilted = np.maximum(-low[chart] * tilt, -high[chart] * tilt)
    curvature = np.maximum(0.0, high + (high - low))
    rises = along + tilted + 0.5 * curvature[chart] * np.einsum("vk,vk->v", v, v)
    return np.asarray(np.maximum.reduceat(rises, atlas.vertex_start[:-1]))
