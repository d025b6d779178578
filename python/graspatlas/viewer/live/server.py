"""A server of one page, for the programs of this machine: who may ask, and which part answers.

It listens on one address. It answers only requests whose Host header names this machine, so that no page of another
site reaches it under a name of its own (DNS rebinding), and only those that carry the token which the page was given,
so that no page of another site can ask for work.
"""

from __future__ import annotations

import ipaddress
import json
import secrets
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Protocol
from urllib.parse import parse_qs, urlsplit

from graspatlas.errors import GraspAtlasError
from graspatlas.support.validation import PlainTable, StatedTable, shown
from graspatlas.viewer.live.jobs import Busy

__all__ = ["LOOPBACK", "TOKEN_HEADER", "Page", "PageServer"]

#: The address on which only programs of this machine reach the page.
LOOPBACK = "127.0.0.1"
#: Port of the page where it is free; any free one else.
PORT = 7100
#: Header in which the page sends its token.
TOKEN_HEADER = "X-Graspatlas-Token"
#: Requests are short [bytes].
LONGEST = 10_000
#: So are the numbers in them [digits].
LONGEST_NUMBER = 9


class Page(Protocol):
    """What a server shows."""

    def text(self, token: str) -> str:
        """The page, which is to send the token."""

    def news(self, since: int, epoch: int) -> PlainTable:
        """What has happened since the page was told so much, in this epoch of what it is told."""

    def ask(self, asked: StatedTable) -> PlainTable:
        """Do what the page asks for.

        Raises:
            GraspAtlasError: If that makes no sense.
        """


class PageServer:
    """Serves a page in threads until it is closed.

    Args:
        page: The page; another one can take its place.
        host: Address or name on which it listens.
        port: Port where it is free; any free one else.

    Raises:
        GraspAtlasError: If it cannot listen there.
    """

    def __init__(self, page: Page, host: str = LOOPBACK, port: int = PORT) -> None:
        self.page = page
        self.token = secrets.token_urlsafe(24)
        self._host = host
        self._http = _listening(host, port, self._handler())
        self._thread = threading.Thread(
            target=self._http.serve_forever, args=(0.1,), name="graspatlas-live", daemon=True
        )
        self._thread.start()

    @property
    def address(self) -> str:
        """Where the browser finds the page."""
        host = LOOPBACK if _is_any(self._host) else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{self._http.server_address[1]}/"

    @property
    def running(self) -> bool:
        """Whether the page is served."""
        return self._thread.is_alive()

    def close(self) -> None:
        """End it."""
        if self.running:
            self._http.shutdown()
            self._thread.join()
        self._http.server_close()

    def knows(self, host: str) -> bool:
        """Whether a Host header names this machine as this server is reached."""
        name = (urlsplit(f"//{host}").hostname or "").rstrip(".")
        if name in ("localhost", self._host.lower()):
            return True
        with suppress(ValueError):
            address = ipaddress.ip_address(name)
            return address.is_loopback or _is_any(self._host)
        return _is_any(self._host) and name == socket.gethostname().lower()

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        server = self

        class Handler(_Handler):
            of = server

        return Handler


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    of: PageServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "graspatlas", ""
    timeout = 30

    def do_GET(self) -> None:
        """The page, and what is new."""
        place = urlsplit(self.path)
        self._guarded(lambda: self._get(place.path, parse_qs(place.query)), token=place.path != "/")

    def do_POST(self) -> None:
        """What the page asks for."""
        self._guarded(self._post, token=True)

    def _get(self, path: str, query: dict[str, list[str]]) -> None:
        if path == "/":
            self._answer(HTTPStatus.OK, self.of.page.text(self.of.token).encode("utf-8"), "text/html; charset=utf-8")
        elif path == "/news":
            since, epoch = (_count(query, name) for name in ("since", "epoch"))
            self._tell(HTTPStatus.OK, self.of.page.news(since, epoch))
        else:
            self._tell(HTTPStatus.NOT_FOUND, {"error": "there is no such page"})

    def _post(self) -> None:
        if urlsplit(self.path).path != "/ask":
            self._tell(HTTPStatus.NOT_FOUND, {"error": "there is no such page"})
            return
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > LONGEST:
            self.close_connection = True
            raise GraspAtlasError(f"a request has at most {LONGEST} bytes, and says how many")
        try:
            asked = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            raise GraspAtlasError("a request is one object in JSON") from None
        if not isinstance(asked, dict):
            raise GraspAtlasError("a request is one object in JSON")
        self._tell(HTTPStatus.ACCEPTED, self.of.page.ask(asked))

    def _guarded(self, answer: Callable[[], None], token: bool) -> None:
        """Answer who may ask; errors go to the page in words."""
        if not self.of.running:  # a connection that has stayed open
            self.close_connection = True
            return
        refusal = self._refusal(token)
        if refusal:
            self.close_connection = True
            self._tell(HTTPStatus.FORBIDDEN, {"error": refusal})
            return
        try:
            answer()
        except Busy as error:
            self._tell(HTTPStatus.CONFLICT, {"error": str(error)})
        except GraspAtlasError as error:
            self._tell(HTTPStatus.BAD_REQUEST, {"error": str(error)})
        except (BrokenPipeError, ConnectionResetError):  # the page has been closed
            self.close_connection = True

    def _refusal(self, token: bool) -> str:
        """Why a request is refused; empty if it is not."""
        host = self.headers.get("Host", "")
        if not self.of.knows(host):
            return "this server answers to its own address only"
        origin = self.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return "the request comes from another page"
        given = self.headers.get(TOKEN_HEADER, "")
        if token and not secrets.compare_digest(given.encode("utf-8", "replace"), self.of.token.encode()):
            return "the page belongs to another run of graspatlas: load it again"
        return ""

    def _tell(self, status: HTTPStatus, table: PlainTable) -> None:
        self._answer(status, json.dumps(table).encode("utf-8"), "application/json")

    def _answer(self, status: HTTPStatus, body: bytes, kind: str) -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store"}
        headers |= {"X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Nothing: the terminal is for the user."""


def _count(query: dict[str, list[str]], name: str) -> int:
    """A number of a request, 0 where it has none."""
    text = query.get(name, ["0"])[0]
    if not (text.isascii() and text.isdecimal()) or len(text) > LONGEST_NUMBER:
        raise GraspAtlasError(f"{name} must be a whole number, got {shown(text)}")
    return int(text)


def _listening(host: str, port: int, handler: type[BaseHTTPRequestHandler]) -> ThreadingHTTPServer:
    """A server that listens on an address, and on no other."""
    if not isinstance(host, str) or not host or "\0" in host:
        raise GraspAtlasError(f"host must be an address such as '{LOOPBACK}', got {shown(host)}")
    try:
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]

        class Server(ThreadingHTTPServer):
            address_family = family
            daemon_threads = True
            allow_reuse_address = True

            def server_bind(self) -> None:
                """Without the look-up of the host's full name, for which one can wait long."""
                TCPServer.server_bind(self)
                self.server_name, self.server_port = host, int(self.server_address[1])

        try:
            return Server((str(place[0]), port), handler)
        except OSError:  # somebody listens there
            return Server((str(place[0]), 0), handler)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise GraspAtlasError(
            f"the page cannot be served on host {shown(host)}: {reason}; give an address of this machine, such as "
            f"'{LOOPBACK}', or write a page that needs no server: graspatlas view --html FILE"
        ) from None


def _is_any(host: str) -> bool:
    """Whether a server on this address listens on all of them."""
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_unspecified
    return False
