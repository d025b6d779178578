"""What the page can ask for: each action checks what was asked, and says what is to be done."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from graspatlas.analysis.climb import MAX_STEPS, Climb, climb
from graspatlas.analysis.densify import Samples, densify
from graspatlas.atlas.grid import most_samples
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.evaluation import evaluate, find_index
from graspatlas.result.refinement import PeakStatus
from graspatlas.simulation.outcome import Simulation
from graspatlas.simulation.protocols import find_protocol
from graspatlas.simulation.runs import simulate_grasps
from graspatlas.support.arrays import Array
from graspatlas.support.validation import StatedTable
from graspatlas.viewer.live.additions import Added
from graspatlas.viewer.live.jobs import Job, Work
from graspatlas.viewer.live.saving import save
from graspatlas.viewer.live.session import Session
from graspatlas.viewer.scene.captions import rejected_by

__all__ = ["ACTIONS", "begin"]

#: Grasps whose index is computed between two looks at whether to stop.
TOGETHER = 200
#: Charts that are filled between two such looks.
CHARTS_TOGETHER = 3
#: Time that a climb takes between two such looks [s].
CLIMB_SECONDS = 0.5
#: Spacing of the samples where a chart is filled for the first time [radii]; each time after that half of it.
SPACING = 0.25
#: Samples that one press of the button makes, at most.
MOST_SAMPLES = 20_000


def begin(session: Session, asked: StatedTable) -> Job:
    """Begin what the page asks for: ``{"action": "climb", "grasp": 12}``.

    Raises:
        GraspAtlasError: If it makes no sense, or another piece of work runs.
    """
    name = asked.get("action")
    if not isinstance(name, str) or name not in ACTIONS:
        raise GraspAtlasError(f"action must be one of {', '.join(ACTIONS)}, got {name!r}")
    title, work = ACTIONS[name](session, asked)
    return session.jobs.start(title, work)


def _index(session: Session, asked: StatedTable) -> tuple[str, Work]:
    """Another index, at all grasps."""
    name = asked.get("index")
    if not isinstance(name, str):
        raise GraspAtlasError(f"index must be the name of a quality index, got {name!r}")
    find_index(name)
    if name in session.indices:
        raise GraspAtlasError(f"the page has {name} already: choose it under 'colour'")
    return name.replace("_", " "), partial(_do_index, session, name)


def _do_index(session: Session, name: str, job: Job) -> str:
    values: list[Array] = []
    batches = session.charts.batches
    total = sum(map(len, batches))
    for grasps in batches:
        for first in range(0, len(grasps), TOGETHER):
            if job.stopping:
                return "stopped; an index that is not known everywhere is not kept"
            some = grasps.x[first : first + TOGETHER]
            values.append(evaluate(name, Grasps(grasps.problem, some, grasps.system)))
            job.report(sum(map(len, values)), total, "grasps")
    session.add_index(name, np.concatenate(values))
    return f"{name.replace('_', ' ')} at {total} grasps"


def _climb(session: Session, asked: StatedTable) -> tuple[str, Work]:
    """A climb from a grasp."""
    number = session.checked_grasp(asked.get("grasp"))
    result = session.result
    if number < result.atlas.n_charts and not result.accepted[number]:
        why = "; ".join(rejected_by(result.rejections(number)))
        raise GraspAtlasError(f"a climb starts from a grasp that meets the requirements; chart {number}: {why}")
    free = bool(asked.get("all_motions")) or session.grasp(number)[2]
    return f"climb from {_named(session, number)}", partial(_do_climb, session, number, free)


def _do_climb(session: Session, number: int, free: bool, job: Job) -> str:
    result = session.result
    x, chart, _ = session.grasp(number)
    end = climb(result, x, all_motions=free, max_seconds=CLIMB_SECONDS)
    while not (_ended(end) or job.stopping or end.n_steps >= MAX_STEPS):
        job.report(end.n_steps, MAX_STEPS, f"steps, {end.quality:.4g}")
        more = climb(result, end.x, all_motions=free, max_steps=MAX_STEPS - end.n_steps, max_seconds=CLIMB_SECONDS)
        end = replace(more, qualities=np.concatenate([end.qualities, more.qualities[1:]]))
        if not more.n_steps:
            break
    status = _status(end)
    if not end.n_steps:
        return f"{end.quality:.4g}, no step leads higher: {status}"
    system = result.problem.full_system if free else result.system
    title = "End of a climb" + (", all motions free" if free else "")
    grasps = Grasps(result.problem, end.x, system, [chart])
    (new,) = session.add(Added(grasps, np.ones(1, bool), np.array([end.quality]), [title], [status], free, None, end))
    job.show = [number, new]
    return f"{end.qualities[0]:.4g} \u2192 {end.quality:.4g} after {end.n_steps} steps: {status}"


def _ended(end: Climb) -> bool:
    return end.converged or end.stalled or end.unbounded


def _status(end: Climb) -> str:
    """What the end of a climb is, in a word."""
    if end.unbounded:
        return str(PeakStatus.UNBOUNDED)
    if end.converged:
        return str(PeakStatus.MAXIMUM)
    return str(PeakStatus.STALLED if end.stalled else PeakStatus.GIVEN_UP)


def _densify(session: Session, asked: StatedTable) -> tuple[str, Work]:
    """Samples between the centres: in the chart of a grasp and its neighbours."""
    number = session.checked_grasp(asked.get("grasp"))
    atlas, (_, chart, _) = session.result.atlas, session.grasp(number)
    if chart < 0:
        raise GraspAtlasError("this grasp belongs to no chart: choose one of the atlas")
    charts = [chart, *map(int, atlas.neighbours[chart])]
    spacing = session.spacings.get(chart, 2.0 * SPACING * atlas.radius) / 2.0
    most = most_samples(atlas, spacing, charts)
    if most > MOST_SAMPLES:
        raise GraspAtlasError(
            f"a spacing of {spacing:.2g} makes up to {most:,.0f} samples here, more than a page shows well: "
            f"ga.densify(result, {spacing:.2g}, charts=[{chart}]) makes them"
        )
    return f"densify chart {chart} and its neighbours", partial(_do_densify, session, number, charts, spacing)


def _do_densify(session: Session, number: int, charts: list[int], spacing: float, job: Job) -> str:
    session.spacings[charts[0]] = spacing
    result, found = session.result, []
    best, best_number = -np.inf, -1
    job.report(0, len(charts), "charts")
    for first in range(0, len(charts), CHARTS_TOGETHER):
        if job.stopping:
            break
        samples = densify(result, spacing, charts=charts[first : first + CHARTS_TOGETHER], progress=False)
        numbers = session.add(_as_added(session, samples)) if len(samples) else range(0)
        found.append(samples)
        if samples.accepted.any() and samples.best.quality > best:
            at = np.flatnonzero(samples.accepted)
            best, best_number = samples.best.quality, numbers[int(at[samples.qualities[at].argmax()])]
        job.report(min(first + CHARTS_TOGETHER, len(charts)), len(charts), "charts")
    count, met = sum(map(len, found)), sum(int(samples.accepted.sum()) for samples in found)
    text = f"{count} samples, {spacing:.2g} apart, {met} accepted"
    if best_number < 0:
        return text
    job.show = [number, best_number]
    accepted = [chart for chart in charts if result.accepted[chart]]
    if not accepted:
        return f"{text}; the best {best:.4g}, where no chart is accepted"
    return f"{text}; the best {best:.4g}, of the charts' centres {result.qualities[accepted].max():.4g}"


def _as_added(session: Session, samples: Samples) -> Added:
    result, n = session.result, len(samples)
    flat = None
    if result.dimension == 2:
        centers, R = session.layout.unrolled
        flat = centers[samples.charts] + np.einsum("nij,nj->ni", R[samples.charts], samples.u)
    titles = [f"Sample in chart {chart}" for chart in samples.charts]
    grasps = Grasps(result.problem, samples.x, result.system, samples.charts)
    return Added(grasps, samples.accepted, samples.qualities, titles, [""] * n, flat=flat)


def _simulate(session: Session, asked: StatedTable) -> tuple[str, Work]:
    """The trial of a grasp."""
    number = session.checked_grasp(asked.get("grasp"))
    protocol = find_protocol(asked.get("protocol", "dexgraspbench")).name
    return f"try {_named(session, number)} in MuJoCo", partial(_do_simulate, session, number, protocol)


def _do_simulate(session: Session, number: int, protocol: str, job: Job) -> str:
    result = session.result
    x, chart, free = session.grasp(number)
    system = result.problem.full_system if free else result.system
    job.report(0, None, "the hand closes, squeezes, and the object is pushed")
    trial = simulate_grasps(Grasps(result.problem, x, system, [chart]), protocol=protocol, progress=False)
    if job.stopping:
        return "stopped"
    lines = list(_trial_lines(trial))
    session.add_trial(number, trial, lines)
    job.show = [number]
    return lines[0]


def _trial_lines(trials: Simulation) -> Iterator[str]:
    """What a trial has shown, in words."""
    trial = trials.trial(0)
    if trial["unstable"]:
        yield "MuJoCo gave it up, because its numbers grew without bound"
        return
    if trial["lost_while"] == "closing":
        yield "the object is lost while the hand closes"
    else:
        yield f"the object stays under {trial['survived']} of {trial['of']} pushes"
    yield f"Protocol {trials.protocol}, friction {trials.friction:g}."
    if trial["shift_mm"] is not None and trial["turn_deg"] is not None:
        yield f"It moves {trial['shift_mm']:.1f} mm and turns {trial['turn_deg']:.1f}\u00b0 at most."
    if trial["breaking_force_n"] is not None and trial["lost_while"] != "closing":
        yield f"A growing push takes the object at {trial['breaking_force_n']:.2f} N, from the worst direction."
    if trial["penetration_mm"] >= 0.05:
        yield f"Before closing, hand and object overlap by {trial['penetration_mm']:.1f} mm."
    if not trial["pregrasp_reached"]:
        yield f"The fingertips begin only {trial['pregrasp_mm']:.1f} mm off the object."


def _save(session: Session, asked: StatedTable) -> tuple[str, Work]:
    """Files of what has been found, and the result's own only where that is asked for."""
    whole = bool(asked.get("result"))
    if session.file is None:
        raise GraspAtlasError("this result has no file yet: open it by graspatlas view OUT")
    return "save", lambda job: save(session, whole)


def _named(session: Session, number: int) -> str:
    n = session.result.atlas.n_charts
    return f"chart {number}" if number < n else f"grasp {number}"


#: What the page can ask for, by name: what checks it, and says what it is called and what is to be done.
ACTIONS: dict[str, Callable[[Session, StatedTable], tuple[str, Work]]] = {
    "index": _index,
    "climb": _climb,
    "densify": _densify,
    "simulate": _simulate,
    "save": _save,
}
