"""Algorithm 1 of the paper: an atlas of the relevant grasps, and the best of them."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas import _core
from graspatlas.atlas import Atlas
from graspatlas.checkpoints import CheckpointFolder, run_digest
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps import Grasps
from graspatlas.growth import Growth, Limits, available_bytes, available_threads
from graspatlas.local_search import MAX_STEPS
from graspatlas.problem import Problem
from graspatlas.quality import Quality, evaluate, find_index, quality_name
from graspatlas.refinement import refine as climb_peaks
from graspatlas.requirements import Require, screen
from graspatlas.result import Result
from graspatlas.search import with_first_grasp
from graspatlas.systems import AnySystem, check_jacobian
from graspatlas.tables import number, number_array, shown

__all__ = ["build_atlas", "optimize"]

_NO_LIMIT = 2**62


def build_atlas(
    system: AnySystem,
    x0: ArrayLike,
    *,
    radius: float,
    epsilon: float,
    max_charts: int | None = None,
    max_seconds: float | None = None,
    max_bytes: float | None = None,
    threads: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
) -> Atlas:
    """Cover the solutions of R(x) = 0 that are connected to a first point with charts.

    Ctrl-C ends the work and returns what there is, with a status that says so. The atlas is the same to the bit for
    any number of threads.

    Args:
        system: The equations: one of :mod:`graspatlas.systems`, a problem's, or your own subclass of
            :class:`graspatlas.System`.
        x0: First point [configuration_size]; it is projected onto the manifold.
        radius: r, of the ball that a chart may cover [units of the tangent space].
        epsilon: Largest distance between a chart and the manifold, and largest 1 - cosine between neighbouring tangent
            spaces; between 0 and 1.
        max_charts: Number of charts after which the atlas is cut short; none by default.
        max_seconds: Time after which the atlas is cut short; none by default.
        max_bytes: Memory of the atlas, with the arrays that are made of it, beyond which it is cut short; by default
            four fifths of what the machine (or the container) has free.
        threads: Threads that work at the same time; all cores by default. A system written in Python has one.
        checkpoint: Folder in which a run that is long or cut short keeps what it has every 20 s, and from which the
            same call goes on, to the same atlas, to the bit. The folder stays; delete it when you have the atlas.
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
    seconds = float("inf") if max_seconds is None else _positive("max_seconds", max_seconds)
    memory = available_bytes() if max_bytes is None else _positive("max_bytes", max_bytes)
    workers = available_threads() if threads is None else _whole("threads", threads)
    start = time.perf_counter()
    first = _numbers("x0", x0)
    folder = CheckpointFolder(checkpoint, run_digest(system, first, radius, epsilon)) if checkpoint else None
    builder = _builder(system, first, (radius, epsilon, workers), folder)
    growth = Growth(builder, system, first, radius, epsilon)
    status = growth.run(Limits(charts, start + seconds, memory), progress, folder)
    arrays = builder.arrays()
    return Atlas(
        system=system, radius=radius, epsilon=epsilon, status=status, seconds=time.perf_counter() - start, **arrays
    )


def _builder(
    system: AnySystem,
    x0: NDArray[np.float64],
    options: tuple[float, float, int],
    folder: CheckpointFolder | None,
) -> _core.AtlasBuilder:
    """A builder at x0, or where a checkpoint left off."""
    saved = folder.load() if folder else None
    if saved is None:
        builder = _core.AtlasBuilder(system, x0, *options)
        check_jacobian(system, builder.arrays()["centers"][0])
        return builder
    builder = _core.AtlasBuilder.resume(system, saved, *options)
    print(f"going on from the {builder.n_charts} charts of a checkpoint", file=sys.stderr)
    return builder


