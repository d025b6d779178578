"""What others can do to somebody who looks at results: files in the way, archives, names, open ports."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import graspatlas as ga
from graspatlas.viewer import view
from graspatlas.viewer.web.browser import close

#: Modules of the standard library, and others, that the viewer or a worker imports.
PLANTED = ("html", "secrets", "pickle", "socket", "multiprocessing", "tornado", "zmq", "numpy", "base64", "selectors")


@pytest.fixture
def planted(tmp_path: Path) -> Path:
    """A folder with modules in the way; whatever imports one leaves a mark."""
    folder = tmp_path / "planted"
    folder.mkdir()
    for name in PLANTED:
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / 'mark')!r}, 'a').write({name!r} + ' ')\n")
    return folder


@pytest.fixture
def command(tmp_path: Path) -> list[str]:
    """The command line as pip installs it: a script elsewhere, whose folder comes first among the modules."""
    script = tmp_path / "bin" / "graspatlas"
    script.parent.mkdir()
    script.write_text(
        "import sys\nfrom graspatlas.cli import main\nif __name__ == '__main__':\n    sys.exit(main(sys.argv[1:]))\n"
    )
    return [sys.executable, str(script)]


def listening(pid: int) -> set[str]:
    """Addresses on which a process listens, as Linux lists them."""
    own = {os.readlink(entry) for entry in Path(f"/proc/{pid}/fd").iterdir() if entry.is_symlink()}
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and f"socket:[{words[9]}]" in own:
                found.add(words[1].split(":")[0])
    return found


# Folders with modules in the way


@pytest.mark.skipif(not Path("/proc/self/net/tcp").exists(), reason="Linux lists sockets there")
@pytest.mark.parametrize("also", [[], ["--meshcat"]], ids=["page", "meshcat"])
def test_view_runs_nothing_of_the_current_folder_and_listens_on_loopback(
    planted: Path, command: list[str], saved: Path, tmp_path: Path, also: list[str]
) -> None:
    process = subprocess.Popen(
        [*command, "view", str(saved), "--no-browser", *also], cwd=planted, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stderr is not None
        said = process.stderr.readline()
        assert "http://127.0.0.1:" in said, said
        children = subprocess.run(["ps", "--ppid", str(process.pid), "-o", "pid="], capture_output=True, text=True)
        everyone = [process.pid, *map(int, children.stdout.split())]
        addresses = set().union(*(listening(pid) for pid in everyone))
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=30)
    assert process.returncode == 0
    assert addresses == {"0100007F"}, "127.0.0.1 as /proc writes it"
    assert not (tmp_path / "mark").exists(), (tmp_path / "mark").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("knows_safe_path", [True, False])
def test_the_workers_of_a_sweep_run_nothing_of_the_current_folder(
    planted: Path, command: list[str], tmp_path: Path, knows_safe_path: bool
) -> None:
    if knows_safe_path and sys.version_info < (3, 11):
        pytest.skip("this version of Python knows no safe path")
    script = Path(command[1])
    known = f"import graspatlas.sweep.workers\ngraspatlas.sweep.workers.KNOWS_SAFE_PATH = {knows_safe_path}\n"
    text = script.read_text().replace("if __name__", f"{known}if __name__")
    if not knows_safe_path:
        text = text.replace(
            "graspatlas.sweep.workers.KNOWS",
            "graspatlas.sweep.workers._safe_path = lambda: __import__('contextlib').nullcontext()\n"
            "graspatlas.sweep.workers.KNOWS",
        )
    script.write_text(text)
    words = ["sweep", "planar_hand", "--radius", "0.4", "--workers", "1", "--output", str(tmp_path / "out"), "--json"]
    done = subprocess.run([*command, *words], cwd=planted, capture_output=True, text=True, timeout=120)
    assert not (tmp_path / "mark").exists(), (tmp_path / "mark").read_text()
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["failed"] == 0


def test_a_browser_is_told_the_scene_and_not_heard(can_result: ga.Result) -> None:
    from tornado.websocket import websocket_connect

    visualizer = view(can_result, open_browser=False, wait=False)

    async def look() -> int:
        page = await websocket_connect(visualizer.url().replace("http", "ws").replace("static/", ""))
        size = 0
        while size < 100_000:
            size += len(await asyncio.wait_for(page.read_message(), 10))
        await page.write_message(json.dumps({"data": "data:image/png;base64,AAAA"}))
        await page.write_message("no JSON")
        page.close()
        while await page.read_message() is not None:
            pass
        return size

    try:
        assert asyncio.run(look()) >= 100_000
        visualizer["more"].delete()
        assert visualizer.window.server.running
    finally:
        close(visualizer)
    assert not visualizer.window.server.running


def test_hosts(planar_result: ga.Result) -> None:
    for host in ("", "no.such.host.invalid", "203.0.113.7", "a\0b", 7):
        with pytest.raises(ga.GraspAtlasError, match="host"):
            view(planar_result, open_browser=False, wait=False, host=host)  # type: ignore[arg-type]
    visualizer = view(planar_result, open_browser=False, wait=False, host="0.0.0.0")
    try:
        assert visualizer.url().startswith("http://127.0.0.1:")
    finally:
        close(visualizer)
