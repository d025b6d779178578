"""Trials of grasps: the hand closes, the object is pushed; by MuJoCo's rollout, on all cores."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from graspatlas.simulation.motion import Motion
from graspatlas.simulation.scene import HAND, OBJECT, Scene
from graspatlas.support.arrays import Array, BoolArray
from graspatlas.support.machine import available_threads
from graspatlas.support.mujoco_library import mujoco_library

if TYPE_CHECKING:
    import mujoco

__all__ = ["Closed", "Pushed", "Start", "Trials"]

#: By how much a growing push grows, and where it ends [N/s, N].
GROWTH, LARGEST_FORCE = 2.0, 40.0
#: What counts as lost under it: shift and turn from the closed hand [m, rad].
LOST_SHIFT, LOST_TURN = 0.02, np.radians(15.0)
#: It is simulated in pieces of so many steps.
PIECE = 250
#: Contacts are looked for up to this distance [m].
FAR = 0.05


@dataclass(frozen=True, eq=False)
class Start:
    """How n grasps of m contacts touch before anything moves.

    Attributes:
        contact_distances: Distance of each contact's shapes (n, m), metres; negative where they overlap.
        depths: Deepest overlap of hand and object (n,), metres.
    """

    contact_distances: Array
    depths: Array


@dataclass(frozen=True, eq=False)
class Closed:
    """The closed hand.

    Attributes:
        states: Of the simulation (n, s).
        shifts: How far the object's centre of mass has moved (n,), metres.
        turns: How far the object has turned (n,), radians.
        held: Whether it is still held (n,).
    """

    states: Array
    shifts: Array
    turns: Array
    held: BoolArray

    def some(self, chosen: BoolArray) -> Closed:
        """The hands that are chosen (n,)."""
        return Closed(self.states[chosen], self.shifts[chosen], self.turns[chosen], self.held[chosen])


@dataclass(frozen=True, eq=False)
class Pushed:
    """The object under pushes.

    Attributes:
        survived: Whether it stayed, for each grasp and push (n, p).
        shifts: How far it went at most (n, p), metres.
        turns: How far it turned at most (n, p), radians.
    """

    survived: BoolArray
    shifts: Array
    turns: Array


class Trials:
    """Runs trials in a scene.

    Args:
        scene: The scene.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._library = mujoco_library()
        self._model: mujoco.MjModel = scene.model
        self._spec = self._library.mjtState.mjSTATE_FULLPHYSICS
        self._data = [self._library.MjData(self._model) for _ in range(available_threads())]

    @cached_property
    def axes(self) -> Array:
        """Unit vectors along which a protocol pushes (p, 3): both ways along each axis of the palm."""
        d = self.scene.directions
        return np.vstack([sign * np.eye(3)[axis] for axis in range(d) for sign in (1.0, -1.0)])

    @cached_property
    def many_directions(self) -> Array:
        """Unit vectors to the neighbours in a cubic grid (26, 3), or (8, 3) in the plane."""
        d = self.scene.directions
        steps = [(*v, *(0,) * (3 - d)) for v in product((1, 0, -1), repeat=d) if any(v)]
        return np.asarray(steps / np.linalg.norm(steps, axis=1, keepdims=True))

    def start(self, motion: Motion) -> Start:
        """How the grasps touch, seen by MuJoCo."""
        library, model, data = self._library, self._model, self._data[0]
        geoms = {
            name: [i for i in range(model.ngeom) if model.geom(i).name.startswith(name)] for name in (HAND, OBJECT)
        }
        touching = self.scene.touching_shapes
        fingers = [[model.geom(HAND + name).id for name in names] for names in touching]
        grasps = motion.grasps
        distances, depths = np.full((len(grasps), len(fingers)), FAR), np.zeros(len(grasps))
        positions = np.column_stack(list(grasps.joint_positions.values()))
        points = np.zeros(6)
        for n, qpos in enumerate(self.scene.configurations(positions, grasps.T_palm_object)):
            data.qpos[:] = qpos
            library.mj_kinematics(model, data)
            for m, finger in enumerate(fingers):
                distances[n, m] = min(
                    library.mj_geomDistance(model, data, a, b, FAR, points) for a in finger for b in geoms[OBJECT]
                )
            library.mj_comPos(model, data)
            library.mj_collision(model, data)
            own = set(geoms[OBJECT])
            deep = [-c.dist for c in data.contact[: data.ncon] if (c.geom1 in own) != (c.geom2 in own)]
            depths[n] = max([0.0, *deep])
        return Start(distances, depths)

    def close(self, motion: Motion) -> Closed:
        """Close the hand: pregrasp, grasp, squeeze, in straight lines."""
        protocol = self.scene.protocol
        states = self.origins(motion)
        targets = np.concatenate([motion.closing, motion.squeezing], axis=1)
        ends = self.run(states, self.controls(targets))[:, -1]
        shifts, turns = self.moved(ends[:, None], states)
        held = (shifts[:, 0] < protocol.shift) & (turns[:, 0] < protocol.turn)
        return Closed(ends, shifts[:, 0], turns[:, 0], held)

    def push(self, motion: Motion, closed: Closed) -> Pushed:
        """Push the object as the protocol says."""
        protocol, axes = self.scene.protocol, self.axes
        steps, n, p = round(protocol.seconds / protocol.step), len(motion), len(axes)
        origin = self.origins(motion)
        loads = protocol.force * axes[:, : self.scene.directions]
        if protocol.in_a_row:
            targets = np.repeat(motion.squeeze[:, None, :], p * steps, axis=1)
            trace = self.run(closed.states, self.controls(targets, np.repeat(loads, steps, axis=0)[None]))
            shifts, turns = (part.reshape(n, p, steps).max(axis=2) for part in self.moved(trace, origin))
            survived = np.logical_and.accumulate((shifts < protocol.shift) & (turns < protocol.turn), axis=1)
        else:
            targets = np.repeat(motion.squeeze, p, axis=0)[:, None, :].repeat(steps, axis=1)
            pushes = np.tile(loads, (n, 1))[:, None, :]
            trace = self.run(np.repeat(closed.states, p, axis=0), self.controls(targets, pushes))
            moved = self.moved(trace, np.repeat(origin, p, axis=0))
            shifts, turns = (part.max(axis=1).reshape(n, p) for part in moved)
            survived = (shifts < protocol.shift) & (turns < protocol.turn)
        return Pushed(survived & closed.held[:, None], shifts, turns)

    def shake(self, motion: Motion, closed: Closed, directions: Array) -> Array:
        """Forces at which the object is lost when a push grows along each direction (n, d) [N].

        They are inf where it is not lost, and NaN where the simulation became unstable.

        Lost is what has moved further than ``LOST_SHIFT`` from where it was in the closed hand, or turned further than
        ``LOST_TURN``; 0 where the object was lost while the hand closed.

        Args:
            motion: The motion of the grasps (n).
            closed: The closed hands.
            directions: Unit vectors (d, 3).
        """
        step, d = self.scene.protocol.step, len(directions)
        forces = np.where(np.repeat(closed.held, d), np.inf, 0.0)
        states, squeeze = np.repeat(closed.states, d, axis=0), np.repeat(motion.squeeze, d, axis=0)
        origin, along = states.copy(), np.tile(directions[:, : self.scene.directions], (len(motion), 1))
        for first in range(0, int(LARGEST_FORCE / GROWTH / step), PIECE):
            left = np.flatnonzero(np.isinf(forces))
            if not len(left):
                break
            sizes = GROWTH * step * (first + 1 + np.arange(PIECE))
            targets = squeeze[left][:, None, :].repeat(PIECE, axis=1)
            pushes = along[left][:, None, :] * sizes[None, :, None]
            trace = self.run(states[left], self.controls(targets, pushes))
            shifts, turns = self.moved(trace, origin[left])
            lost = (shifts > LOST_SHIFT) | (turns > LOST_TURN)
            gone = lost.any(axis=1)
            forces[left[gone]] = sizes[lost[gone].argmax(axis=1)]
            forces[left[np.isnan(shifts[:, -1])]] = np.nan
            states[left] = trace[:, -1]
        return forces.reshape(len(motion), d)

    def contacts(self, states: Array, controls: Array) -> tuple[Array, Array]:
        """Forces on the object in states (n, s) under controls (n, a + d), by the links that the contacts name.

        Returns:
            Forces in the palm's frame (n, m, 3), newtons, and where they act in the mean (n, m, 3), NaN for none. Of
            contacts that share a shape the first has it.
        """
        library, model, data = self._library, self._model, self._data[0]
        touching = self.scene.touching_shapes
        contact_of = {model.geom(HAND + name).id: m for m in reversed(range(len(touching))) for name in touching[m]}
        body = model.body("object").id
        forces, places = np.zeros((2, len(states), len(touching), 3))
        weights, local = np.zeros((len(states), len(touching), 1)), np.zeros(6)
        for n, (state, control) in enumerate(zip(states, controls, strict=True)):
            library.mj_setState(model, data, state, self._spec)
            data.ctrl[:] = control
            library.mj_forward(model, data)
            for i, contact in enumerate(data.contact[: data.ncon]):
                first = model.geom_bodyid[contact.geom1] == body
                m = contact_of.get(int(contact.geom2 if first else contact.geom1))
                if m is None or not (first or model.geom_bodyid[contact.geom2] == body):
                    continue
                library.mj_contactForce(model, data, i, local)
                force = (-1.0 if first else 1.0) * local[:3] @ contact.frame.reshape(3, 3)
                forces[n, m] += force
                weights[n, m] += local[0]
                places[n, m] += local[0] * contact.pos
        return forces, np.divide(places, weights, out=np.full_like(places, np.nan), where=weights > 0.0)

    def origins(self, motion: Motion) -> Array:
        """States in which the object is where it was before closing."""
        states = np.zeros((len(motion), self._library.mj_stateSize(self._model, self._spec)))
        states[:, 1 : 1 + self._model.nq] = self.scene.configurations(motion.start, motion.grasps.T_palm_object)
        return states

    def controls(self, targets: Array, pushes: Array | None = None) -> Array:
        """Controls (n, steps, a + d) of targets (n, steps, a) and pushes that broadcast to (n, steps, d)."""
        d = self.scene.directions
        controls = np.zeros((*targets.shape[:2], targets.shape[2] + d))
        controls[..., :-d] = targets
        if pushes is not None:
            controls[..., -d:] = pushes
        return controls

    def run(self, states: Array, controls: Array) -> Array:
        """States (n, steps, s) that follow states (n, s) under controls; NaN where a simulation became unstable.

        MuJoCo ends such a one before its time.
        """
        trace, _ = self._library.rollout.rollout(self._model, self._data, states, controls)
        trace = np.asarray(trace)
        ends = states[:, 0] + controls.shape[1] * self.scene.protocol.step
        unstable = ~(np.abs(trace[:, -1, 0] - ends) < 0.5 * self.scene.protocol.step)
        trace[unstable] = np.nan
        return trace

    def moved(self, trace: Array, origin: Array) -> tuple[Array, Array]:
        """How far the object has moved [m] and turned [rad] in states (n, steps, s) from those in states (n, s)."""
        at = 1 + self.scene.object_at
        d = self.scene.directions
        shifts = np.linalg.norm(trace[..., at : at + d] - origin[:, None, at : at + d], axis=-1)
        if self.scene.problem.object_joint_model.planar:
            return shifts, np.abs(trace[..., at + 2] - origin[:, None, at + 2])
        dots = np.abs(np.einsum("nsq,nq->ns", trace[..., at + 3 : at + 7], origin[:, at + 3 : at + 7]))
        return shifts, 2.0 * np.arccos(np.clip(dots, 0.0, 1.0))
