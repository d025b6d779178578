"""Algorithm 1 of the paper: an atlas of the relevant grasps, and the best of them."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from graspatlas import _core
from graspatlas.atlas import Atlas, Status
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps import Grasps
from graspatlas.problem import Problem
from graspatlas.quality import Quality, evaluate, find_index
from graspatlas.requirements import Require, screen
from graspatlas.result import Result
from graspatlas.systems import AnySystem, check_jacobian
from graspatlas.tables import number, number_array, shown

__all__ = ["build_atlas", "optimize"]

_NO_LIMIT = 2**62
_SLICE_SECONDS = 0.1  # between looks at the clock, at Ctrl-C and at the progress bar
_QUIET_SECONDS = 1.0  # work that ends within this shows no progress bar


def build_atlas(
    system: AnySystem,
    x0: ArrayLike,
    *,
    radius: float,
    epsilon: float,
    max_charts: int | None = None,
    max_seconds: float | None = None,
    progress: bool | None = None,
) -> Atlas:
    """Cover the solutions of R(x) = 0 that are connected to a first point with charts.

    Ctrl-C ends the work and returns what there is, with a status that says so.

    Args:
        system: The equations: one of :mod:`graspatlas.systems`, a problem's, or your own subclass of
            :class:`graspatlas.System`.
        x0: First point [configuration_size]; it is projected onto the manifold.
        radius: r, of the ball that a chart may cover [units of the tangent space].
        epsilon: Largest distance between a chart and the manifold, and largest 1 - cosine between neighbouring tangent
            spaces; between 0 and 1.
        max_charts: Number of charts after which the atlas is cut short; none by default.
        max_seconds: Time after which the atlas is cut short; none by default.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The atlas.

    Raises:
        GraspAtlasError: If an argument makes no sense, x0 cannot be projected, or the Jacobian has lost rank there.

    Source: "Global Optimization of Robotic Grasps", Algorithm 1, lines 4 to 13.
    """
    if not isinstance(system, AnySystem):
        raise GraspAtlasError(f"system must be a graspatlas.System, got {type(system).__name__}")
    radius = _positive("radius", radius)
    epsilon = _positive("epsilon", epsilon)
    charts = _NO_LIMIT if max_charts is None else _whole("max_charts", max_charts)
    limit = float("inf") if max_seconds is None else _positive("max_seconds", max_seconds)
    start = time.perf_counter()
    builder = _core.AtlasBuilder(system, _numbers("x0", x0), radius, epsilon)
    check_jacobian(system, builder.arrays()["centers"][0])
    status = _grow(builder, charts, start + limit, progress)
    seconds = time.perf_counter() - start
    return Atlas(
        system=system,
        radius=radius,
        epsilon=epsilon,
        status=status,
        seconds=seconds,
        **builder.arrays(),
    )


def _grow(builder: _core.AtlasBuilder, max_charts: int, deadline: float, progress: bool | None) -> Status:
    shown = sys.stderr.isatty() if progress is None else progress
    # In a file a line every ten seconds is enough.
    interval = 0.1 if sys.stderr.isatty() else 10.0
    bar = tqdm(
        desc="atlas",
        unit=" charts",
        disable=not shown,
        delay=_QUIET_SECONDS,
        file=sys.stderr,
        initial=1,
        mininterval=interval,
    )
    try:
        while not builder.complete:
            remaining = deadline - time.perf_counter()
            if remaining <= 0.0:
                return Status.TIME_LIMIT
            if builder.n_charts >= max_charts:
                return Status.CHART_LIMIT
            builder.expand(max_charts, min(_SLICE_SECONDS, remaining))
            bar.set_postfix(open=builder.n_open, refresh=False)
            bar.update(builder.n_charts - bar.n)
    except KeyboardInterrupt:
        if shown:
            print(f"interrupted: keeping {builder.n_charts} charts", file=sys.stderr)
        return Status.INTERRUPTED
    finally:
        bar.close()
    return Status.COMPLETE


def optimize(
    problem: Problem,
    *,
    dimension: int | None = None,
    radius: float | None = None,
    epsilon: float | None = None,
    quality: Quality | None = None,
    require: Sequence[Require] = (),
    max_charts: int | None = None,
    max_seconds: float | None = None,
    progress: bool | None = None,
) -> Result:
    """Find the best grasp of a problem: trace all relevant grasps, then read a quality index on them.

    What is not given comes from ``problem.defaults``.

    Args:
        problem: The problem; see :func:`graspatlas.load_problem`.
        dimension: k, of the set of relevant grasps: 1 to t.
        radius: r, of a chart [rad, and lengths in units of ``problem.length_scale``].
        epsilon: See :func:`build_atlas`.
        quality: Name of an index, or a callable: see :mod:`graspatlas.quality`.
        require: What a grasp must meet to be the best or the worst: see :mod:`graspatlas.requirements`.
        max_charts: See :func:`build_atlas`.
        max_seconds: See :func:`build_atlas`.
        progress: See :func:`build_atlas`.

    Returns:
        The result: best and worst grasp, atlas, qualities and status. Only when ``result.is_global`` the best grasp is
        the best of all that are connected to x1 and meet the requirements, up to the size of a chart.

    Raises:
        GraspAtlasError: If an argument makes no sense, or the index fails.

    Source: "Global Optimization of Robotic Grasps", Algorithm 1.
    """
    if not isinstance(problem, Problem):
        raise GraspAtlasError(f"problem must be a graspatlas.Problem, got {type(problem).__name__}; see load_problem")
    chosen = {"dimension": dimension, "radius": radius, "epsilon": epsilon, "quality": quality}
    options = _with_defaults(problem, chosen)
    find_index(options["quality"])
    system = problem.system(options["dimension"])
    atlas = build_atlas(
        system,
        problem.x1_array,
        radius=options["radius"],
        epsilon=options["epsilon"],
        max_charts=max_charts,
        max_seconds=max_seconds,
        progress=progress,
    )
    start = time.perf_counter()
    grasps = Grasps(problem, atlas.centers, system)
    feasible, refused = screen(require, grasps)
    qualities = evaluate(options["quality"], grasps)
    return Result(
        problem=problem,
        atlas=atlas,
        quality=options["quality"],
        qualities=qualities,
        quality_seconds=time.perf_counter() - start,
        requirements=tuple(require),
        feasible=feasible,
        refused=refused,
    )


def _with_defaults(problem: Problem, chosen: dict[str, Any]) -> dict[str, Any]:
    """The options chosen, and the problem's defaults for those that are None."""
    options = {key: problem.defaults.get(key) if value is None else value for key, value in chosen.items()}
    missing = [key for key, value in options.items() if value is None]
    if missing:
        raise GraspAtlasError(f"problem '{problem.name}' has no default for {', '.join(missing)}: give optimize these")
    return options


def _numbers(name: str, value: ArrayLike) -> np.ndarray[Any, np.dtype[np.float64]]:
    return number_array(value, name)


def _positive(name: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0.0 < number(value, name) < float("inf"):
        raise GraspAtlasError(f"{name} must be a positive number, got {shown(value)}")
    return float(value)


def _whole(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < 1:
        raise GraspAtlasError(f"{name} must be a whole number of at least 1, got {shown(value)}")
    return min(int(value), _NO_LIMIT)
