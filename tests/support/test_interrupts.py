"""Ctrl-C once, twice and three times, and a request to terminate: in processes of their own, with real signals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import slow_but

import graspatlas as ga
from graspatlas.support import interrupts
from graspatlas.support.interrupts import SAME_PRESS, hear, held, keeping, stoppable, stopped_by, stopping

CTRL_C, TERMINATE = signal.SIGINT, signal.SIGTERM
#: After the first signal; what is left to do then takes a fraction of it on an idle machine [s].
SOON = 6.0

#: A script that says when half a second of tracing is behind it.
READY = """
import sys
import threading
import graspatlas as ga
from graspatlas.atlas.growth import Growth

def ready():
    print("charts", file=sys.stderr, flush=True)

def traced(*arguments):
    threading.Timer(0.5, ready).start()
    return run(*arguments)

run = Growth.run
"""
TRACING = READY + "Growth.run = traced\n"
OPTIMIZE = (
    TRACING
    + """
result = ga.optimize(ga.load_problem("schunk_oil_bottle"), dimension=3, radius=0.03, require=())
result.save("kept.npz")
print(result.status, result.atlas.n_charts, len(result.qualities), sep=";")
"""
)
PYTHON_SYSTEM = (
    TRACING
    + """
import time
import numpy as np

class Slow(ga.System):
    def residual(self, x):
        time.sleep(1e-4)
        return [x @ x - 1.0]

    def jacobian(self, x):
        return [2.0 * x]

atlas = ga.build_atlas(Slow(3, 1), [0, 0, 1], radius=0.01, epsilon=0.1)
print(atlas.status, atlas.n_charts, len(atlas.neighbours), sep=";")
"""
)
INDEX = (
    READY
    + """
import time

def slow(grasp):
    if grasp.chart == 5:
        ready()
    time.sleep(0.02 if grasp.chart > 0 else 0.0)
    return float(grasp.q[0])

problem = ga.load_problem("schunk_oil_bottle")
try:
    ga.optimize(problem, dimension=2, radius=0.06, quality=slow, require=())
except KeyboardInterrupt as error:
    atlas = error.atlas
again = ga.optimize(problem, dimension=2, radius=0.06, quality="joint_centrality", require=(), atlas=atlas)
print(again.status, again.atlas.n_charts, len(again.qualities), sep=";")
"""
)


def signalled(words: list[str], folder: Path, *signals: tuple[float, int]) -> subprocess.CompletedProcess[str]:
    """Run Python, and send signals, each so many seconds after the one before, once it is ready."""
    process = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=folder)
    assert process.stderr is not None
    seen = b""
    try:
        while b"charts" not in seen:
            piece = os.read(process.stderr.fileno(), 4096)
            assert piece, f"it ended before it was interrupted: {seen.decode()}"
            seen += piece
        for seconds, number in signals:
            time.sleep(seconds)
            process.send_signal(number)
        out, err = process.communicate(timeout=SOON)
    finally:
        process.kill()
    return subprocess.CompletedProcess(process.args, process.returncode, out.decode(), (seen + err).decode())


@pytest.mark.parametrize(
    "script", slow_but([OPTIMIZE, PYTHON_SYSTEM, INDEX], OPTIMIZE), ids=["tracing", "Python system", "index"]
)
def test_ctrl_c_twice_keeps_the_charts_in_a_program(tmp_path: Path, script: str) -> None:
    """The second comes a tenth of a second after the first."""
    done = signalled(["-c", script], tmp_path, *[(0.1, CTRL_C)] * 2)
    assert done.returncode == 0, done.stderr
    status, charts, values = done.stdout.strip().split(";")
    assert status == str(ga.Status.COMPLETE if script is INDEX else ga.Status.INTERRUPTED)
    assert int(charts) == int(values) > 100
    if script is OPTIMIZE:
        assert ga.load_result(tmp_path / "kept.npz").status is ga.Status.INTERRUPTED


@pytest.mark.parametrize(
    ("signals", "code"),
    [([(0.0, CTRL_C), (0.1, CTRL_C)], 130), pytest.param([(0.0, TERMINATE)], 143, marks=pytest.mark.slow)],
    ids=["Ctrl-C twice", "terminated"],
)
def test_the_command_line_keeps_a_checkpoint_and_the_result(
    tmp_path: Path, signals: list[tuple[float, int]], code: int
) -> None:
    words = "optimize schunk_oil_bottle --dimension 3 --radius 0.03 --require none --output out --json"
    program = f"{TRACING}from graspatlas.cli import main\nsys.exit(main({words.split()}))"
    done = signalled(["-c", program], tmp_path, *signals)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert json.loads(done.stdout)["status"] == str(ga.Status.INTERRUPTED)
    charts = ga.load_result(tmp_path / "out").atlas.n_charts
    assert charts > 100
    resumed = subprocess.run(
        [sys.executable, "-m", "graspatlas", *words.split(), "--max-charts", str(charts + 50)],
        cwd=tmp_path, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert f"going on from the {charts} charts" in resumed.stderr
    assert json.loads(resumed.stdout)["n_charts"] == charts + 50


# ------------------------------------------------------------------------------------------- in this process


@pytest.fixture(autouse=True)
def _own_handler() -> Iterator[None]:
    """Python's own handlers before and after, whatever runs the tests, and whatever ran before."""
    before = signal.signal(CTRL_C, signal.default_int_handler)
    terminate = signal.signal(TERMINATE, signal.SIG_DFL)
    yield
    signal.signal(TERMINATE, terminate)
    assert signal.getsignal(CTRL_C) is signal.default_int_handler
    assert interrupts._watch is None
    signal.signal(CTRL_C, before)


