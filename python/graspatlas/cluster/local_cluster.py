"""Workers of Dask on this machine, and what they are started with."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING

from graspatlas.errors import GraspAtlasError

if TYPE_CHECKING:
    import dask.distributed as dask

__all__ = ["local_cluster", "safe_path"]

#: Whether PYTHONSAFEPATH keeps the current folder off the path of modules; older ones than 3.11 do not know it.
KNOWS_SAFE_PATH = sys.version_info >= (3, 11)


@contextmanager
def safe_path() -> Iterator[None]:
    """Let workers start without looking for modules of the standard library in the current folder.

    They start as ``python -c``, for which that folder comes first; those that have died are started again, too.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


@contextmanager
def _empty_folder() -> Iterator[None]:
    """The same for versions of Python that know no safe path: an empty folder is the current one meanwhile."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as empty:
        os.chdir(empty)
        try:
            yield
        finally:
            os.chdir(here)


@contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """Keep Ctrl-C, which a terminal sends to all its processes, from workers: they are told to end.

    Threads inherit what signals are blocked, and so do the processes that they start, now or later. This thread hears
    of a Ctrl-C after the block.
    """
    resource_tracker.ensure_running()  # it lets Ctrl-C through again in the thread that starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def local_cluster(workers: int) -> dask.LocalCluster:
    """Workers on this machine, in the current folder: processes of one thread each.

    Args:
        workers: How many.

    Raises:
        GraspAtlasError: If they do not start.
    """
    import dask.distributed as dask

    try:
        with _deaf_to_ctrl_c(), nullcontext() if KNOWS_SAFE_PATH else _empty_folder():
            # What fails is raised to the caller; what workers say while they are closed is of no use. Without a
            # dashboard there is still a server, on port 8787 of all interfaces unless told: two clusters would collide.
            cluster = dask.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                silence_logs="CRITICAL",
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
            )
    except RuntimeError as error:
        raise GraspAtlasError(
            f"workers on this machine did not start ({error}); a script must start them below "
            'if __name__ == "__main__", since each of them imports the script'
        ) from None
    if not KNOWS_SAFE_PATH:
        with dask.Client(cluster, set_as_default=False) as client:
            client.run(os.chdir, os.getcwd())
    return cluster