def optimize(
    problem: Problem,
    *,
    dimension: int | None = None,
    radius: float | None = None,
    epsilon: float | None = None,
    quality: Quality | Sequence[Quality] | None = None,
    require: Sequence[Require] | None = None,
    refine: bool | str = False,
    refine_steps: int = MAX_STEPS,
    max_charts: int | None = None,
    max_seconds: float | None = None,
    max_bytes: float | None = None,
    threads: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
) -> Result:
    """Find the best grasp of a problem: trace all relevant grasps, then read a quality index on them.

    What is not given comes from ``problem.defaults``.

    Args:
        problem: The problem; see :func:`graspatlas.load_problem`. Without x1 a first grasp is searched, and the result
            carries it: see :func:`graspatlas.find_components` for all that there is.
        dimension: k, of the set of relevant grasps: 1 to t.
        radius: r, of a chart [rad, and lengths in units of ``problem.length_scale``].
        epsilon: See :func:`build_atlas`.
        quality: Name of an index, or a callable: see :mod:`graspatlas.quality`. Of several, the first chooses the best,
            and the others are kept in ``result.others``.
        require: What a grasp must meet to be the best or the worst: see :mod:`graspatlas.requirements`. Those of the
            problem by default; ``()`` for none.
        refine: Climb from the best charts to the maximum between the charts' centres, ``result.refined_best``: in R
            with True or ``"relevant"``, then on in all dimensions of F with ``"feasible"``; see :func:`refine`.
        refine_steps: Steps after which such a climb is given up.
        max_charts: See :func:`build_atlas`.
        max_seconds: See :func:`build_atlas`.
        max_bytes: See :func:`build_atlas`.
        threads: See :func:`build_atlas`.
        checkpoint: See :func:`build_atlas`.
        progress: See :func:`build_atlas`.

    Returns:
        The result: best and worst grasp, atlas, qualities and status. Only when ``result.is_global`` the best grasp is
        the best of all that are connected to x1 and meet the requirements, up to the size of a chart.

    Raises:
        GraspAtlasError: If an argument makes no sense, the index fails, or no first grasp is found.

    Source: "Global Optimization of Robotic Grasps", Algorithm 1.
    """
    chosen = {"dimension": dimension, "radius": radius, "epsilon": epsilon, "quality": quality}
    options = options_of(problem, chosen)
    first, *others = _indices(options["quality"])
    if refine not in (False, True, "relevant", "feasible"):
        raise GraspAtlasError(f"refine must be True, False, 'relevant' or 'feasible', got {refine!r}")
    _whole("refine_steps", refine_steps)
    problem = with_first_grasp(problem, options["dimension"], max_seconds, progress)
    system = problem.system(options["dimension"])
    atlas = build_atlas(
        system,
        problem.start(options["dimension"]),
        radius=options["radius"],
        epsilon=options["epsilon"],
        max_charts=max_charts,
        max_seconds=max_seconds,
        max_bytes=max_bytes,
        threads=threads,
        checkpoint=checkpoint,
        progress=progress,
    )
    start = time.perf_counter()
    grasps = Grasps(problem, atlas.centers, system)
    require = problem.requirements if require is None else require
    feasible, refused = screen(require, grasps)
    qualities = evaluate(first, grasps)
    values = {quality_name(other): evaluate(other, grasps) for other in others}
    result = Result(
        problem=problem,
        atlas=atlas,
        quality=first,
        qualities=qualities,
        quality_seconds=time.perf_counter() - start,
        requirements=tuple(require),
        feasible=feasible,
        refused=refused,
        others=values,
    )
    if refine and feasible.any():
        found = climb_peaks(result, all_motions=refine == "feasible", max_steps=refine_steps, progress=progress)
        result = replace(result, refinement=found)
    return result


def _indices(quality: Quality | Sequence[Quality]) -> list[Quality]:
    """The indices asked for, each once."""
    several: list[Any] = list(quality) if isinstance(quality, list | tuple) else [quality]
    for one in several:
        find_index(one)
    names = [quality_name(one) for one in several]
    if not names or len(set(names)) < len(names):
        raise GraspAtlasError(f"quality must name one index or several different ones, got {names}")
    return several


def options_of(problem: Problem, chosen: dict[str, Any]) -> dict[str, Any]:
    """The options chosen, and the problem's defaults for those that are None.

    Raises:
        GraspAtlasError: If neither gives one, or there is no such index.
    """
    if not isinstance(problem, Problem):
        raise GraspAtlasError(f"problem must be a graspatlas.Problem, got {type(problem).__name__}; see load_problem")
    options = {key: problem.defaults.get(key) if value is None else value for key, value in chosen.items()}
    missing = [key for key, value in options.items() if value is None]
    if missing:
        raise GraspAtlasError(f"problem '{problem.name}' has no default for {', '.join(missing)}: give optimize these")
    _indices(options["quality"])  # type: ignore[arg-type]
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
