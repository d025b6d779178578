"""The growth of an atlas: slices of work between looks at limits, at Ctrl-C and at the progress bar."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from graspatlas import _core
from graspatlas.atlas.checkpoints import CheckpointFolder
from graspatlas.atlas.limits import Limits
from graspatlas.atlas.status import Status
from graspatlas.errors import GraspAtlasError
from graspatlas.support.arrays import Array
from graspatlas.support.interrupts import hear, held, stopping
from graspatlas.support.progress import QUIET_SECONDS, is_shown, progress_bar
from graspatlas.systems.system import AnySystem

__all__ = ["Growth", "Watcher", "outlook", "watched"]

_SLICE_SECONDS = 0.1
#: Work that a killed run can lose [s], but for the time that writing takes.
_CHECKPOINT_SECONDS = 20.0
#: What the builder's memory takes at most while its arrays are made, with what the heap needs for itself.
_HELD = 1.2
#: A coarse atlas that tells the size of the one being grown has this part of its charts, about.
_COARSE_SHARE = 1 / 30


#: Points of random walks that an audit looks up: at least, and as a share of the charts.
AUDIT_POINTS, AUDIT_SHARE = 300, 1 / 20

#: What looks at an atlas between two slices of its growth; it must leave the builder as it is.
Watcher = Callable[[AnySystem, _core.AtlasBuilder], None]
_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Let a function look at all atlases that grow within the block, in this thread."""
    token = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(token)


class Growth:
    """An atlas in the making.

    Its final size is read off a coarse atlas of the same manifold, grown in the first seconds: the number of charts is
    proportional to r^-k, but for the boundary and for bends sharper than the charts.
    """

    def __init__(
        self,
        builder: _core.AtlasBuilder,
        system: AnySystem,
        x0: Array,
        radius: float,
        epsilon: float,
    ) -> None:
        self.builder, self.system = builder, system
        self.audit_seconds = 0.0
        self._ratio = float(_COARSE_SHARE ** (-1 / system.dimension))
        self._coarse_arguments = (system, x0, self._ratio * radius, epsilon, builder.n_threads)
        self._coarse: _core.AtlasBuilder | None = None
        self._dimension = system.dimension

    def run(self, limits: Limits, progress: bool | None, checkpoint: CheckpointFolder | None = None) -> Status:
        """Grow the atlas until it is complete or meets a limit; a run that is long or cut short keeps a checkpoint."""
        if checkpoint is None:
            return self._run(limits, progress, lambda: None)
        written = time.perf_counter()

        def keep() -> None:
            nonlocal written
            if time.perf_counter() - written > _CHECKPOINT_SECONDS:
                with held():
                    checkpoint.write(self.builder)
                written = time.perf_counter()
                hear()

        start = written
        status = self._run(limits, progress, keep)
        if status is not Status.COMPLETE or written > start:
            with held():
                checkpoint.write(self.builder)
        return status

    def _run(self, limits: Limits, progress: bool | None, after_slice: Callable[[], None]) -> Status:
        shown = is_shown(progress)
        bar = progress_bar("atlas", "charts", progress=progress, initial=self.builder.n_charts)
        builder, start, watcher = self.builder, time.perf_counter(), _watcher.get()
        try:
            while not builder.audited:
                now = time.perf_counter()
                left = limits.deadline - now - limits.seconds_each * builder.n_charts
                if stopping():
                    raise KeyboardInterrupt
                if left <= 0.0:
                    return Status.TIME_LIMIT
                if builder.n_charts >= limits.charts:
                    return Status.CHART_LIMIT
                if _HELD * builder.n_bytes > limits.memory:
                    return Status.MEMORY_LIMIT
                seconds = min(_SLICE_SECONDS, left)
                if builder.complete:
                    began = time.perf_counter()
                    builder.audit(max(AUDIT_POINTS, round(AUDIT_SHARE * builder.n_charts)), seconds)
                    self.audit_seconds += time.perf_counter() - began
                else:
                    builder.expand(limits.charts, seconds)
                if shown and now - start > QUIET_SECONDS:
                    size = self.expected_size(seconds)
                    bar.note(outlook(builder, size, time.perf_counter() - start))
                bar.update(builder.n_charts - bar.n)
                after_slice()
                if watcher is not None:
                    watcher(self.system, builder)
        except KeyboardInterrupt:
            if shown:
                print(f"interrupted: keeping {builder.n_charts} charts", file=sys.stderr)
            return Status.INTERRUPTED
        finally:
            with held():
                self._coarse = None  # its memory is wanted for the arrays
                bar.close()
        return Status.COMPLETE

    def expected_size(self, seconds: float) -> int | None:
        """Find out, in so many seconds, about how many charts there will be; None while that is not known."""
        if self._coarse is None:
            try:
                self._coarse = _core.AtlasBuilder(*self._coarse_arguments)
            except GraspAtlasError:  # the manifold is too small for charts as large as these
                self._coarse = self.builder
        if self._coarse is self.builder:
            return None
        if not self._coarse.complete:
            self._coarse.expand(self.builder.n_charts, seconds)
        if not self._coarse.complete:
            return None
        return round(float(self._coarse.n_charts * self._ratio**self._dimension))


def outlook(builder: _core.AtlasBuilder, size: int | None, seconds: float) -> str:
    """What the progress bar says besides the charts so far."""
    text = f"{builder.n_open} open"
    if size is None or size < builder.n_charts:
        return text
    left = seconds * (size - builder.n_charts) / builder.n_charts
    return f"{text}; about {float(f'{size:.2g}'):,.0f} charts in all, {left:.0f} s left"
