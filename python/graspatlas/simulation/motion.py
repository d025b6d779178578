"""How the hand is to move in a trial: the targets of its servos from pregrasp to grasp to squeeze."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from graspatlas.execution.pregrasp import Pregrasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.simulation.scene import Scene
from graspatlas.support.arrays import Array, BoolArray

__all__ = ["Motion", "plan"]

#: Friction at which squeezing forces are looked for where contacts do not close at that of the protocol.
MORE_FRICTION = (1.0, 2.0, 4.0)


@dataclass(frozen=True, eq=False)
class Motion:
    """Targets of the servos for n grasps, a column for each of the scene's servos (a).

    Attributes:
        grasps: The grasps.
        start: Positions of all joints before closing (n, h), in the order of ``grasps.joints``.
        closing: Targets at each step on the way to the contacts (n, steps, a) [rad or m].
        squeezing: Targets at each step from there to where the servos press (n, steps, a).
        squeeze: These last targets (n, a).
        closes: Whether friction of the protocol closes each grasp (n,); else the forces are those for more friction.
        distances: How far off the object each pregrasp is (n,), metres.
        reached: Whether that is as far as was asked (n,).
    """

    grasps: Grasps
    start: Array
    closing: Array
    squeezing: Array
    squeeze: Array
    closes: BoolArray
    distances: Array
    reached: BoolArray

    def __len__(self) -> int:
        return len(self.squeeze)

    def some(self, chosen: BoolArray) -> Motion:
        """The motion of the grasps that are chosen (n,)."""
        grasps = Grasps(self.grasps.problem, self.grasps.x[chosen], self.grasps.system, self.grasps.charts[chosen])
        arrays = {f.name: getattr(self, f.name)[chosen] for f in fields(self) if f.name != "grasps"}
        return Motion(grasps, **arrays)


def plan(scene: Scene, grasps: Grasps, distance: float, normal_force: float) -> Motion:
    """The motion that executes grasps.

    Args:
        scene: The scene.
        grasps: The grasps (n).
        distance: From the object at which the fingertips begin [m].
        normal_force: With which the fingers squeeze, in the mean of the contacts [N].
    """
    protocol = scene.protocol
    steps = [round(time / protocol.step) for time in protocol.closing]
    before = grasps.pregrasps(distance, progress=False)
    names = list(grasps.joints)
    start = np.array([[posture.joint_positions[name] for name in names] for posture in before])
    closing = _way_in(before, scene.servos, steps[0])
    at_grasp = closing[:, -1]  # of continuous joints perhaps a turn away from the grasp's own numbers
    torques, closes = _squeezing_torques(scene, grasps, normal_force * len(grasps.contact_frames))
    squeeze = at_grasp + torques / np.array([scene.servo(name)[0] for name in scene.servos])
    shares = np.linspace(0.0, 1.0, steps[1] + 1)[1:, None]
    return Motion(
        grasps=grasps,
        start=start,
        closing=closing,
        squeezing=at_grasp[:, None] + shares * (squeeze - at_grasp)[:, None],
        squeeze=squeeze,
        closes=closes,
        distances=np.array([posture.distances.min() for posture in before]),
        reached=np.array([posture.reached for posture in before]),
    )


def _way_in(before: Sequence[Pregrasp], servos: Sequence[str], steps: int) -> Array:
    """Positions of the servos' joints on the way in (n, steps, a): all contacts come nearer at the same speed."""
    shares = np.linspace(0.0, 1.0, steps + 1)[1:]
    ways = []
    for posture in before:
        hand = posture.problem.hand
        positions = [hand.joint_positions(x[: hand.model.hand_q_size]) for x in posture.path[::-1]]
        table = np.unwrap([[row[name] for name in servos] for row in positions], axis=0)
        left = posture.path_distances[::-1].mean(axis=1)
        done = 1.0 - left / left[0] if left[0] > 0.0 else np.linspace(0.0, 1.0, len(left))
        ways.append(np.column_stack([np.interp(shares, done, column) for column in table.T]))
    return np.array(ways)


def _squeezing_torques(scene: Scene, grasps: Grasps, total: float) -> tuple[Array, BoolArray]:
    """Torques of the servos that squeeze with so much normal force in all (n, a), and which grasps friction closes."""
    friction, torsional = scene.protocol.friction, scene.protocol.torsional
    tries = [(friction, 0.0), (friction, torsional), *((mu, 0.0) for mu in MORE_FRICTION if mu > friction)]
    torques, closes = np.full((len(grasps), len(scene.servos)), np.nan), np.zeros(len(grasps), bool)
    for mu, gamma in tries:
        rows = np.flatnonzero(np.isnan(torques).any(axis=1))
        if len(rows):
            some = Grasps(grasps.problem, grasps.x[rows], grasps.system)
            torques[rows] = some.contact_forces(normal_force=total, friction=mu, torsional=gamma).joint_torques
            closes[rows] = (mu == friction) & ~np.isnan(torques[rows]).any(axis=1)
    # No forces balance at all: every finger presses straight on.
    rows = np.flatnonzero(np.isnan(torques).any(axis=1))
    presses = -grasps.contact_normals[rows] * (total / len(grasps.contact_frames))
    presses = presses.reshape(len(rows), 3 * len(grasps.contact_frames))
    torques[rows] = np.einsum("nfj,nf->nj", grasps.J[rows], presses)
    return torques, closes
