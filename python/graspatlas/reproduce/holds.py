"""The paper's Fig. 1 in numbers: grasps of the can in simulation, pushed until the hand loses it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import batched
from graspatlas.quality.holding_force import holding_force
from graspatlas.reproduce.report import Number, Plate, Section
from graspatlas.reproduce.runs import Setting, run
from graspatlas.requirements.collision_free import CollisionFree
from graspatlas.requirements.screening import screen
from graspatlas.result.result import Result
from graspatlas.simulation.outcome import Simulation
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.recording import record
from graspatlas.simulation.runs import simulate_grasps
from graspatlas.simulation.trials import GROWTH
from graspatlas.support.arrays import Array
from graspatlas.support.mujoco_library import mujoco_library
from graspatlas.viewer.figures.style import Picture
from graspatlas.viewer.films.trial_film import trial_strips
from graspatlas.viewer.render.film_strip import draw_rows

__all__ = ["holds"]

PROTOCOL = "dexgraspbench"
#: With which the fingers squeeze, in the mean of the contacts [N].
SQUEEZE = 5.0
#: Size of the picture [pixels], and how many make an inch.
SIZE, PER_INCH = (1600, 900), 200.0


@dataclass(frozen=True, eq=False)
class _Tried:
    """A grasp that is tried.

    Attributes:
        name: By which index it is the best or the worst of which grasps.
        grasp: The grasp.
        volume: Its manipulability volume, lengths in millimetres.
        holding: Its holding force under the conditions of the trial [N].
    """

    name: str
    grasp: Grasp
    volume: float
    holding: float


@batched
def _holding(grasps: Grasps) -> Array:
    """The force that a grasp is predicted to withstand under the conditions of the trial [N]."""
    budget = SQUEEZE * len(grasps.contact_frames)
    conditions = PROTOCOLS[PROTOCOL]
    return np.asarray(
        holding_force(grasps, friction=conditions.friction, normal_force=budget, torsional=conditions.torsional)
    )


def holds(progress: bool) -> Section:
    """Fig. 1: a grasp from which the can escapes, and one that holds it."""
    setting = Setting("schunk_can", 2, 0.17, 0.5, "manipulability_volume")
    section = Section("holds", "Fig. 1: which grasps hold the can", "")
    try:
        mujoco_library()
    except GraspAtlasError as error:
        section.text = f"Not tried. {error}"
        return section
    tried = _tried(run(setting))
    trials = _trials(tried, progress)
    section.text = _text(tried, trials)
    for i, one in enumerate(tried):
        section.numbers += _numbers(one, trials, i)
    section.plates.append(_plate(tried, trials))
    return section


def _tried(result: Result) -> list[_Tried]:
    """The best by the paper's index, and best and worst by this one and by the holding force without collisions."""
    free = (CollisionFree(),)
    accepted, rejected = screen(free, Grasps(result.problem, result.atlas.centers, result.system))
    by_volume = replace(result, requirements=free, accepted=accepted, rejected=rejected)
    by_force = by_volume.by(_holding)
    chosen = {
        "best by volume, nothing required": result.best,
        "worst by volume, free of collision": by_volume.worst,
        "best by volume, free of collision": by_volume.best,
        "worst by holding force, free of collision": by_force.worst,
        "best by holding force, free of collision": by_force.best,
    }
    volumes, forces = by_volume.qualities, by_force.qualities
    return [
        _Tried(name, grasp, float(volumes[grasp.chart]), float(forces[grasp.chart])) for name, grasp in chosen.items()
    ]


def _trials(tried: list[_Tried], progress: bool) -> Simulation:
    problem = tried[0].grasp.problem
    grasps = Grasps(problem, np.array([one.grasp.x for one in tried]), charts=[one.grasp.chart for one in tried])
    trials = simulate_grasps(grasps, protocol=PROTOCOL, normal_force=SQUEEZE, breaking=True, progress=progress)
    if not trials.complete:
        raise KeyboardInterrupt
    return trials


def _text(tried: list[_Tried], trials: Simulation) -> str:
    protocol = PROTOCOLS[PROTOCOL]
    told = "; ".join(
        f"the {one.name}, {_words(float(force))}" for one, force in zip(tried, trials.breaking_forces, strict=True)
    )
    return (
        "The paper shows a grasp from which the can escapes and one that holds it, and no numbers. Here grasps of the "
        "atlas of Fig. 10a are tried in MuJoCo: the hand closes from 1 cm off the object, the fingers squeeze with "
        f"{SQUEEZE:g} N each in the mean, and a push at the centre of mass grows by {GROWTH:g} N each second until the "
        "can is lost, along 26 directions, of which the worst counts (a can of "
        f"{1e3 * protocol.mass:g} g, friction {protocol.friction:g}, soft fingers: the protocol {PROTOCOL}). Tried "
        f"were {told}. The volume says how well the joints move the can, not how well they hold it; the holding force "
        "is predicted for fingers that adapt their forces to the push, by friction alone. Where it is 0, no forces of "
        "the fingers balance every push; servos that keep their targets may still jam such a can for a while."
    )


def _words(force: float) -> str:
    if force == 0.0:
        return "lost while the hand closes"
    return f"lost at {force:.2f} N" if np.isfinite(force) else "not lost"


def _numbers(one: _Tried, trials: Simulation, i: int) -> list[Number]:
    trial = trials.trial(i)
    rows = (
        ("manipulability volume", one.volume, ""),
        ("holding force, predicted", one.holding, "N"),
        ("smallest push that takes the can, simulated", _value(float(trials.breaking_forces[i])), "N"),
        (f"pushes of {PROTOCOLS[PROTOCOL].force:g} N survived, of {trial['of']}", trial["survived"], ""),
        ("deepest overlap of hand and can at the start", round(trial["penetration_mm"], 3), "mm"),
    )
    return [Number(one.name, quantity, None, value, unit) for quantity, value, unit in rows]


def _value(force: float) -> float | str:
    return force if np.isfinite(force) else "not lost"


def _plate(tried: list[_Tried], trials: Simulation) -> Plate:
    """The worst by the paper's index, and the best by the holding force."""
    shown = (1, len(tried) - 1)
    films = [
        record(
            tried[i].grasp,
            protocol=PROTOCOL,
            direction=trials.breaking_directions[i],
            normal_force=SQUEEZE,
            name=tried[i].name,
        )
        for i in shown
    ]
    figure = Picture(figsize=(SIZE[0] / PER_INCH, SIZE[1] / PER_INCH), dpi=PER_INCH)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(np.asarray(draw_rows(trial_strips(films), *SIZE)))
    axes.set_axis_off()
    first, second = (f"{tried[i].name}, {_words(float(trials.breaking_forces[i]))}" for i in shown)
    return Plate(
        "figure_1_holds.png",
        figure,
        f"The paper's Fig. 1, simulated: above {first}; below {second}. Each is pushed in the direction in which it "
        "holds least; the arrows of the push are to one scale.",
        "Two rows of five pictures: the hand closes round a can, squeezes, and the can is pulled out of it, in the "
        "first row by a short arrow, in the second by a long one.",
    )
