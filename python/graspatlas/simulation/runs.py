"""Trials of the grasps of a result: the best, chosen charts, a random sample or all."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.requirements.force_closure import stated_friction
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.simulation.motion import plan
from graspatlas.simulation.outcome import Simulation
from graspatlas.simulation.protocols import Protocol, find_protocol
from graspatlas.simulation.scene import Scene
from graspatlas.simulation.trials import Trials
from graspatlas.support.arrays import AnyArray, BoolArray, IntArray
from graspatlas.support.interrupts import stoppable
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import positive, whole

__all__ = ["simulate", "simulate_grasps"]

#: Grasps whose trials run together; between two of these Ctrl-C is heard.
TOGETHER = 16


def simulate(
    result: GraspAtlas,
    *,
    protocol: str | Protocol = "dexgraspbench",
    stated_contacts: bool = False,
    charts: Sequence[int] | None = None,
    sample: int | None = None,
    everything: bool = False,
    distance: float = 0.01,
    normal_force: float = 5.0,
    breaking: bool = False,
    seed: int = 0,
    progress: bool | None = None,
) -> Simulation:
    """Try grasps in MuJoCo: the hand closes from the pregrasp, squeezes, and the object is pushed.

    The best grasp comes first: the refined best where there is one, else the best chart. By default nothing else is
    tried. Ctrl-C keeps what was tried until then.

    Args:
        result: The result.
        protocol: Its name, one of ``graspatlas.simulation.PROTOCOLS``, or one of your own.
        stated_contacts: Take the friction, and the torsional friction of soft fingers, that the result's requirement
            force_closure states, in place of the protocol's.
        charts: Only these charts, in this order, and not the best.
        sample: Also so many charts that meet the requirements, chosen at random; all of them where there are fewer.
        everything: Also all charts that meet the requirements, the best chart once.
        distance: From the object at which the fingertips begin [m].
        normal_force: With which the fingers squeeze, in the mean of the contacts [N].
        breaking: Also find the smallest growing push under which each object is lost; of the first grasp it is always
            found, and by the protocol ``shake`` of all.
        seed: Of the random sample; not negative.
        progress: Show progress; by default on a terminal.

    Returns:
        What the trials have shown.

    Raises:
        GraspAtlasError: If MuJoCo is not installed, hand or object has no collision shapes, an argument makes no sense,
            or no grasp meets the requirements.
    """
    check_is_result(result)
    chosen = find_protocol(protocol)
    if stated_contacts:
        chosen = _with_stated_contacts(chosen, result)
    if (charts is not None) + (sample is not None) + everything > 1:
        raise GraspAtlasError("give only one of charts, sample and everything")
    refined, numbers = _chosen(result, charts, sample, everything, seed)
    X = result.atlas.centers[numbers]
    if refined.any():
        X = np.vstack([result.refined_best.x, X[1:]])
    grasps = Grasps(result.problem, X, charts=numbers)
    return simulate_grasps(
        grasps,
        protocol=chosen,
        distance=distance,
        normal_force=normal_force,
        breaking=breaking,
        refined=refined,
        seed=seed,
        progress=progress,
    )


def _with_stated_contacts(protocol: Protocol, result: GraspAtlas) -> Protocol:
    """The protocol with the friction of a result's requirement force_closure."""
    stated = stated_friction(result.requirements)
    if stated is None:
        raise GraspAtlasError("this result requires no force_closure, which would state the friction: leave it out")
    return replace(protocol, friction=stated[0], torsional=stated[1])


