"""Rounds on workers of Dask: the same answer as in one process, also where workers die, and nothing done twice."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import dask.distributed as dask
import numpy as np
import pytest

import graspatlas as ga
from graspatlas.cluster.sealing import opened
from graspatlas.multistart import on_workers
from graspatlas.multistart.on_workers import OnWorkers, sealed
from graspatlas.multistart.rounds import Plan, Round
from graspatlas.multistart.search import Search, one_by_one
from graspatlas.result.refinement import Refinement, SearchEnd
from graspatlas.version import __version__

# Dask's own start and end on a busy machine.
pytestmark = pytest.mark.filterwarnings("ignore")

#: Numbers of the rounds that workers in this process were asked for.
asked: list[int] = []


@pytest.fixture(scope="module")
def problem() -> ga.Problem:
    return ga.load_problem("planar_hand")


@pytest.fixture(scope="module")
def alone(problem: ga.Problem) -> Refinement:
    """What one process finds."""
    found = ga.optimize(problem, motions="all").refinement
    assert found is not None
    return found


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler whose workers are threads of this process: they start at once."""
    kinds = {"threads_per_worker": 2, "processes": False, "dashboard_address": "127.0.0.1:0"}
    with dask.LocalCluster(n_workers=2, silence_logs="ERROR", **kinds) as cluster:
        yield cluster.scheduler_address


def plan_of(problem: ga.Problem, **changes: object) -> Plan:
    plan = Plan(problem, "inverse_condition_number", (), 2, 0.125, 0.4)
    return replace(plan, **changes)  # type: ignore[arg-type]


def assert_same(found: Refinement | None, expected: Refinement) -> None:
    """The same peaks to the bit, from the same climbs."""
    assert found is not None
    assert found.search is not None
    assert expected.search is not None
    assert replace(found.search, seconds=0.0) == replace(expected.search, seconds=0.0)
    for field in fields(Refinement):
        if field.name != "search":
            np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), field.name)


def test_workers_find_what_one_process_finds(problem: ga.Problem, alone: Refinement, address: str) -> None:
    assert_same(ga.optimize(problem, motions="all", scheduler=address).refinement, alone)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2, 4])
def test_any_number_of_processes_finds_the_same(problem: ga.Problem, alone: Refinement, workers: int) -> None:
    assert_same(ga.optimize(problem, motions="all", workers=workers).refinement, alone)


def test_a_plan_comes_out_as_it_was_packed(problem: ga.Problem) -> None:
    requirements = (ga.ForceClosure(1.0 / 3.0, 0.1), ga.CollisionFree(1.0 / 7000.0))
    plan = plan_of(problem, requirements=requirements)
    assert plan.objective.requirements == requirements
    there = opened(__version__, sealed(plan))
    assert there.requirements == requirements
    assert there.threads == 1
    assert there.problem.to_dict() == problem.to_dict()
    assert opened(__version__, sealed(plan)).objective is there.objective, "it is read once"


def test_rounds_of_a_checkpoint_are_not_done_again(
    problem: ga.Problem, address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, starts = plan_of(problem), problem.x1_array[None]
    whole = Search(plan, 0.5, None, False).run(starts, None)
    assert whole is not None

    def two_only(plan: Plan, first: int, deadline: float) -> Iterator[Round]:
        for one in OnWorkers(scheduler=address)(plan, first, deadline):
            yield one
            if one.number == 2:
                return

    cut = Search(plan, 0.5, tmp_path / "rounds", False).run(starts, None, two_only)  # type: ignore[arg-type]
    assert cut is not None
    assert cut.search is not None
    assert cut.search.rounds == 3
    run_round = on_workers.run_round

    def noted(plan: Plan, number: int, max_seconds: float | None) -> Round:
        asked.append(number)
        return run_round(plan, number, max_seconds)

    monkeypatch.setattr(on_workers, "run_round", noted)
    asked.clear()
    went_on = Search(plan, 0.5, tmp_path / "rounds", False).run(starts, None, OnWorkers(scheduler=address))
    assert min(asked) == 3
    assert_same(went_on, whole)


def test_an_index_and_a_requirement_of_ones_own_go_along(problem: ga.Problem, address: str) -> None:
    lowest = 0.01

    @ga.batched
    def width(grasps: ga.Grasps) -> np.ndarray:
        return 1.0 / (1.0 + np.abs(grasps.object_xyz[:, 1] - lowest))

    def to_the_left(grasp: ga.Grasp) -> bool:
        return bool(grasp.object_xyz[0] < 1.0)

    plan = plan_of(problem, quality=width, requirements=(to_the_left,), max_steps=3)
    here = next(one_by_one(plan, 1, float("inf")))
    rounds = OnWorkers(scheduler=address)(plan, 1, float("inf"))
    there = next(rounds)
    rounds.close()
    assert here.met.any()
    np.testing.assert_array_equal(there.x, here.x)
    np.testing.assert_array_equal(there.value, here.value)


def test_a_function_that_cannot_be_sent_is_named(problem: ga.Problem) -> None:
    lock = threading.Lock()

    def careful(grasp: ga.Grasp) -> bool:
        with lock:
            return True

    with pytest.raises(ga.GraspAtlasError, match=r"the requirement careful cannot be sent .*lock.*let it hold plain"):
        sealed(plan_of(problem, requirements=(careful,)))
    with pytest.raises(ga.GraspAtlasError, match="the index careful cannot be sent"):
        ga.optimize(problem, motions="all", quality=careful, workers=1)


def test_an_index_that_fails_says_so_itself(problem: ga.Problem, address: str) -> None:
    def broken(grasp: ga.Grasp) -> float:
        raise KeyError("palm")

    rounds = OnWorkers(scheduler=address)(plan_of(problem, quality=broken), 1, float("inf"))
    with pytest.raises(ga.GraspAtlasError, match=r"quality index 'broken'.*palm"):
        next(rounds)


def test_another_version_on_a_worker_is_refused(problem: ga.Problem) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"this process 0\.0\.1: install the same"):
        opened("0.0.1", sealed(plan_of(problem)))


