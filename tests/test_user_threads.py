"""Any number of the user's threads may use one problem, atlas or result: answers are those of one, to the bit."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers import PythonSphere, tripod_problem
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas import _core
from graspatlas.analysis.densify import densify
from graspatlas.quality import INDICES, evaluate

THREADS = 4
#: Requirements are left out: their collision checks take most of the time.
CAN = {"dimension": 2, "radius": 0.17, "epsilon": 0.5, "require": ()}


def bits(value: Any) -> Any:
    """A value as something that is equal only to the same bits."""
    if isinstance(value, np.ndarray | np.generic | float):
        return np.asarray(value).tobytes()
    if isinstance(value, dict):
        return {name: bits(part) for name, part in value.items()}
    return [bits(part) for part in value] if isinstance(value, list | tuple) else value


def together(works: list[Callable[[], Any]]) -> list[Any]:
    """Run each work in a thread of its own, all at the same time; what they return."""
    answers: list[Any] = [None] * len(works)
    barrier = threading.Barrier(len(works))

    def run(i: int) -> None:
        barrier.wait()
        try:
            answers[i] = works[i]()
        except BaseException as error:
            answers[i] = error

    threads = [threading.Thread(target=run, args=(i,)) for i in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for answer in answers:
        if isinstance(answer, BaseException):
            raise answer
    return answers


def assert_alone(work: Callable[[], Any], threads: int = THREADS, rounds: int = 1) -> None:
    """Each of several threads gets, every time, what one thread alone gets."""
    alone = bits(work())
    for answers in together([lambda: [bits(work()) for _ in range(rounds)]] * threads):
        assert all(answer == alone for answer in answers)


@pytest.fixture(scope="module")
def result() -> ga.Result:
    return ga.optimize(ga.load_problem("schunk_can"), quality="inverse_condition_number", **CAN)


@pytest.fixture(scope="module")
def grasps(result: ga.Result) -> NDArray[np.float64]:
    return result.atlas.centers[:400]


def batch(result: ga.Result, X: NDArray[np.float64]) -> ga.Grasps:
    """Grasps that have computed nothing yet, on the system that the result's problem shares."""
    return ga.Grasps(result.problem, X)


@pytest.mark.parametrize("index", INDICES)
def test_evaluate(result, grasps, index):
    X = grasps[:100] if index in ("ferrari_canny_volume", "soft_finger_epsilon", "force_closure_margin") else grasps
    assert_alone(lambda: evaluate(index, batch(result, X)), threads=6, rounds=2)


def test_few_grasps_at_a_time(result, grasps):
    """Fewer rows than are shared out: all threads are the user's."""
    assert_alone(
        lambda: np.concatenate([_core.semi_axes(result.atlas.system, X, 1e-3) for X in np.split(grasps, 40)]),
        threads=8,
        rounds=5,
    )


@pytest.mark.parametrize("threads", [1, 2])
def test_build_atlas_on_one_system(result, threads):
    system, x1 = result.atlas.system, result.problem.x1_array
    assert_alone(lambda: ga.build_atlas(system, x1, radius=0.2, epsilon=0.5, threads=threads).to_arrays(), rounds=2)


def test_build_atlas_of_a_system_in_python():
    """The interpreter changes threads between the calls of one projection."""
    system = PythonSphere(3)
    assert_alone(lambda: ga.build_atlas(system, [0.0, 0.0, 1.0], radius=0.2, epsilon=0.1).to_arrays())


def test_densify(result):
    def work() -> list[Any]:
        samples = densify(result, 0.06, share=0.04)
        return [samples.x, samples.charts, samples.qualities, samples.best.x]

    assert_alone(work)


def test_optimize():
    problem = ga.load_problem("planar_hand")
    names = ["inverse_condition_number", "manipulability_volume"]

    def work() -> list[Any]:
        made = ga.optimize(problem, dimension=2, radius=0.2, epsilon=0.5, quality=names, refine=True, max_charts=400)
        return [made.atlas.to_arrays(), made.qualities, dict(made.others), made.refined_best.x, made.best.quality]

    assert_alone(work, threads=3)


