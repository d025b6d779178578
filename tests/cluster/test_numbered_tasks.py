"""Numbered tasks: results in the order of their numbers, whatever workers do and however many there are."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from itertools import count, islice

import dask.distributed as dask
import pytest

from graspatlas.cluster.numbered_tasks import AHEAD, LEAST_AHEAD, NumberedTasks
from graspatlas.errors import GraspAtlasError

# Dask's own start and end on a busy machine.
pytestmark = pytest.mark.filterwarnings("ignore")

NEVER = float("inf")
THREADS = 3

#: What tasks write to: the workers are threads of this process.
begun: list[int] = []
ended: list[int] = []
running: set[int] = set()
at_once: list[int] = []


@pytest.fixture(scope="module")
def cluster() -> Iterator[dask.Client]:
    """A client of one worker with some threads in this process."""
    with (
        dask.LocalCluster(
            n_workers=1, threads_per_worker=THREADS, processes=False, dashboard_address="127.0.0.1:0"
        ) as local,
        dask.Client(local) as client,
    ):
        yield client


@pytest.fixture
def client(cluster: dask.Client) -> dask.Client:
    for notes in (begun, ended, running, at_once):
        notes.clear()
    return cluster


def tasks(client: dask.Client, function: Callable[[int], object]) -> NumberedTasks[object]:
    return NumberedTasks(client, lambda number, seconds: function(number), "sum")


def later_ones_end_first(number: int) -> int:
    time.sleep(0.05 * (number % THREADS == 0))
    ended.append(number)
    return 10 * number


def noted(number: int) -> int:
    begun.append(number)
    running.add(number)
    at_once.append(len(running))
    time.sleep(0.03)
    running.remove(number)
    return number


def third_one_waits(number: int) -> int:
    if number >= 2:
        time.sleep(1.0)
    return number


def third_one_fails(number: int) -> float:
    return 1.0 / (2 - number)


def refuses(number: int) -> None:
    raise GraspAtlasError("no such index")


def test_results_come_in_the_order_of_their_numbers(client: dask.Client) -> None:
    found = list(tasks(client, later_ones_end_first).results(range(12), NEVER))
    assert found == [10 * number for number in range(12)]
    assert ended != sorted(ended)


def test_some_are_submitted_ahead_and_dropped_when_no_more_are_wanted(client: dask.Client) -> None:
    results = tasks(client, noted).results(count(), NEVER)
    assert list(islice(results, 4)) == [0, 1, 2, 3]
    results.close()
    time.sleep(0.3)
    assert 4 < len(begun) <= 4 + (AHEAD + 1) * THREADS
    assert max(at_once) == THREADS


def test_a_deadline_ends_it(client: dask.Client) -> None:
    start = time.perf_counter()
    assert list(tasks(client, third_one_waits).results(count(), start + 0.5)) == [0, 1]
    assert 0.5 <= time.perf_counter() - start < 0.9


def test_tasks_are_told_what_time_is_left(client: dask.Client) -> None:
    told: NumberedTasks[float | None] = NumberedTasks(client, lambda number, seconds: seconds, "sum")
    (seconds,) = told.results([1], time.perf_counter() + 60.0)
    assert seconds is not None
    assert 50.0 < seconds < 60.0
    assert list(told.results([1], NEVER)) == [None]


def test_a_task_that_fails_is_named(client: dask.Client) -> None:
    results = tasks(client, third_one_fails).results(count(), NEVER)
    assert list(islice(results, 2)) == [0.5, 1.0]
    with pytest.raises(GraspAtlasError, match=r"sum 2 failed on a worker \(ZeroDivisionError"):
        next(results)


def test_an_error_of_the_package_is_passed_on_as_it_is(client: dask.Client) -> None:
    with pytest.raises(GraspAtlasError, match=r"^no such index$"):
        next(tasks(client, refuses).results(count(), NEVER))


def test_workers_may_come_late_and_more_of_them_get_more(client: dask.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("graspatlas.cluster.numbered_tasks.ASK_SECONDS", 0.1)
    with (
        dask.LocalCluster(n_workers=0, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0") as local,
        dask.Client(local) as other,
    ):
        threading.Timer(0.3, lambda: local.scale(1)).start()
        results = tasks(other, noted).results(count(), NEVER)
        assert list(islice(results, 5)) == [0, 1, 2, 3, 4]
        assert max(at_once) == 1
        local.scale(4)
        other.wait_for_workers(4)
        assert list(islice(results, 40)) == list(range(5, 45))
        assert max(at_once) > LEAST_AHEAD
        results.close()


def test_a_scheduler_that_goes_away_is_an_error(client: dask.Client) -> None:
    local = dask.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0")
    with dask.Client(local.scheduler_address, timeout=1.0) as other:
        results = tasks(other, noted).results(count(), NEVER)
        next(results)
        threading.Timer(0.3, local.close).start()
        with pytest.raises(GraspAtlasError, match="the Dask scheduler went away"):
            list(results)