def _chosen(
    result: GraspAtlas, charts: Sequence[int] | None, sample: int | None, everything: bool, seed: int
) -> tuple[BoolArray, IntArray]:
    """Which of the grasps are refined (n,), and their charts (n,)."""
    if charts is not None:
        numbers = np.array([result.checked_chart(chart) for chart in charts], np.int64)
        if not len(numbers):
            raise GraspAtlasError("charts names none; give some, or leave it out for the best")
        return np.zeros(len(numbers), bool), numbers
    candidates = np.asarray(result.accepted_charts(), np.int64)
    is_refined = result.refinement is not None
    first = result.refined_best.chart if is_refined else result.best.chart
    left = candidates if is_refined else candidates[candidates != first]
    others = left if everything else left[:0]
    if sample is not None:
        count = min(whole(sample, "sample"), len(left))
        others = np.sort(np.random.default_rng(whole(seed, "seed", 0)).choice(left, count, replace=False))
    refined = np.zeros(1 + len(others), bool)
    refined[0] = is_refined
    return refined, np.append(np.int64(first), others)


def simulate_grasps(
    grasps: Grasps,
    *,
    protocol: str | Protocol = "dexgraspbench",
    distance: float = 0.01,
    normal_force: float = 5.0,
    breaking: bool = False,
    refined: BoolArray | None = None,
    seed: int = 0,
    progress: bool | None = None,
) -> Simulation:
    """Try a batch of grasps, at least one, as :func:`simulate` does those of a result."""
    chosen = find_protocol(protocol)
    if not len(grasps):
        raise GraspAtlasError("there is no grasp to try")
    positive(distance, "distance")
    positive(normal_force, "normal_force")
    began = time.perf_counter()
    trials = Trials(Scene(grasps.problem, chosen))
    parts: list[dict[str, AnyArray]] = []
    with stoppable():
        try:
            with progress_bar(f"trials of {grasps.problem.name}", "grasps", len(grasps), progress) as bar:
                for rows in _batches(len(grasps)):
                    some = Grasps(grasps.problem, grasps.x[rows], grasps.system, grasps.charts[rows])
                    shaken = np.ones(len(rows), bool) if breaking or chosen.breaks else rows == 0
                    parts.append(_tried(trials, some, distance, normal_force, shaken))
                    bar.update(len(rows))
        except KeyboardInterrupt:
            if not parts:
                raise
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    done = len(columns["depths"])
    return Simulation(
        problem=grasps.problem.name,
        protocol=chosen.name,
        friction=chosen.friction,
        torsional=chosen.torsional,
        distance=distance,
        normal_force=normal_force,
        seed=seed,
        contacts=grasps.contact_frames,
        pushes=trials.axes,
        charts=np.asarray(grasps.charts[:done], np.int64),
        refined=np.zeros(done, bool) if refined is None else refined[:done],
        **columns,
        seconds=time.perf_counter() - began,
        complete=done == len(grasps),
    )


def _batches(n: int) -> Iterator[IntArray]:
    for first in range(0, n, TOGETHER):
        yield np.arange(first, min(first + TOGETHER, n))


def _tried(
    trials: Trials, grasps: Grasps, distance: float, normal_force: float, shaken: BoolArray
) -> dict[str, AnyArray]:
    """Columns of the outcome of some grasps."""
    protocol = trials.scene.protocol
    motion = plan(trials.scene, grasps, distance, normal_force)
    start, closed = trials.start(motion), trials.close(motion)
    forces, directions = np.full(len(grasps), np.nan), np.full((len(grasps), 3), np.nan)
    if shaken.any():
        along = trials.many_directions
        found = trials.shake(motion.some(shaken), closed.some(shaken), along)
        forces[shaken], directions[shaken] = found.min(axis=1), along[found.argmin(axis=1)]
    pushed = trials.push(motion, closed)
    bad = start.depths >= protocol.start_depth
    unstable = np.isnan(closed.shifts) | np.isnan(pushed.shifts).any(axis=1) | (shaken & np.isnan(forces))
    return {
        "unstable": unstable,
        "survived": pushed.survived & ~bad[:, None],
        "shifts": pushed.shifts,
        "turns": pushed.turns,
        "closing_shifts": closed.shifts,
        "lost_closing": ~closed.held,
        "contact_distances": start.contact_distances,
        "depths": start.depths,
        "pregrasp_distances": motion.distances,
        "reached": motion.reached,
        "closes": motion.closes,
        "breaking_forces": forces,
        "breaking_directions": directions,
    }
