"""The atlas of any system: charts from a first point until the manifold is covered (Algorithm 1, lines 4 to 13)."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace

from numpy.typing import ArrayLike
from typing_extensions import Unpack

from graspatlas import _core
from graspatlas.atlas.atlas import Atlas
from graspatlas.atlas.checkpoints import CheckpointFolder, run_digest
from graspatlas.atlas.growth import Growth
from graspatlas.atlas.limits import LimitOptions, Limits
from graspatlas.atlas.status import Audit, Status
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.interrupts import hear, held, keeping, stoppable
from graspatlas.support.validation import number_array, positive
from graspatlas.systems.system import AnySystem, check_finite, check_jacobian

__all__ = ["build_atlas", "grown"]


@stoppable()
def build_atlas(
    system: AnySystem,
    x0: ArrayLike,
    *,
    radius: float,
    epsilon: float,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
    **limits: Unpack[LimitOptions],
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
        checkpoint: Folder in which a run that is long or cut short keeps what it has every 20 s, and from which the
            same call goes on, to the same atlas, to the bit. The folder stays; delete it when you have the atlas.
        progress: Show a progress bar on standard error; by default when it is a terminal.
        **limits: ``max_charts``, number of charts after which the atlas is cut short, none by default; ``max_seconds``,
            time after which it is, none by default; ``max_bytes``, memory of the atlas, with the arrays made of it,
            beyond which it is, by default four fifths of what the machine (or the container) has free; and ``threads``
            that work at the same time, all cores by default: a system written in Python has one.

    Returns:
        The atlas.

    Raises:
        GraspAtlasError: If an argument makes no sense, x0 cannot be projected, or the Jacobian has lost rank there.

    Source: "Global Optimization of Robotic Grasps", Algorithm 1, lines 4 to 13.
    """
    if not isinstance(system, AnySystem):
        raise GraspAtlasError(f"system must be a graspatlas.System, got {type(system).__name__}")
    sizes = (positive(radius, "radius"), positive(epsilon, "epsilon"))
    limit = Limits.of(limits, "build_atlas")
    return grown(system, number_array(x0, "x0"), *sizes, limit, checkpoint, progress)


def grown(
    system: AnySystem,
    x0: Array,
    radius: float,
    epsilon: float,
    limits: Limits,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
) -> Atlas:
    """The atlas of arguments that are checked; see :func:`build_atlas`."""
    start = time.perf_counter()
    folder = CheckpointFolder(checkpoint, run_digest(system, x0, radius, epsilon)) if checkpoint is not None else None
    builder = _builder(system, x0, (radius, epsilon, limits.threads), folder)
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
            n_projections=builder.n_projections,
            audit=audit,
            **builder.take_arrays(),
        )
        if status is Status.COMPLETE and atlas.blocked:
            atlas = replace(atlas, status=Status.BLOCKED)
    with keeping(atlas=atlas):
        hear()
    return atlas


def _builder(
    system: AnySystem,
    x0: Array,
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
