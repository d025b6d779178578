"""What others can do to somebody who looks at results: files in the way, archives, names, open ports."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import stat
import struct
import subprocess
import sys
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.support.archives import DamagedArchive, read_arrays
from graspatlas.support.files import replaced
from graspatlas.support.terminal import printable
from graspatlas.viewer import export_html, save_picture, view
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


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory, small_result: ga.Result) -> Path:
    path = tmp_path_factory.mktemp("saved") / "result.npz"
    small_result.save(path)
    return path


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
def test_view_runs_nothing_of_the_current_folder_and_listens_on_loopback(
    planted: Path, command: list[str], saved: Path, tmp_path: Path
) -> None:
    process = subprocess.Popen(
        [*command, "view", str(saved), "--no-browser"], cwd=planted, stderr=subprocess.PIPE, text=True
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


def test_hosts(can_result: ga.Result) -> None:
    for host in ("", "no.such.host.invalid", "203.0.113.7", "a\0b", 7):
        with pytest.raises(ga.GraspAtlasError, match="host"):
            view(can_result, open_browser=False, wait=False, host=host)  # type: ignore[arg-type]
    visualizer = view(can_result, open_browser=False, wait=False, host="0.0.0.0")
    try:
        assert visualizer.url().startswith("http://127.0.0.1:")
    finally:
        close(visualizer)


# Paths that are no files


def special(kind: str, path: Path) -> None:
    """Put something at a path that is no file."""
    if kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a socket":
        here = os.getcwd()
        os.chdir(path.parent)  # names of sockets are short
        try:
            with socket.socket(socket.AF_UNIX) as one:
                one.bind(path.name)
        finally:
            os.chdir(here)
    else:
        try:
            os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 3))
        except OSError:
            pytest.skip("making a device is not permitted here")


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device"])
@pytest.mark.parametrize("through_a_link", [False, True])
def test_what_is_no_file_is_never_replaced(
    kind: str, through_a_link: bool, small_result: ga.Result, saved: Path, tmp_path: Path
) -> None:
    problem = ga.load_problem("planar_hand")
    ways = {
        "npz": small_result.save,
        "html": lambda path: export_html(small_result, path),
        "png": lambda path: save_picture(small_result, path),
        "json": small_result.save_grasps,
        "csv": small_result.save_grasps,
        "out.csv": ga.shortest_path(small_result, 0, 0).save_csv,
    }
    for ending, write in ways.items():
        real, path = tmp_path / f"real.{ending}", tmp_path / f"file.{ending}"
        special(kind, real if through_a_link else path)
        if through_a_link:
            path.symlink_to(real)
        before = os.stat(path)
        with pytest.raises(ga.GraspAtlasError, match=f"it is {kind}, not a file"):
            write(path)
        assert os.stat(path) == before
    folder = tmp_path / "checkpoint"
    folder.mkdir()
    special(kind, folder / "000000.npz")
    with pytest.raises(ga.GraspAtlasError, match=f"it is {kind}"):
        ga.optimize(problem, radius=0.4, max_charts=10, checkpoint=folder)
    assert not stat.S_ISREG(os.stat(folder / "000000.npz").st_mode)


@pytest.mark.parametrize(
    "words",
    [
        ["schema", "--output"],
        ["new", "example_robot_data:allegro_right_hand", "--output"],
        ["export", "RESULT", "--grasps"],
        ["pareto", "RESULT", "smallest_semi_axis", "inverse_condition_number", "--picture"],
        ["view", "RESULT", "--html"],
        ["path", "RESULT", "--csv"],
    ],
    ids=lambda words: words[0],
)
def test_commands_write_to_no_pipe(
    words: list[str], saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pipe = tmp_path / ("pipe.png" if words[0] == "pareto" else "pipe.csv")
    os.mkfifo(pipe)
    assert main([str(saved) if word == "RESULT" else word for word in [*words, str(pipe)]]) == 2
    assert stat.S_ISFIFO(os.stat(pipe).st_mode)
    errors = capsys.readouterr().err.splitlines()
    assert [line for line in errors if "error" in line] == errors[-1:]
    assert "a pipe" in errors[-1] or "exists" in errors[-1]


def test_symbolic_links_stay_and_what_they_point_to_is_replaced(small_result: ga.Result, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    target, link = tmp_path / "elsewhere" / "result.npz", tmp_path / "link.npz"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    small_result.save(link)
    assert link.is_symlink()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640, "the rights that the file had"
    assert ga.load_result(target).atlas.n_charts == small_result.atlas.n_charts
    (tmp_path / "dangling").symlink_to(tmp_path / "elsewhere" / "new.npz")
    small_result.save(tmp_path / "dangling")
    assert (tmp_path / "elsewhere" / "new.npz").is_file()
    (tmp_path / "ring").symlink_to(tmp_path / "ring")
    with pytest.raises(ga.GraspAtlasError, match="cannot write"):
        small_result.save(tmp_path / "ring")
    assert sorted(path.name for path in (tmp_path / "elsewhere").iterdir()) == ["new.npz", "result.npz"]


def test_new_files_have_the_rights_that_the_user_gives_files(tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        with replaced(tmp_path / "file") as stream:
            stream.write(b"x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o600


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device"])
def test_results_are_read_from_files_alone(kind: str, tmp_path: Path) -> None:
    special(kind, tmp_path / "result.npz")
    start = time.monotonic()
    for path in (tmp_path, tmp_path / "result.npz"):
        with pytest.raises(ga.GraspAtlasError, match=f"it is {kind}"):
            ga.load_result(path)
    assert time.monotonic() - start < 5.0


# Archives


def rewritten(saved: Path, path: Path, **arrays: object) -> Path:
    with np.load(saved) as file:
        whole = dict(file)
    np.savez_compressed(path, **{**whole, **arrays})  # type: ignore[arg-type]
    return path


def test_archives_that_unpack_to_much_are_refused_before_they_do(saved: Path, tmp_path: Path) -> None:
    bomb = rewritten(saved, tmp_path / "bomb.npz", residuals=np.zeros(40_000_000))
    assert bomb.stat().st_size < 2_000_000
    import tracemalloc

    tracemalloc.start()
    with pytest.raises(ga.GraspAtlasError, match="would unpack to 32"):
        ga.load_result(bomb)
    assert tracemalloc.get_traced_memory()[1] < 50_000_000
    tracemalloc.stop()


def npz(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return path


def npy(header: str, content: bytes = b"") -> bytes:
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + content


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000,), }\n", bytes(80)), "not as large as"),
        (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }\n", bytes(8)), "not as large as|broken"),
        (npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }\n", b"\x80\x04N."), "Python objects"),
        (npy("__import__('os').abort()\n"), "broken"),
        (npy("(" * 5000), "broken"),
        (b"", "broken"),
    ],
)
def test_arrays_that_are_not_what_they_say(content: bytes, reason: str, tmp_path: Path) -> None:
    with npz(tmp_path / "a.npz", x=content).open("rb") as stream, pytest.raises(DamagedArchive, match=reason):
        read_arrays(stream)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_archives_with_one_name_twice(tmp_path: Path) -> None:
    whole = npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }\n", bytes(8))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("x.npy", whole)
        archive.writestr("x.npy", whole)
    with (tmp_path / "a.npz").open("rb") as stream, pytest.raises(DamagedArchive, match="two of one name"):
        read_arrays(stream)


def checkpoint_arrays(folder: Path) -> tuple[Path, dict[str, np.ndarray]]:
    ga.optimize(ga.load_problem("gripper_skittle"), max_charts=60, checkpoint=folder)
    (path,) = folder.glob("*.npz")
    with np.load(path) as file:
        return path, dict(file)


def test_checkpoints_hold_what_an_atlas_has(tmp_path: Path) -> None:
    path, arrays = checkpoint_arrays(tmp_path / "c")

    def changed(name: str, at: int, value: float) -> np.ndarray:
        array = arrays[name].copy()
        array.reshape(-1)[at] = value
        return array

    twice = arrays["keys"].copy()
    twice[5] = twice[4]
    cases = [  # a NaN, a long vector, no vectors; an infinite and an empty place; charts twice; other kinds of numbers
        {"bases": changed("bases", 7, np.nan)},
        {"bases": changed("bases", 7, 3.0)},
        {"bases": 0.0 * arrays["bases"]},
        {"centers": changed("centers", 9, np.inf)},
        {"centers": 0.0 * arrays["centers"]},
        {"residuals": changed("residuals", 3, np.nan)},
        {"keys": twice},
        {"bases": arrays["bases"] + 0j},
        {"keys": arrays["keys"].astype(float)},
        {"more": np.zeros(3)},
    ]
    for change in cases:
        with path.open("wb") as stream:
            np.savez(stream, **{**arrays, **change})
        with pytest.raises(ga.GraspAtlasError, match=r"damaged|length one|quaternion"):
            ga.optimize(ga.load_problem("gripper_skittle"), checkpoint=tmp_path / "c")


# Names


EVIL = "can\x1b]0;owned\x07\x1b[31m\u202e\x9b31m\r"


def test_control_codes_in_names_do_not_reach_the_terminal(
    small_result: ga.Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = replace(small_result, problem=replace(small_result.problem, name=EVIL))
    named.save(tmp_path / "result.npz")
    hand = json.loads(json.dumps(ga.load_problem("planar_hand").to_dict()))
    hand["contacts"][0]["frame"] = EVIL
    (tmp_path / "frame.json").write_text(json.dumps(hand))
    (tmp_path / "name.json").write_text(json.dumps({**ga.load_problem("planar_hand").to_dict(), "name": EVIL}))
    (tmp_path / "field.json").write_text(json.dumps({EVIL: 1}))
    ways = [
        ["check-result", tmp_path],
        ["export", tmp_path, "--grasps", tmp_path / "g.csv"],
        ["pareto", tmp_path, "smallest_semi_axis", "inverse_condition_number"],
        ["path", tmp_path],
        ["densify", tmp_path, "0.2"],
        ["view", tmp_path, "--html", tmp_path / f"{EVIL}.html"],
        ["optimize", tmp_path / "frame.json"],
        ["optimize", tmp_path / "field.json"],
        ["check", tmp_path / "frame.json"],
        ["optimize", tmp_path / "name.json", "--radius", "0.4"],
        ["optimize", EVIL],
        ["optimize", "planar_hand", "--quality", EVIL],
    ]
    for words in ways:
        main([str(word) for word in words])
        said = capsys.readouterr()
        for text in (said.out, said.err):
            assert not [letter for letter in text if not letter.isprintable() and letter != "\n"], (words, text)


def test_printable() -> None:
    assert printable("plain é 手 2 mm") == "plain é 手 2 mm"
    assert printable("a\x1b[0m\nb\x9b\u202e\ud800\t") == "a\\x1b[0m\\nb\\x9b\\u202e\\ud800\\t"
