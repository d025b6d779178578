"""A result served to the browser, with buttons for what needs Python; and an atlas while it grows."""

from __future__ import annotations

import signal
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graspatlas.atlas.growth import watched
from graspatlas.problem.problem import Problem
from graspatlas.result.result import Result
from graspatlas.support.terminal import say
from graspatlas.viewer.live.growth import GrowthPage
from graspatlas.viewer.live.page import LivePage
from graspatlas.viewer.live.server import LOOPBACK, PageServer
from graspatlas.viewer.live.session import Session

__all__ = ["Watch", "serve", "watching"]

#: Time that work which is asked to stop gets when the server ends [s].
PATIENCE = 5.0
#: The page of so many charts takes seconds to make.
LARGE = 10_000


def serve(
    result: Result,
    file: Path | None = None,
    *,
    chart: int | None = None,
    open_browser: bool = True,
    host: str = LOOPBACK,
) -> None:
    """Serve the page of a result until Ctrl-C is pressed.

    Args:
        result: The result.
        file: The file that it was read from; what is found may be saved beside it.
        chart: The chart that it opens at.
        open_browser: Whether to open it in the browser.
        host: Address on which it is served.

    Raises:
        GraspAtlasError: If a mesh cannot be read, there is no such chart, or it cannot be served on this address.
    """
    if result.atlas.n_charts > LARGE:
        print(f"making the page of {result.atlas.n_charts:,} charts", file=sys.stderr)
    session = Session(result, file)
    server = PageServer(LivePage(session, chart), host)
    _announce(server, result.problem.name, open_browser)
    _wait(server, session)


class Watch:
    """A server that shows an atlas while it grows, and then its result.

    Args:
        server: The server.
        page: What it shows now.
    """

    def __init__(self, server: PageServer, page: GrowthPage) -> None:
        self._server, self._page = server, page

    def serve(self, result: Result, file: Path | None = None) -> None:
        """Show the result until Ctrl-C is pressed; see :func:`serve`."""
        self._page.phase = "making the page of the whole atlas"
        session = Session(result, file)
        self._server.page = LivePage(session)
        _wait(self._server, session)


@contextmanager
def watching(
    problem: Problem, index: str | None = None, *, open_browser: bool = True, host: str = LOOPBACK
) -> Iterator[Watch]:
    """Show what atlas grows within the block.

    Args:
        problem: The problem.
        index: Name of the index that colours its charts; where it takes long they are coloured by their order.
        open_browser: Whether to open the page in the browser.
        host: Address on which it is served.

    Raises:
        GraspAtlasError: If it cannot be served on this address.
    """
    page = GrowthPage(problem, index)
    server = PageServer(page, host)
    try:
        _announce(server, problem.name, open_browser)
        with watched(page.watch):
            yield Watch(server, page)
    finally:
        server.close()


def _announce(server: PageServer, name: str, open_browser: bool) -> None:
    say(f"{name} at {server.address}", file=sys.stderr)
    if open_browser:
        webbrowser.open(server.address)


def _wait(server: PageServer, session: Session) -> None:
    """Serve until Ctrl-C, or a request to terminate; work that runs is asked to stop."""
    print("press Ctrl-C to end", file=sys.stderr)
    try:
        with _hearing():
            while server.running:
                time.sleep(0.2)
    except KeyboardInterrupt:
        pass
    finally:
        session.jobs.stop()
        server.close()
        session.jobs.wait(PATIENCE)
    unsaved = len(session.told) - session.saved
    if unsaved:
        print(f"not saved: {unsaved} findings of the page", file=sys.stderr)


@contextmanager
def _hearing() -> Iterator[None]:
    """A block that Ctrl-C ends, whatever it has ended before, and that a request to terminate ends too."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
