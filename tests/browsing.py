"""A headless Chromium with real pointer and key events, driven by its own protocol through a pipe."""

from __future__ import annotations

import base64
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from screens import QUIET_FLAGS, find_browser

FLAGS = ("--headless=new", *QUIET_FLAGS, "--hide-scrollbars", "--remote-debugging-pipe")
#: Starts a program that reads from 3 and writes to 4.
ON_PIPES = """import fcntl, os, sys
read, write = (fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3])
os.dup2(read, 3)
os.dup2(write, 4)
os.execv(sys.argv[3], sys.argv[3:])"""
#: True in an explorer page that can be used, and in any other page that has all its pictures.
READY = "document.documentElement && document.documentElement.dataset.ready === 'yes'"
LOADED = "location.protocol === 'file:' && document.readyState === 'complete'"
#: Time in which the browser must answer [s].
PATIENCE = 30.0
KEYS = {"Enter": ("Enter", 13, "\r"), "Escape": ("Escape", 27, ""), " ": ("Space", 32, " ")} | {
    f"Arrow{side}": (f"Arrow{side}", code, "") for side, code in (("Left", 37), ("Up", 38), ("Right", 39), ("Down", 40))
}


class Tab:
    """A page in the browser. What it complains of is in ``complaints``."""

    def __init__(self, to: int, back: int) -> None:
        self._to, self._back, self._number, self._rest = to, back, 0, b""
        self._session: str | None = None
        self.complaints: list[str] = []
        self.requests: list[str] = []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **params: Any) -> Any:
        """Send a command of the protocol and wait for its answer."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        for answer in self._messages():
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            self._note(answer)
        raise AssertionError(f"the browser does not answer {method}")

    def _messages(self) -> Iterator[dict[str, Any]]:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            while b"\0" in self._rest:
                text, self._rest = self._rest.split(b"\0", 1)
                yield json.loads(text)
            if select.select([self._back], [], [], 1.0)[0]:
                self._rest += os.read(self._back, 1 << 20)

    def _note(self, event: dict[str, Any]) -> None:
        method, params = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description") or details["text"])
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(arg.get("value", arg)) for arg in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.complaints.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])

    def run(self, script: str) -> Any:
        """Value of an expression in the page; a promise is waited for."""
        got = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in got, got["exceptionDetails"]
        return got["result"].get("value")

    def open(
        self,
        address: str,
        width: int = 1000,
        height: int = 640,
        *,
        dark: bool = False,
        touch: bool = False,
        ready: str = READY,
    ) -> None:
        """Open a page, by default an explorer page, and wait until it is ready."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        self.ask("Emulation.setTouchEmulationEnabled", enabled=touch)
        feature = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[feature])
        self.ask("Page.navigate", url="about:blank")
        self.ask("Page.navigate", url=address)
        self.wait_for(ready)
        self.frames()

    def wait_for(self, condition: str, seconds: float = 30.0) -> None:
        """Wait until an expression of the page is true."""
        end = time.monotonic() + seconds
        while not self.run(f"Boolean({condition})"):
            assert time.monotonic() < end, f"never true: {condition}; {self.complaints}"
            time.sleep(0.05)

    def frames(self, count: int = 2) -> None:
        """Wait for so many frames."""
        for _ in range(count):
            self.run("new Promise(requestAnimationFrame)")

    def mouse(self, kind: str, x: float, y: float, button: str = "none", **also: Any) -> None:
        """A real pointer event: ``mouseMoved``, ``mousePressed``, ``mouseReleased`` or ``mouseWheel``."""
        count = 1 if kind in ("mousePressed", "mouseReleased") else 0
        held = int(button == "left" and kind != "mouseReleased")
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=held, clickCount=count, **also)

    def click(self, x: float, y: float) -> None:
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y, "left")
        self.mouse("mouseReleased", x, y, "left")

    def drag(self, start: Sequence[float], end: Sequence[float], steps: int = 6) -> None:
        self.mouse("mousePressed", *start, "left")
        for i in range(1, steps + 1):
            place = [a + (b - a) * i / steps for a, b in zip(start, end, strict=True)]
            self.mouse("mouseMoved", *place, "left")
        self.mouse("mouseReleased", *end, "left")

    def touch(self, *fingers: list[tuple[float, float]]) -> None:
        """Fingers that go through places, one list each, at the same time."""
        for i, kind in [(0, "touchStart"), *((i, "touchMove") for i in range(1, len(fingers[0])))]:
            points = [{"x": finger[i][0], "y": finger[i][1], "id": n} for n, finger in enumerate(fingers)]
            self.ask("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        self.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def press(self, key: str) -> None:
        """A real key, down and up."""
        code, number, text = KEYS.get(key, (f"Key{key.upper()}", ord(key.upper()[0]), key))
        for kind in ("keyDown", "keyUp"):
            also = {"text": text} if text and kind == "keyDown" else {}
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode=number, **also)

    def middle(self, css: str) -> tuple[float, float]:
        """Middle of an element in the window, into which it is scrolled."""
        self.run(f"document.querySelector({css!r}).scrollIntoView({{ block: 'nearest' }})")
        box = self.box(css)
        return float(box["x"] + box["width"] / 2.0), float(box["y"] + box["height"] / 2.0)

    def box(self, css: str) -> dict[str, float]:
        """Where an element is: ``x``, ``y``, ``width``, ``height``."""
        return dict(self.run(f"document.querySelector({css!r}).getBoundingClientRect().toJSON()"))

    def choose(self, css: str, option: str) -> None:
        """Choose an option of a list by its text, as a user who has opened it."""
        self.run(
            f"""(() => {{
            const list = document.querySelector({css!r});
            list.selectedIndex = [...list.options].findIndex((option) => option.text === {option!r});
            list.dispatchEvent(new Event("change"));
        }})()"""
        )

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Save what is seen, or the whole page, as a PNG file."""
        got = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(got["data"]))


@contextmanager
def browser(folder: Path) -> Iterator[Tab]:
    """A browser with one page, closed at the end."""
    (read, to), (back, write) = os.pipe(), os.pipe()
    words = [find_browser(), *FLAGS, f"--user-data-dir={folder / 'profile'}"]
    command = [sys.executable, "-c", ON_PIPES, str(read), str(write), *words]
    process = subprocess.Popen(command, pass_fds=(read, write), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    os.close(read)
    os.close(write)
    try:
        tab = Tab(to, back)
        yield tab
        session, tab._session = tab._session, None
        tab.ask("Browser.close")
        assert session
    finally:
        os.close(to)
        os.close(back)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
