"""One piece of work at a time, in a thread: how far it is, whether it is to stop, and how it ended."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field

from graspatlas.errors import GraspAtlasError
from graspatlas.support.validation import PlainTable

__all__ = ["Busy", "Job", "Jobs", "Work"]


class Busy(GraspAtlasError):
    """Another piece of work is not done yet."""


@dataclass
class Job:
    """A piece of work as the page sees it.

    Attributes:
        number: Which one it is, from 1.
        name: What is done.
        done: How much of it.
        total: Of how much; None where that is not known.
        text: What there is to say of it, in the end how it ended.
        error: Whether it ended in an error.
        running: Whether it goes on.
        show: Numbers of the grasps to be shown when it has ended.
        asked: Set when it is to stop; what there is then is kept.
    """

    number: int
    name: str
    done: int = 0
    total: int | None = None
    text: str = ""
    error: bool = False
    running: bool = True
    show: list[int] = field(default_factory=list)
    asked: threading.Event = field(default_factory=threading.Event)

    @property
    def stopping(self) -> bool:
        """Whether it is to stop."""
        return self.asked.is_set()

    def report(self, done: int, total: int | None, text: str = "") -> None:
        """Say how far it is."""
        self.done, self.total, self.text = done, total, text

    def table(self) -> PlainTable:
        """It in plain data."""
        names = ("number", "name", "done", "total", "text", "error", "running", "stopping", "show")
        return {name: getattr(self, name) for name in names}


#: What a job does; it asks the job whether to stop, and returns what there is to say in the end.
Work = Callable[[Job], str]


class Jobs:
    """The work of a server, one piece after another."""

    def __init__(self) -> None:
        self.last: Job | None = None
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def start(self, name: str, work: Work) -> Job:
        """Begin a piece of work.

        Raises:
            Busy: If another one runs.
        """
        with self._lock:
            if self.last is not None and self.last.running:
                raise Busy(f"'{self.last.name}' is not done yet: wait for it, or stop it")
            job = self.last = Job(1 if self.last is None else self.last.number + 1, name)
            self._thread = threading.Thread(target=_run, args=(job, work), name="graspatlas-job", daemon=True)
            self._thread.start()
        return job

    def stop(self) -> Job | None:
        """Ask what runs to stop."""
        if self.last is not None:
            self.last.asked.set()
        return self.last

    def wait(self, seconds: float) -> None:
        """Wait for what runs."""
        if self._thread is not None:
            self._thread.join(seconds)


def _run(job: Job, work: Work) -> None:
    """The life of a job's thread; an error is told, and ends nothing else."""
    try:
        job.text = work(job)
    except GraspAtlasError as error:
        job.text, job.error = str(error), True
    except Exception as error:
        traceback.print_exc(file=sys.stderr)
        job.text = f"{type(error).__name__}: {error}; the terminal says where"
        job.error = True
    finally:
        job.running = False