def test_the_limit_of_time_cuts_it_short(problem: ga.Problem, address: str) -> None:
    start = time.perf_counter()
    result = ga.optimize(problem, motions="all", share_missing=1e-9, max_seconds=1.5, scheduler=address)
    assert time.perf_counter() - start < 10.0
    assert result.refinement is not None
    assert result.refinement.search is not None
    assert result.refinement.search.status is SearchEnd.TIME_LIMIT


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"workers": 2}, "add motions='all'"),
        ({"motions": "all", "workers": 2, "scheduler": "tcp://127.0.0.1:1"}, "not both"),
        ({"motions": "all", "workers": 0}, "workers must be a whole number from 1"),
        ({"motions": "all", "scheduler": ""}, "must be an address"),
        ({"motions": "all", "scheduler": "tcp://127.0.0.1:1"}, "no Dask scheduler answers"),
    ],
)
def test_wrong_input_is_refused(problem: ga.Problem, options: dict, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("graspatlas.cluster.client.ANSWER_SECONDS", 0.5)
    with pytest.raises(ga.GraspAtlasError, match=said):
        ga.optimize(problem, **options)


@pytest.mark.slow
def test_killed_workers_lose_nothing(problem: ga.Problem) -> None:
    plan, starts = plan_of(problem), problem.x1_array[None]
    whole = Search(plan, 0.002, None, False).run(starts, None)
    assert whole is not None
    killed: list[int] = []

    def kills_one_each_time(plan: Plan, first: int, deadline: float) -> Iterator[Round]:
        with (
            dask.LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs="CRITICAL"
            ) as cluster,
            dask.Client(cluster) as client,
        ):
            for one in OnWorkers(scheduler=cluster.scheduler_address)(plan, first, deadline):
                yield one
                # One that was killed before may still be listed, and does not answer.
                alive = client.run(os.getpid, on_error="ignore").values() if len(killed) < 3 else ()
                if alive:
                    killed.append(min(alive))
                    os.kill(killed[-1], signal.SIGKILL)

    found = Search(plan, 0.002, None, False).run(starts, None, kills_one_each_time)  # type: ignore[arg-type]
    assert len(set(killed)) == 3
    assert_same(found, whole)


@pytest.mark.slow
def test_a_round_that_ends_every_worker_is_given_up(problem: ga.Problem) -> None:
    here = os.getpid()

    def deadly(grasp: ga.Grasp) -> float:
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return 1.0

    rounds = OnWorkers(1)(plan_of(problem, quality=deadly), 1, float("inf"))
    with pytest.raises(ga.GraspAtlasError, match=r"round 1 was given up after 4 workers died one after another"):
        next(rounds)


SCRIPT = """
import graspatlas as ga

if __name__ == "__main__":
    result = ga.optimize(
        ga.load_problem("planar_hand"), motions="all", workers=2, share_missing=1e-9, progress=True, checkpoint="kept"
    )
    print(result.refinement.search.status, result.refinement.search.rounds, result.refined_best.quality, sep=";")
"""


@pytest.mark.slow
def test_ctrl_c_in_a_terminal_keeps_what_was_counted(tmp_path: Path) -> None:
    """A terminal sends it to the workers too."""
    (tmp_path / "script.py").write_text(SCRIPT)
    process = subprocess.Popen(
        [sys.executable, "script.py"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 120.0
    while not (tmp_path / "kept" / "rounds" / "round000004.npz").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    status, rounds, best = out.strip().split(";")
    assert status == "interrupted", err
    assert int(rounds) >= 5
    assert float(best) == pytest.approx(0.0941901, rel=1e-4)
    assert "Traceback" not in err


@pytest.mark.slow
def test_a_script_that_would_start_itself_again_is_told_how(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(
        'import graspatlas as ga\nga.optimize(ga.load_problem("planar_hand"), motions="all", workers=1)\n'
    )
    ran = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert ran.returncode == 1
    assert 'below if __name__ == "__main__"' in ran.stderr
