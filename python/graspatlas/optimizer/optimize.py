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
from graspatlas.analysis.climb import MAX_STEPS
from graspatlas.analysis.refine import refine as climb_peaks
from graspatlas.atlas.atlas import Atlas, Audit, Status
from graspatlas.atlas.checkpoints import CheckpointFolder, run_digest
from graspatlas.atlas.growth import Growth, Limits, available_bytes, available_threads
from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.readings import Reading, check_atlas_of
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import Quality, find_index, quality_name
from graspatlas.requirements.screening import Require
from graspatlas.result.result import Result
from graspatlas.search.find_grasps import with_first_grasp
from graspatlas.support.interrupts import hear, held, keeping, stoppable, stopping
from graspatlas.support.validation import number, number_array, shown
from graspatlas.systems.system import AnySystem, check_finite, check_jacobian

__all__ = ["build_atlas", "optimize"]

_NO_LIMIT = 2**62
#: Most threads that may be asked for: no machine has more cores.
MOST_THREADS = 4096
#: More than so many threads a core, and than so many in all, are not started: they would only wait for one another.
THREADS_A_CORE, ALWAYS_ALLOWED = 4, 32
#: Time that is left where none is [s].
_SHORTEST = 1e-9


@stoppable()
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

    Ctrl-C ends the work and returns what there is, with a status that says so; a second one while that is put together
    changes nothing, see :mod:`graspatlas.support.interrupts`. The atlas is the same to the bit for any number of
    threads.

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
    options = (_positive("radius", radius), _positive("epsilon", epsilon))
    start = time.perf_counter()
    limits = Limits(
        charts=_NO_LIMIT if max_charts is None else _whole("max_charts", max_charts),
        deadline=start + _seconds(max_seconds),
        memory=available_bytes() if max_bytes is None else _positive("max_bytes", max_bytes),
    )
    return _grown(system, _numbers("x0", x0), (*options, _workers(threads)), limits, checkpoint, progress)


def _grown(
    system: AnySystem,
    x0: NDArray[np.float64],
    options: tuple[float, float, int],
    limits: Limits,
    checkpoint: str | os.PathLike[str] | None,
    progress: bool | None,
) -> Atlas:
    """The atlas of options that are checked: radius, epsilon and threads."""
    start = time.perf_counter()
    radius, epsilon, _ = options
    folder = CheckpointFolder(checkpoint, run_digest(system, x0, radius, epsilon)) if checkpoint is not None else None
    builder = _builder(system, x0, options, folder)
    growth = Growth(builder, system, x0, radius, epsilon)
    try:
        status = growth.run(limits, progress, folder)
    except KeyboardInterrupt:  # it came when the growth had just ended
        status = Status.COMPLETE if builder.audited else Status.INTERRUPTED
    with held():
        audit = Audit(points=builder.audit_points, holes=builder.audit_holes, seconds=growth.audit_seconds)
        atlas = Atlas(
            system=system,
            radius=radius,
            epsilon=epsilon,
            status=status,
            seconds=time.perf_counter() - start,
            audit=audit,
            **builder.arrays(),
        )
        if status is Status.COMPLETE and atlas.blocked:
            atlas = replace(atlas, status=Status.BLOCKED)
    with keeping(atlas=atlas):
        hear()
    return atlas


def _builder(
    system: AnySystem,
    x0: NDArray[np.float64],
    options: tuple[float, float, int],
    folder: CheckpointFolder | None,
) -> _core.AtlasBuilder:
    """A builder at x0, or where a checkpoint left off."""
    saved = folder.load() if folder else None
    if saved is None:
        try:
            builder = _core.AtlasBuilder(system, x0, *options)
        except GraspAtlasError:
            check_finite(system, x0)
            raise
        check_jacobian(system, builder.arrays()["centers"][0])
        return builder
    builder = _core.AtlasBuilder.resume(system, saved, *options)
    print(f"going on from the {builder.n_charts} charts of a checkpoint", file=sys.stderr)
    return builder