def test_climbs(result):
    assert_alone(lambda: [ga.climb(result, chart, max_steps=4).x for chart in (10, 200, 500)])


def test_shortest_path(result):
    def work() -> list[Any]:
        path = ga.shortest_path(result, 3, 40)
        return [path.x, path.arc_length, path.charts]

    assert_alone(work, threads=3)


def test_find_grasps():
    problem = tripod_problem()
    assert_alone(lambda: ga.find_grasps(problem, count=3, seed=1))


def single_points(result: ga.Result, X: NDArray[np.float64]) -> list[Any]:
    """Calls for single points, on the two systems that results share."""
    atlas, full, hand = result.atlas, result.problem.full_system, result.problem.hand
    u = np.array([0.02, -0.01])
    out: list[Any] = []
    for system in (atlas.system, full):
        v = np.linspace(-0.1, 0.1, system.tangent_size)
        for x in X:
            moved = system.integrate(x, v)
            out += [moved, system.difference(x, moved), system.embed(moved), system.slack(moved)]
            out += [system.evaluate_residual(moved), system.evaluate_jacobian(moved)]
        out.append(system.grasp_arrays(X))
    for chart, x in enumerate(X[:20]):
        out += [atlas.point(chart, u), list(atlas.locate(x)), ga.project(full, full.integrate(x, 0.1 * v))]
        out.append(hand.link_placements(x[: hand.model.hand_q_size]))
    return [*out, batch(result, X).poses()]


def test_single_points_beside_batches_and_atlases(result, grasps):
    """Batches and atlases run without the interpreter's lock, and so at the same time as everything else."""
    atlas, full, X = result.atlas, result.problem.full_system, grasps[:60]
    works: list[Callable[[], Any]] = [
        lambda: single_points(result, X),
        lambda: [bits(_core.semi_axes(full, grasps[:200], 1e-3)) for _ in range(40)],
        lambda: [bits(_core.force_closure_margins(atlas.system, grasps[:200], 0.5)) for _ in range(5)],
        lambda: ga.build_atlas(atlas.system, X[0], radius=0.2, epsilon=0.5, threads=1).to_arrays(),
        lambda: single_points(result, X),
    ]
    alone = [bits(work()) for work in works]
    for _ in range(2):
        assert [bits(answer) for answer in together(works)] == alone


def test_what_is_computed_on_first_use():
    """Threads that ask a new problem and a new result first, at the same time, all get the same."""
    stated = ga.load_problem("schunk_can").to_dict()
    made = ga.optimize(ga.Problem.from_dict(stated), max_charts=200, **CAN)

    def ask(problem: ga.Problem, atlas: ga.Atlas) -> list[Any]:
        grasps = ga.Grasps(problem, atlas.centers)
        full = [
            problem.full_dimension,
            problem.x1_array,
            list(problem.hand.joint_limits),
            problem.hand.mechanism.transmission,
        ]
        return [
            *full,
            grasps.semi_axes,
            grasps.J,
            atlas.volumes,
            list(atlas.neighbours),
            atlas.locate(atlas.centers[5]),
        ]

    alone = bits(ask(made.problem, made.atlas))
    for _ in range(5):
        problem = ga.Problem.from_dict(stated)
        atlas = replace(made.atlas, system=problem.system(2))
        assert [bits(a) for a in together([lambda p=problem, a=atlas: ask(p, a)] * THREADS)] == [alone] * THREADS


def test_urdfs_are_read_at_the_same_time():
    """The parser has one place for its messages in the whole process."""

    def refuse(word: str) -> list[str]:
        texts = []
        for _ in range(20):
            with pytest.raises(ga.GraspAtlasError) as caught:
                _core.Model(f"<robot name='r'><link name='a'/><joint name='{word}' type='{word}'/></robot>", "none")
            texts.append(str(caught.value))
        return texts

    words = ["uno", "dos", "tres"]
    for word, texts in zip(words, together([lambda w=w: refuse(w) for w in words]), strict=True):
        assert len(set(texts)) == 1
        assert word in texts[0]
