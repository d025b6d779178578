"""One trial as it went: hand, object, contact forces and push at every step of the simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import quality_name
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result
from graspatlas.simulation.motion import Motion, plan
from graspatlas.simulation.protocols import Protocol, find_protocol
from graspatlas.simulation.scene import Scene
from graspatlas.simulation.trials import GROWTH, LARGEST_FORCE, LOST_SHIFT, LOST_TURN, PIECE, Closed, Trials
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.validation import number_array, positive

__all__ = ["CLOSING", "PUSH", "SQUEEZE", "Recording", "record"]

#: Phases of a trial.
CLOSING, SQUEEZE, PUSH = "closing", "squeeze", "push"
#: A recording ends when the object is so far from where the closed hand held it [m], or so long after it was lost [s].
AWAY, AFTERWARDS = 0.06, 0.5


@dataclass(frozen=True, eq=False)
class Recording:
    """A trial of one grasp with m contacts in f steps of the simulation; everything is in the palm's frame.

    Attributes:
        grasp: The grasp.
        name: What it is called, such as ``refined best``.
        index: Name of the quality index of its result, or nothing.
        protocol: The protocol.
        normal_force: With which the fingers squeeze, in the mean of the contacts [N].
        direction: Unit vector of the push (3,).
        growing: Whether the push grows until the object is lost; else it is that of the protocol.
        times: Time since the hand began to close (f,), seconds.
        phases: What happens then, ``closing``, ``squeeze`` or ``push`` (f,).
        joint_positions: Of all joints, in the order of ``grasp.joints`` (f, h), rad or m.
        T_palm_object: Pose of the object, of the frame of its URDF (f, 4, 4).
        pushes: Force on the object's centre of mass (f, 3), newtons.
        contact_forces: Forces of the links that the contacts name on the object (f, m, 3), newtons; of contacts that
            share a link the first has them all.
        contact_points: Where these act, in the mean (f, m, 3); NaN where a link does not touch.
        lost: From when on the object counts as lost (f,).
    """

    grasp: Grasp
    name: str
    index: str
    protocol: Protocol
    normal_force: float
    direction: Array
    growing: bool
    times: Array
    phases: tuple[str, ...]
    joint_positions: Array
    T_palm_object: Array
    pushes: Array
    contact_forces: Array
    contact_points: Array
    lost: BoolArray

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        outcome = f"lost at {self.breaking_force:.2f} N" if self.lost.any() else "held"
        return f"<Recording of {self.grasp.problem.name!r}, {self.name}: {self.times[-1]:.2f} s, {outcome}>"

    @property
    def breaking_force(self) -> float:
        """Push at which the object was lost [N]: inf where it was not, 0 where it was while the hand closed."""
        return float(np.linalg.norm(self.pushes[self.lost.argmax()])) if self.lost.any() else float("inf")


def record(
    grasp: GraspAtlas | Grasp,
    *,
    chart: int | None = None,
    protocol: str | Protocol = "dexgraspbench",
    direction: ArrayLike | None = None,
    growing: bool = True,
    distance: float = 0.01,
    normal_force: float = 5.0,
    name: str | None = None,
) -> Recording:
    """Record one trial: the hand closes, squeezes, and the object is pushed in one direction.

    ``ga.export_html(recording, "trial.html")`` makes a page of it that plays, ``ga.save_picture`` a strip of pictures.

    Args:
        grasp: A result, of which the refined best is tried, else the best chart; or a grasp.
        chart: The chart of the result that is tried instead.
        protocol: Its name, or one of your own; see :func:`graspatlas.simulate`.
        direction: Of the push, in the palm's frame (3,); by default the one of 26 in which the smallest growing push
            takes the object out of the hand.
        growing: Let the push grow until the object is lost, as for ``breaking_forces`` of a
            :class:`~graspatlas.Simulation`; else push as hard and as long as the protocol does.
        distance: From the object at which the fingertips begin [m].
        normal_force: With which the fingers squeeze, in the mean of the contacts [N].
        name: What the grasp is called in pictures; by default such as ``refined best``, ``worst`` or ``chart 12``.

    Raises:
        GraspAtlasError: If MuJoCo is not installed, hand or object has no collision shapes, or an argument makes no
            sense.
    """
    one, usual, index = _chosen(grasp, chart)
    chosen = find_protocol(protocol)
    positive(distance, "distance")
    positive(normal_force, "normal_force")
    batch = Grasps(one.problem, one.x, charts=[one.chart])
    trials = Trials(Scene(one.problem, chosen))
    along = None if direction is None else _unit(direction, trials.scene.directions)
    motion = plan(trials.scene, batch, distance, normal_force)
    closed = trials.close(motion)
    if along is None:
        many = trials.many_directions
        along = many[trials.shake(motion, closed, many)[0].argmin()]
    states, controls, lost = _run(trials, motion, closed, along, growing)
    positions, T = trials.scene.poses(states[:, 1 : 1 + trials.scene.model.nq])
    forces, points = trials.contacts(states, controls)
    d = trials.scene.directions
    pushes = np.zeros((len(states), 3))
    pushes[:, :d] = controls[:, -d:]
    steps = [motion.closing.shape[1], motion.squeezing.shape[1]]
    phases = [CLOSING] * steps[0] + [SQUEEZE] * steps[1] + [PUSH] * (len(states) - sum(steps))
    return Recording(
        grasp=one,
        name=usual if name is None else str(name),
        index=index,
        protocol=chosen,
        normal_force=normal_force,
        direction=along,
        growing=growing,
        times=np.asarray(chosen.step * (1.0 + np.arange(len(states)))),
        phases=tuple(phases),
        joint_positions=positions,
        T_palm_object=T,
        pushes=pushes,
        contact_forces=forces,
        contact_points=points,
        lost=lost,
    )


def _chosen(grasp: GraspAtlas | Grasp, chart: int | None) -> tuple[Grasp, str, str]:
    """The grasp that is tried, what it is called, and the name of its index."""
    if isinstance(grasp, Grasp):
        if chart is not None:
            raise GraspAtlasError("chart names a grasp of a result; give the result instead of a grasp")
        return grasp, f"chart {grasp.chart}" if grasp.chart >= 0 else "grasp", ""
    check_is_result(grasp)
    index = quality_name(grasp.quality)
    if chart is not None:
        number = grasp.checked_chart(chart)
        ends = {grasp.worst.chart: "worst", grasp.best.chart: "best"} if grasp.accepted.any() else {}
        return grasp.grasp(number), ends.get(number, f"chart {number}"), index
    if grasp.refinement is not None:
        return grasp.refined_best, "refined best", index
    return grasp.best, "best", index


def _unit(direction: ArrayLike, d: int) -> Array:
    """A direction as a unit vector (3,); in the plane without z.

    Raises:
        GraspAtlasError: If it is none.
    """
    vector = number_array(direction, "direction")
    flat = vector.shape == (3,) and not np.any(vector[d:])
    length = float(np.linalg.norm(vector)) if flat else 0.0
    if not 0.0 < length < np.inf:
        raise GraspAtlasError(
            f"direction must be three numbers that are not all 0{', the last 0' if d < 3 else ''}, got {direction!r}"
        )
    return np.asarray(vector / length)


def _run(trials: Trials, motion: Motion, closed: Closed, along: Array, growing: bool) -> tuple[Array, Array, BoolArray]:
    """States (f, s) and controls (f, a + d) from the pregrasp on, and when the object is lost (f,)."""
    controls = trials.controls(np.concatenate([motion.closing, motion.squeezing], axis=1))
    states = trials.run(trials.origins(motion), controls)[0]
    lost = np.zeros(len(states), bool)
    if not closed.held[0]:
        lost[-1] = True
        return states, controls[0], lost
    later = _pushed(trials, motion, closed, along, growing)
    together = [np.concatenate(parts) for parts in zip((states, controls[0], lost), later, strict=True)]
    return together[0], together[1], together[2]


def _pushed(
    trials: Trials, motion: Motion, closed: Closed, along: Array, growing: bool
) -> tuple[Array, Array, BoolArray]:
    """The same of the push alone, as :meth:`Trials.shake` and :meth:`Trials.push` run it."""
    protocol = trials.scene.protocol
    step = protocol.step
    if growing:
        sizes = GROWTH * step * (1.0 + np.arange(int(LARGEST_FORCE / GROWTH / step)))
        piece, origin, limits = PIECE, closed.states, (LOST_SHIFT, LOST_TURN)
    else:
        sizes = np.full(round(protocol.seconds / step), protocol.force)
        piece, origin, limits = len(sizes), trials.origins(motion), (protocol.shift, protocol.turn)
    pushes = sizes[:, None] * along[: trials.scene.directions]
    controls = trials.controls(np.repeat(motion.squeeze, len(sizes), axis=0)[None], pushes[None])
    state, states, afterwards = closed.states, np.empty((0, closed.states.shape[1])), round(AFTERWARDS / step)
    while len(states) < len(sizes):
        trace = trials.run(state, controls[:, len(states) : len(states) + piece])
        state, states = trace[:, -1], np.concatenate([states, trace[0]])
        shifts, turns = (part[0] for part in trials.moved(states[None], origin))
        lost = np.logical_or.accumulate((shifts > limits[0]) | (turns > limits[1]))
        far = lost & (shifts > AWAY)
        far[np.flatnonzero(lost)[afterwards:]] = True
        if far.any():
            end = int(far.argmax()) + 1
            return states[:end], controls[0, :end], lost[:end]
    return states, controls[0], lost