@stoppable()
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
    atlas: Atlas | None = None,
) -> Result:
    """Find the best grasp of a problem: trace all relevant grasps, then read a quality index on them.

    What is not given comes from ``problem.defaults``. Ctrl-C ends the tracing and the refinement and returns what there
    is by then; while the index is read of a complete atlas it raises ``KeyboardInterrupt``, which carries the atlas.

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
        max_seconds: Time for all of it; none by default. The search for a first grasp ends in an error when it takes
            longer. The atlas is cut short so that about the time is left that reading the index and the requirements
            takes, which is measured at x1; and climbs that go on then are given up.
        max_bytes: See :func:`build_atlas`.
        threads: See :func:`build_atlas`.
        checkpoint: See :func:`build_atlas`.
        progress: See :func:`build_atlas`.
        atlas: An atlas of the same problem and options to read instead of tracing one: that of another result, or the
            attribute ``atlas`` of the error with which an index or a requirement of yours ended an earlier call.

    Returns:
        The result: best and worst grasp, atlas, qualities and status. Only when ``result.is_global`` the best grasp is
        the best of all that are connected to x1 and meet the requirements, up to the size of a chart.

    Raises:
        GraspAtlasError: If an argument makes no sense, the index fails, or no first grasp is found. An error after the
            atlas, and ``KeyboardInterrupt``, has it as its attribute ``atlas``, and after the index ``result``.

    Source: "Global Optimization of Robotic Grasps", Algorithm 1.
    """
    start = time.perf_counter()
    chosen = {"dimension": dimension, "radius": radius, "epsilon": epsilon, "quality": quality}
    options = options_of(problem, chosen)
    if refine not in (False, True, "relevant", "feasible"):
        raise GraspAtlasError(f"refine must be True, False, 'relevant' or 'feasible', got {refine!r}")
    _whole("refine_steps", refine_steps)
    reading = Reading(_indices(options["quality"]), problem.requirements if require is None else require)
    deadline = start + _seconds(max_seconds)
    problem = with_first_grasp(problem, options["dimension"], max_seconds, progress)
    if atlas is None:
        system, x0 = problem.system(options["dimension"]), problem.start(options["dimension"])
        reading.try_out(problem, system, x0)
        limits = Limits(
            charts=_NO_LIMIT if max_charts is None else _whole("max_charts", max_charts),
            deadline=deadline,
            memory=available_bytes() if max_bytes is None else _positive("max_bytes", max_bytes),
            seconds_each=0.0 if max_seconds is None else reading.seconds_each(problem, system, x0),
        )
        sizes = (_positive("radius", options["radius"]), _positive("epsilon", options["epsilon"]), _workers(threads))
        atlas = _grown(system, x0, sizes, limits, checkpoint, progress)
    else:
        check_atlas_of(problem, options, atlas)
    with keeping(atlas=atlas):
        result = reading.at(problem, atlas)
        if refine and result.feasible.any() and not stopping():
            with keeping(result=result):
                left = None if max_seconds is None else max(deadline - time.perf_counter(), _SHORTEST)
                found = climb_peaks(
                    result,
                    all_motions=refine == "feasible",
                    max_steps=refine_steps,
                    max_seconds=left,
                    progress=progress,
                )
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


def _seconds(max_seconds: float | None) -> float:
    return float("inf") if max_seconds is None else _positive("max_seconds", max_seconds)


def _workers(threads: int | None) -> int:
    """Threads to start."""
    if threads is None:
        return available_threads()
    return min(_whole("threads", threads, MOST_THREADS), max(ALWAYS_ALLOWED, THREADS_A_CORE * available_threads()))


def _whole(name: str, value: int, most: int | None = None) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < 1:
        raise GraspAtlasError(f"{name} must be a whole number of at least 1, got {shown(value)}")
    if most is not None and int(value) > most:
        raise GraspAtlasError(f"{name} must be at most {most}, got {shown(value)}")
    return min(int(value), _NO_LIMIT)