def press(number: int = CTRL_C) -> None:
    os.kill(os.getpid(), number)
    time.sleep(0.01)  # Python runs the handler between two of its steps


def test_the_third_press_gives_up(capfd: pytest.CaptureFixture[str]) -> None:
    steps = []
    with pytest.raises(KeyboardInterrupt), stoppable():  # noqa: PT012
        assert not stopping()
        with pytest.raises(KeyboardInterrupt):
            press()
        assert stopping()
        assert stopped_by() == CTRL_C
        press()
        steps.append("the same press")
        assert capfd.readouterr().err == ""
        time.sleep(SAME_PRESS)
        press()
        steps.append("a second press")
        assert "once more" in capfd.readouterr().err
        time.sleep(SAME_PRESS)
        press()
        steps.append("never")
    assert steps == ["the same press", "a second press"]


def test_a_press_is_heard_after_a_block_that_holds_it() -> None:
    steps = []
    with stoppable(), pytest.raises(KeyboardInterrupt):  # noqa: PT012
        with held(), held():
            press()
            steps.append("held")
        steps.append("after")
        hear()
        steps.append("never")
    assert steps == ["held", "after"]
    with pytest.raises(KeyboardInterrupt), stoppable():  # noqa: PT012 (only the end hears it)
        with held():
            press()
        steps.append("later")
    assert steps[-1] == "later"


IMPORTING = """
def cb(_):
    signal.raise_signal(signal.SIGINT)
    for _ in range(3):
        pass
"""


@pytest.mark.filterwarnings("error")
def test_a_press_in_the_middle_of_an_import_is_not_lost() -> None:
    """Python ignores what is raised in the callback with which its import system gives a lock back."""
    names: dict[str, Any] = {"signal": signal}
    exec(compile(IMPORTING, "<frozen importlib._bootstrap>", "exec"), names)

    class Lock:
        pass

    @stoppable()
    def work() -> None:
        lock = Lock()
        there = weakref.ref(lock, names["cb"])
        del lock
        assert there() is None
        for _ in range(5000):
            time.sleep(0.001)

    with pytest.raises(KeyboardInterrupt):
        work()


def test_a_press_while_a_class_is_made() -> None:
    """Python up to 3.11 makes a RuntimeError of what is raised where an attribute of a class learns its name."""

    class Named:
        def __set_name__(self, owner: type, name: str) -> None:
            press()

    @stoppable()
    def work() -> None:
        type("Owner", (), {"named": Named()})
        for _ in range(5000):
            time.sleep(0.001)

    with pytest.raises(KeyboardInterrupt):
        work()


def test_inner_blocks_are_parts_of_the_outer_one() -> None:
    """What was asked to stop stays so, until the outermost block ends."""
    with stoppable():
        with stoppable(), pytest.raises(KeyboardInterrupt):
            press()
        assert stopping()
        atlas = ga.build_atlas(ga.systems.Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1)
        assert atlas.status is ga.Status.INTERRUPTED
    assert not stopping()
    assert ga.build_atlas(ga.systems.Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1).complete


