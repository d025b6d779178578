"""The scene in a browser, served by meshcat."""

from __future__ import annotations

import signal
import sys
import threading
import time
from typing import TYPE_CHECKING

from graspatlas.result.result import Result
from graspatlas.support.terminal import say
from graspatlas.viewer.films.animation import Film
from graspatlas.viewer.scene.scene import Scene
from graspatlas.viewer.web.animation_page import film_animation, film_caption, film_commands
from graspatlas.viewer.web.page import Command, commands

if TYPE_CHECKING:
    import meshcat

__all__ = ["close", "show"]


def show(shown: Result | Film, *, open_browser: bool, wait: bool, host: str) -> meshcat.Visualizer:
    """Serve a result's scene, or a film; see :func:`graspatlas.viewer.view`."""
    if isinstance(shown, Film):
        name, told = shown.name, [*film_commands(shown), film_caption(shown), film_animation(shown)]
    else:
        name, told = shown.problem.name, list(commands(Scene(shown, arm=True), with_legend=True))
    visualizer = _start(host)
    try:
        for command in told:
            visualizer.window.send(_Command(command))
        say(f"{name} at {visualizer.url()}", file=sys.stderr)
        if open_browser:
            visualizer.open()
        if wait:
            print("press Ctrl-C to end", file=sys.stderr)
            _end_with_us()
            _serve(visualizer)
    except KeyboardInterrupt:
        close(visualizer)
    return visualizer


def close(visualizer: meshcat.Visualizer) -> None:
    """End the server of a visualizer, and what listens to it."""
    visualizer.window.close()


class _Command:
    """A command as meshcat's window sends it."""

    def __init__(self, content: Command) -> None:
        self._content = content

    def lower(self) -> Command:
        return self._content


def _start(host: str) -> meshcat.Visualizer:
    from graspatlas.viewer.web.server import Server, Visualizer, Window  # slow to import

    return Visualizer(window=Window(Server(host)))


def _end_with_us() -> None:
    """Let a request to terminate end the server too, as Ctrl-C does."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def _serve(visualizer: meshcat.Visualizer) -> None:
    while visualizer.window.server.running:
        time.sleep(0.2)
    close(visualizer)
