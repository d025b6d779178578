"""A result served to the browser, with buttons for what needs Python."""

from __future__ import annotations

import signal
import sys
import threading
import time
import webbrowser
from pathlib import Path

from graspatlas.result.result import Result
from graspatlas.support.terminal import say
from graspatlas.viewer.live.page import LivePage
from graspatlas.viewer.live.server import LOOPBACK, PageServer
from graspatlas.viewer.live.session import Session

__all__ = ["serve", "wait_for"]

#: Time that work which is asked to stop gets when the server ends [s].
PATIENCE = 5.0


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
    session = Session(result, file)
    server = PageServer(LivePage(session, chart), host)
    say(f"{result.problem.name} at {server.address}", file=sys.stderr)
    if open_browser:
        webbrowser.open(server.address)
    wait_for(server, session)


def wait_for(server: PageServer, session: Session) -> None:
    """Serve until Ctrl-C, or a request to terminate; work that runs is asked to stop."""
    print("press Ctrl-C to end", file=sys.stderr)
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
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
