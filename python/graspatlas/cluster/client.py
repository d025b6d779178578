"""A client of Dask's scheduler: that of workers on this machine, or one at an address."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING

from graspatlas.cluster.local_cluster import local_cluster, safe_path
from graspatlas.errors import GraspAtlasError
from graspatlas.support.interrupts import hear, held

if TYPE_CHECKING:
    import dask.distributed as dask

__all__ = ["connected", "need"]

#: Time in which a scheduler must answer [s].
ANSWER_SECONDS = 20.0


def need(what: str, *modules: str) -> None:
    """Make sure that modules of the extra ``sweep`` are installed.

    Args:
        what: What needs them, for the message.
        *modules: Their names.

    Raises:
        GraspAtlasError: If one is not.
    """
    try:
        for module in modules:
            import_module(module)
    except ImportError as error:
        raise GraspAtlasError(f"{what} needs {error.name}: pip install 'graspatlas[sweep]'") from None


@contextmanager
def connected(scheduler: str | None, workers: int) -> Iterator[dask.Client]:
    """A client, closed in the end, and with it the workers that were started for it.

    Args:
        scheduler: Address of a scheduler; None for workers on this machine. Where it has none yet, a warning says so:
            what is submitted waits for them.
        workers: How many of these.

    Raises:
        GraspAtlasError: If the scheduler does not answer, or the workers do not start.
    """
    if scheduler is not None:
        with _client(scheduler) as client:
            if not client.nthreads():
                warnings.warn(
                    f"the Dask scheduler at '{scheduler}' has no workers yet; start some with: dask worker {scheduler}",
                    RuntimeWarning,
                    stacklevel=2,
                )
            yield client
        return
    with safe_path():
        with held():  # what is broken off half started leaves processes behind
            cluster = local_cluster(workers)
        try:
            hear()
            with _client(cluster) as client:
                yield client
        finally:
            with held():
                cluster.close()


@contextmanager
def _client(scheduler: str | dask.LocalCluster) -> Iterator[dask.Client]:
    import dask.distributed as dask

    try:
        client = dask.Client(scheduler, timeout=ANSWER_SECONDS)
    except (OSError, ValueError) as error:
        raise GraspAtlasError(
            f"no Dask scheduler answers at '{scheduler}' ({error}); start one with: dask scheduler"
        ) from None
    try:
        yield client
    finally:
        with held():
            client.close()
