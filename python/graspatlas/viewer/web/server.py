"""Meshcat's server in a thread of this program, on one address and without a control port.

Meshcat starts its server as ``python -m``, which puts the current folder before the standard library, on all addresses
of the machine, and takes commands from whoever connects to a second port. Here nothing is started, only one socket
listens, and commands come from this program's memory (``inproc``).
"""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import ipaddress
import itertools
import json
import queue
import socket
import threading
import warnings

from graspatlas.errors import GraspAtlasError
from graspatlas.support.validation import shown

with warnings.catch_warnings():  # meshcat imports a deprecated part of pyzmq
    warnings.simplefilter("ignore", DeprecationWarning)
    import tornado.httpserver
    import tornado.web
    from meshcat.servers.zmqserver import VIEWER_HTML, VIEWER_ROOT, StaticFileHandlerNoCache, WebSocketHandler
    from meshcat.servers.zmqserver import ZMQWebSocketBridge as MeshcatBridge
    from meshcat.visualizer import ViewerWindow, Visualizer

__all__ = ["LOOPBACK", "Server", "Visualizer", "Window"]

#: The address on which only programs of this machine reach the page.
LOOPBACK = "127.0.0.1"
#: Port of the page where it is free, as meshcat has it; any free one else.
PORT = 7000
#: Time in which the server must start, or end [s].
PATIENCE = 20.0

_numbers = itertools.count()


class Server:
    """Serves meshcat's page in a thread until it is closed, or the program ends.

    Args:
        host: Address or name on which it listens.

    Raises:
        GraspAtlasError: If it cannot listen there.
    """

    def __init__(self, host: str = LOOPBACK) -> None:
        self._socket = _listening(host)
        self.zmq_url = f"inproc://graspatlas-{next(_numbers)}"
        self.web_url = _page_address(host, self._socket.getsockname()[1])
        answer: queue.Queue[_Bridge | Exception] = queue.Queue()
        self._thread = threading.Thread(target=self._run, args=(answer,), name="graspatlas-viewer", daemon=True)
        self._thread.start()
        started = answer.get(timeout=PATIENCE)
        if isinstance(started, Exception):
            self._thread.join(PATIENCE)
            raise GraspAtlasError(
                f"meshcat's server does not start: {started}; export_html writes a page that needs no server"
            )
        self._bridge = started
        atexit.register(self.close)

    @property
    def running(self) -> bool:
        """Whether the page is served."""
        return self._thread.is_alive()

    def close(self) -> None:
        """End it; what was closed before stays so."""
        atexit.unregister(self.close)
        if self._thread.is_alive():
            self._bridge.ioloop.add_callback(self._bridge.end)
            self._thread.join(PATIENCE)

    def _run(self, answer: queue.Queue[_Bridge | Exception]) -> None:
        """The life of the thread."""
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        try:
            bridge = _Bridge(self._socket, self.zmq_url, self.web_url)
        except Exception as error:  # reported where the server was asked for
            self._socket.close()
            answer.put(error)
        else:
            answer.put(bridge)
            bridge.run()
            loop.run_until_complete(loop.shutdown_asyncgens())
        finally:
            loop.close()


class Window(ViewerWindow):  # type: ignore[misc]  # meshcat has no types
    """Meshcat's window onto a server of ours; its ``server_proc`` is None, since there is no other process.

    Args:
        server: The server.
    """

    def __init__(self, server: Server) -> None:
        self.server, self.server_proc = server, None
        self.zmq_url, self.web_url = server.zmq_url, server.web_url
        self.connect_zmq()

    def close(self) -> None:
        """End the server, and what listens to it."""
        self.zmq_socket.close(linger=0)
        self.server.close()


class _Bridge(MeshcatBridge):  # type: ignore[misc]  # meshcat has no types
    """Meshcat's bridge from commands to browsers, on a socket that listens already."""

    context = ViewerWindow.context  # what inproc addresses are looked up in

    def __init__(self, listening: socket.socket, zmq_url: str, web_url: str) -> None:
        self._listening, self.awaits_image = listening, False
        super().__init__(zmq_url=zmq_url, port=listening.getsockname()[1])
        self.web_url = web_url

    def make_app(self) -> tornado.web.Application:
        bridge = self

        class Application(tornado.web.Application):
            def listen(self, port: int, *_: object, **__: object) -> tornado.httpserver.HTTPServer:
                """Take the socket that there is; tornado would listen on every address."""
                http = bridge._http = tornado.httpserver.HTTPServer(self)
                http.add_socket(bridge._listening)
                return http

        files = {"path": VIEWER_ROOT, "default_filename": VIEWER_HTML}
        return Application(
            [(r"/static/(.*)", StaticFileHandlerNoCache, files), (r"/", _Socket, {"bridge": self})],
            log_function=lambda handler: None,
        )

    def handle_zmq(self, frames: list[bytes]) -> None:
        self.awaits_image = self.awaits_image or frames[0] == b"capture_image"
        super().handle_zmq(frames)

    def end(self) -> None:
        """Close all sockets and let the thread end; runs in it."""
        for page in list(self.websocket_pool):
            page.close()
        self._http.stop()
        self.zmq_stream.close(linger=0)
        self.ioloop.add_callback(self.ioloop.stop)


class _Socket(WebSocketHandler):  # type: ignore[misc]  # meshcat has no types
    """A browser; it is told the scene, and heard only when a picture was asked for."""

    def open(self, *_: str) -> None:
        self.bridge.websocket_pool.add(self)
        self.bridge.send_scene(self)

    def on_message(self, message: str | bytes) -> None:
        if self.bridge.awaits_image:
            with contextlib.suppress(ValueError, KeyError, TypeError, AttributeError):  # no picture
                self.bridge.send_image(json.loads(message)["data"])
                self.bridge.awaits_image = False

    def on_close(self) -> None:
        self.bridge.websocket_pool.discard(self)


def _listening(host: str) -> socket.socket:
    """A socket that listens on an address, and on no other."""
    if not isinstance(host, str) or not host or "\0" in host:
        raise GraspAtlasError(f"host must be an address such as '{LOOPBACK}', got {shown(host)}")
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(host, PORT, type=socket.SOCK_STREAM)[0]
        try:
            return _bound(socket.socket(family, kind, protocol), place)
        except OSError:  # somebody listens there
            return _bound(socket.socket(family, kind, protocol), (place[0], 0, *place[2:]))
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise GraspAtlasError(
            f"the viewer cannot listen on host {shown(host)}: {reason}; give an address of this machine, such as "
            f"'{LOOPBACK}', or write a page that needs no server: graspatlas view --html FILE"
        ) from None


def _bound(one: socket.socket, place: tuple[str | int | bytes, ...]) -> socket.socket:
    """A socket made to listen at an address and port, or closed."""
    try:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        one.setblocking(False)
        one.bind(place)
        one.listen()
    except BaseException:
        one.close()
        raise
    return one


def _page_address(host: str, port: int) -> str:
    """Where this machine's browser finds the page; what listens on all addresses does so on loopback too."""
    with contextlib.suppress(ValueError):
        address = ipaddress.ip_address(host)
        if address.is_unspecified:
            host = LOOPBACK if address.version == 4 else "::1"
        if address.version == 6:
            host = f"[{host}]"
    return f"http://{host}:{port}/static/"
