r"""Curves on a manifold, as short as they can be: from any chain of points to a shortest one between its ends.

A chain :math:`x_0, \dots, x_n` on the manifold has the energy

.. math:: E = \tfrac12 \sum_i \| x_{i+1} \ominus x_i \|^2 ,

least when the chain is a geodesic with even steps. Gauss-Newton steps in the tangent spaces at all points at once,
:math:`x_i \leftarrow x_i \oplus \Phi_i^\top u_i` and back to the manifold, lower it: one banded system a step. Bounds
are half-spaces :math:`C u \le S` of each tangent space, kept by an interior-point method. Points that would leave what
is allowed, a black box, are given half-spaces too, found by asking, and the move is planned again.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from graspatlas.support.arrays import Array
from graspatlas.support.progress import progress_bar
from graspatlas.systems.chain import Allowed, Chain, HalfSpaces
from graspatlas.systems.system import AnySystem
from graspatlas.systems.tangent_maps import point_above, tangent_bases

__all__ = ["arc_lengths", "bridge", "evenly", "shorten"]


#: Even steps are planned this much shorter than the longest, for want of an even speed along a chain.
UNEVEN = 1e-3
#: Largest share of a step that one of its halves may have; a step that does not shrink leads to another sheet.
HALF = 0.75
#: Halvings after which a gap counts as one that cannot be bridged.
MAX_HALVINGS = 24
#: Steps of Gauss-Newton after which the chain is left as it is, and the relative gain that ends them before.
MAX_STEPS = 60
LEAST_GAIN = 2e-6
#: Gain that ends them where a black box limits the chain: what follows is slow and small.
LEAST_GAIN_LIMITED = 1e-5
#: Shares of a move that are tried, and rounds in which half-spaces are learned.
FRACTIONS = (1.0, 0.5, 0.25, 0.1)
ROUNDS = 3


def arc_lengths(system: AnySystem, X: Array) -> Array:
    """Length of the chain from its first point to each point [n], units of the tangent space."""
    steps = [float(np.linalg.norm(system.difference(a, b))) for a, b in pairwise(X)]
    return np.concatenate([[0.0], np.cumsum(steps)])


def bridge(system: AnySystem, a: Array, b: Array, step: float) -> Array | None:
    """A chain on the manifold, and inside its bounds, from a to b.

    Args:
        system: The system.
        a: First point [configuration_size].
        b: Last point.
        step: Longest step [units of the tangent space].

    Returns:
        The chain [n, configuration_size], or None where no line leads from one to the other.
    """
    chain = [a]
    ahead = [(b, 0)]
    while ahead:
        target, halvings = ahead[-1]
        d = system.difference(chain[-1], target)
        length = float(np.linalg.norm(d))
        if length <= step:
            chain.append(ahead.pop()[0])
            continue
        Phi = tangent_bases(system, chain[-1][None])[0]
        middle = point_above(system, chain[-1], Phi, Phi @ d / 2.0)
        if middle is None or halvings == MAX_HALVINGS:
            return None
        halves = np.linalg.norm([system.difference(chain[-1], middle), system.difference(middle, target)], axis=1)
        if halves.max() > HALF * length:
            return None
        ahead[-1] = (target, halvings + 1)
        ahead.append((middle, halvings + 1))
    return np.array(chain)


def evenly(system: AnySystem, X: Array, step: float) -> Array | None:
    """The same curve with steps of even length.

    Args:
        system: The system.
        X: A chain [n, configuration_size].
        step: Longest step [units of the tangent space].

    Returns:
        The chain, with the same ends; None when a point cannot be projected.
    """
    s = arc_lengths(system, X)
    wanted = np.linspace(0.0, s[-1], int(np.ceil(s[-1] / step * (1.0 + UNEVEN))) + 1)[1:-1]
    at = np.clip(np.searchsorted(s, wanted, side="right") - 1, 0, len(X) - 2)
    bases = dict(zip(np.unique(at).tolist(), tangent_bases(system, X[np.unique(at)]), strict=True))
    chain = [X[0]]
    for target, i in zip(wanted, at.tolist(), strict=True):
        d = system.difference(X[i], X[i + 1]) * ((target - s[i]) / (s[i + 1] - s[i]))
        x = point_above(system, X[i], bases[i], bases[i] @ d)
        if x is None:
            return None
        chain.append(x)
    return np.array([*chain, X[-1]])


def shorten(
    system: AnySystem,
    X: Array,
    *,
    trust_radius: float,
    longest: float,
    allowed: Allowed | None = None,
    progress: bool | None = None,
) -> tuple[Array, bool]:
    """Shorten a chain between its ends until it is as short as its neighbours allow.

    Ctrl-C ends the work and returns the chain as it is: it is on the manifold and allowed at any time.

    Args:
        system: The system.
        X: The chain [n, configuration_size], on the manifold and inside its bounds.
        trust_radius: How far a point may move at once [units of the tangent space].
        longest: Longest step that the chain may have.
        allowed: Tells which points may be part of the chain; that holds for all of X.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The chain [n, configuration_size] and whether it is as short as it can be made.
    """
    if len(X) < 3:
        return X, True
    chain = Chain(system, X)
    least = LEAST_GAIN if allowed is None else LEAST_GAIN_LIMITED
    try:
        with progress_bar("path", "steps", MAX_STEPS, progress) as bar:
            for _ in range(MAX_STEPS):
                shorter = _shortened(chain, trust_radius, longest, allowed)
                if shorter is None:
                    return chain.X, True
                gain = 1.0 - shorter.energy / chain.energy
                chain = shorter
                bar.update()
                if gain < least:
                    return chain.X, True
    except KeyboardInterrupt:
        pass
    return chain.X, False


def _shortened(chain: Chain, trust_radius: float, longest: float, allowed: Allowed | None) -> Chain | None:
    """The chain after one step, or None when no step makes it shorter."""
    learned = HalfSpaces.none(chain)
    u = _capped(chain.plan(learned, trust_radius), trust_radius)
    for fraction in FRACTIONS:
        move = fraction * u
        moved = chain.moved(move) if allowed is None else _allowed_move(chain, move, fraction, trust_radius, allowed)
        if moved is None:
            continue
        shorter = Chain(chain.system, moved)
        if shorter.energy < chain.energy and shorter.longest <= max(longest, chain.longest):
            return shorter
    return None


def _allowed_move(chain: Chain, u: Array, fraction: float, trust_radius: float, allowed: Allowed) -> Array | None:
    """The chain moved by u [n, k], all its points allowed: by a fraction of another move where some are not."""
    learned = HalfSpaces.none(chain)
    for attempt in range(ROUNDS + 1):
        moved = chain.moved(u)
        if moved is None:
            return None
        going = np.flatnonzero(np.any(u != 0.0, axis=1))
        bad = going[~allowed(moved[going])]
        if len(bad) == 0:
            return moved
        if attempt == ROUNDS:
            moved[bad] = chain.X[bad]
            return moved
        learned.add(chain, bad, u, allowed)
        u = fraction * _capped(chain.plan(learned, trust_radius), trust_radius)
    return None


def _capped(u: Array, trust_radius: float) -> Array:
    """Moves u [n, k] shortened so that none is longer than this."""
    return np.asarray(u * min(1.0, trust_radius / max(float(np.linalg.norm(u, axis=1).max()), 1e-300)))