@pytest.mark.parametrize("theirs", [signal.SIG_IGN, lambda number, frame: None], ids=["ignored", "their own"])
def test_handlers_of_others_stay(theirs: Any) -> None:
    for number in (CTRL_C, TERMINATE):
        before = signal.signal(number, theirs)
        with stoppable(also=[TERMINATE]):
            assert signal.getsignal(number) is theirs
        assert signal.getsignal(number) is theirs
        signal.signal(number, before)


def test_no_handler_but_in_programs_that_ask_for_it(sphere: ga.Atlas) -> None:
    """The library leaves SIGTERM alone, and does nothing outside the main thread."""
    seen: list[Any] = []

    def look() -> None:
        with stoppable(also=[TERMINATE]):
            seen.append((signal.getsignal(CTRL_C), signal.getsignal(TERMINATE), stopping()))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert seen == [(signal.default_int_handler, signal.SIG_DFL, False)]
    with stoppable():
        assert signal.getsignal(TERMINATE) is signal.SIG_DFL
        assert signal.getsignal(CTRL_C) is not signal.default_int_handler
    with stoppable(also=[TERMINATE]), pytest.raises(KeyboardInterrupt) as caught:
        press(TERMINATE)
    assert caught.value.signal == TERMINATE  # type: ignore[attr-defined]
    assert signal.getsignal(TERMINATE) is signal.SIG_DFL


def test_a_run_in_another_thread_is_not_stopped_by_the_main_threads_ctrl_c() -> None:
    found: list[ga.Atlas] = []

    def run() -> None:
        found.append(ga.build_atlas(ga.systems.Sphere(3), [0, 0, 1], radius=0.1, epsilon=0.1))

    with stoppable():
        with pytest.raises(KeyboardInterrupt):
            press()
        thread = threading.Thread(target=run)
        thread.start()
        thread.join()
    assert found[0].complete


def later(seconds: float) -> subprocess.Popen[bytes]:
    """A process that presses Ctrl-C here; a thread would wait for the lock that compiled code may hold."""
    return subprocess.Popen(["/bin/sh", "-c", f"sleep {seconds}; kill -INT {os.getpid()}"])


def many(result: ga.Result) -> ga.Grasps:
    """Grasps enough for some seconds."""
    return ga.Grasps(result.problem, np.tile(result.atlas.centers, (100, 1)), result.atlas.system)


def slowed(result: ga.Result) -> ga.Result:
    """The same with an index that takes long."""

    def slow(grasp: ga.Grasp) -> float:
        time.sleep(0.02)
        return float(np.sin(40.0 * grasp.x).sum())

    return replace(result, quality=slow)


LONG: dict[str, Callable[[ga.Result], Any]] = {
    "densify": lambda result: ga.densify(result, 0.0008, progress=False),
    "refine": lambda result: ga.refine(slowed(result), progress=False),
    "refine in F": lambda result: ga.refine(slowed(result), all_motions=True, progress=False),
    "find_grasps": lambda result: ga.find_grasps(result.problem, count=10**6, progress=False),
    "find_components": lambda result: ga.find_components(result.problem, radius=0.1, covered=10**6, progress=False),
    "round cones": lambda result: ga.quality.ferrari_canny_epsilon(many(result), edges=None),
    "contacts": lambda result: [many(result).J for _ in range(100)],
    "force closure": lambda result: ga.quality.force_closure_slack(many(result)),
    "your index": lambda result: result.values(lambda grasp: time.sleep(0.01) or 1.0),  # type: ignore[func-returns-value]
}


@pytest.mark.parametrize("name", LONG)
def test_every_long_work_ends_soon(bottle_result: ga.Result, name: str) -> None:
    """What it keeps is its own business, tested elsewhere: here it is that it ends, and does so soon."""
    process = later(0.5)
    start = time.perf_counter()
    with suppress(KeyboardInterrupt):
        LONG[name](bottle_result)
    seconds = time.perf_counter() - start
    process.kill()
    process.wait()
    assert 0.4 < seconds < 0.5 + 1.0 + SAME_PRESS, "it ended before the signal, or long after"


def test_errors_carry_what_took_long() -> None:
    with pytest.raises(ZeroDivisionError) as caught, keeping(atlas="outer", result="kept"), keeping(atlas="inner"):
        1 / 0  # noqa: B018
    assert (caught.value.atlas, caught.value.result) == ("inner", "kept")  # type: ignore[attr-defined]
    if sys.version_info >= (3, 11):
        assert any("atlas" in note for note in caught.value.__notes__)
