"""The way in: a timed trajectory of the joints from the pregrasp to the grasp, and on to a squeeze."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.execution.actuation import Actuation
from graspatlas.execution.pregrasp import Pregrasp
from graspatlas.execution.withdrawal import Withdrawal
from graspatlas.hand.urdf import velocity_limits
from graspatlas.support.arrays import Array
from graspatlas.support.validation import number, number_array, positive, read_only

__all__ = ["Approach", "approach"]

#: Postures along the way at which the speeds of the joints are looked at.
FINE = 1001
#: A trajectory has at most so many points.
MOST_POINTS = 1_000_000
#: By how much a joint may be faster between two of them.
UNSEEN = 1.001


@dataclass(frozen=True, eq=False)
class Approach:
    """A timed trajectory of the joints: the way in, then the squeeze where one is asked for; h joints, m contacts.

    It starts and stops smoothly, by the polynomial of minimum jerk: velocities and accelerations are zero at both ends
    of either part. On the way in all contact points are equally far off the object at each time, so they arrive
    together.

    Attributes:
        joints: Names of the joints (h,).
        times: When each point is passed [n], seconds, from 0 and growing.
        positions: Position of each joint [n, h], radians and metres; of continuous joints without jumps.
        distances: How far the contact points are off the object along its normal, at each point of the way in
            [arrival + 1, m], metres.
        arrival: The number of the point that is the grasp.
        seconds: Time from the first point to the grasp [s]: more than was asked for when that breaks velocity limits.
        squeeze_seconds: Time from the grasp to the last point [s], likewise; 0 without a squeeze.
        slowed_by: Names of the joints whose velocity limits in the URDF made it longer.
        pregrasp: Where it begins; if it was not reached as far off as asked, this says why.
    """

    joints: tuple[str, ...]
    times: Array
    positions: Array
    distances: Array
    arrival: int
    seconds: float
    squeeze_seconds: float
    slowed_by: tuple[str, ...]
    pregrasp: Pregrasp

    def __repr__(self) -> str:
        slowed = f", slowed by {', '.join(self.slowed_by)}" if self.slowed_by else ""
        return (
            f"<Approach of {self.pregrasp.problem.name!r}: {len(self.times)} points in {self.times[-1]:.3g} s{slowed}>"
        )

    @property
    def spread(self) -> float:
        """By how much distances of contact points differ at most at one time [m]: 0 if all arrive together."""
        return float(np.ptp(self.distances, axis=1).max())


def approach(
    pregrasp: Pregrasp,
    seconds: float,
    *,
    time_step: float,
    squeeze: Mapping[str, float] | Sequence[float] | Array | None = None,
    squeeze_seconds: float = 0.4,
) -> Approach:
    """The way from a pregrasp to its grasp; see :meth:`graspatlas.Grasp.approach` for the arguments.

    Raises:
        GraspAtlasError: If a time is not positive, points are too many, or the squeeze names no joint of the hand.
    """
    for value, name in ((seconds, "seconds"), (time_step, "time_step"), (squeeze_seconds, "squeeze_seconds")):
        positive(value, name)
    hand = pregrasp.problem.hand
    way_in = _way_in(pregrasp)
    parts = [_timed(hand.joints, hand.urdf, way_in, seconds, time_step)]
    if squeeze is not None:
        target = _squeeze_positions(pregrasp, squeeze, way_in[-1])
        line = way_in[-1] + np.linspace(0.0, 1.0, FINE)[:, None] * (target - way_in[-1])
        parts.append(_timed(hand.joints, hand.urdf, line, squeeze_seconds, time_step))
    arrival = len(parts[0].times) - 1
    return Approach(
        joints=hand.joints,
        times=read_only(np.concatenate([parts[0].times, *(parts[0].times[-1] + part.times[1:] for part in parts[1:])])),
        positions=read_only(np.vstack([parts[0].positions, *(part.positions[1:] for part in parts[1:])])),
        distances=read_only(_distances(pregrasp, parts[0].positions)),
        arrival=arrival,
        seconds=float(parts[0].times[-1]),
        squeeze_seconds=float(sum(part.times[-1] for part in parts[1:])),
        slowed_by=tuple(dict.fromkeys(name for part in parts for name in part.slowed_by)),
        pregrasp=pregrasp,
    )


@dataclass(frozen=True)
class _Part:
    """A part of a trajectory: times (n,) from 0, positions (n, h), and the joints that made it longer."""

    times: Array
    positions: Array
    slowed_by: tuple[str, ...]


def _way_in(pregrasp: Pregrasp) -> Array:
    """Postures (FINE, h) from the pregrasp to the grasp, at equal steps of the contact points' distance.

    Between the postures of the walk each actuated joint goes monotonically, so within its limits.
    """
    from scipy.interpolate import PchipInterpolator  # slow to import

    hand = pregrasp.problem.hand
    actuation = Actuation(hand)
    positions = actuation.unwrapped(actuation.positions(pregrasp.path[:, : hand.model.hand_q_size]))
    if len(positions) == 1:
        return positions
    walked = pregrasp.path_distances.mean(axis=1)
    wanted = np.linspace(walked[-1], walked[0], FINE)
    fine = actuation.full(PchipInterpolator(walked, actuation.actuated(positions))(wanted))
    fine[0], fine[-1] = positions[-1], positions[0]
    return np.asarray(fine)


def _timed(joints: Sequence[str], urdf: str, line: Array, seconds: float, time_step: float) -> _Part:
    """A line of postures (FINE, h), passed with least jerk, no joint faster than its URDF allows."""
    if len(line) == 1:
        return _Part(np.zeros(1), line, ())
    share = np.linspace(0.0, 1.0, FINE)
    passed = _at(line, _smooth(share))
    limits = velocity_limits(urdf)
    speeds = UNSEEN * np.abs(np.diff(passed, axis=0)).max(axis=0) * (FINE - 1)  # if it took one second
    needed = {name: speed / limits[name] for name, speed in zip(joints, speeds, strict=True) if name in limits}
    slowed_by = tuple(name for name, least in needed.items() if least > seconds)
    seconds = max([seconds, *(needed[name] for name in slowed_by)])
    count = max(np.ceil(seconds / time_step - 1e-9), 1.0)
    if not count < MOST_POINTS:
        raise GraspAtlasError(
            f"{seconds:g} s in steps of {time_step:g} s make {count:.3g} points, and a trajectory has at most "
            f"{MOST_POINTS} points; give a longer time_step"
        )
    share = np.linspace(0.0, 1.0, int(count) + 1)
    return _Part(share * seconds, _at(line, _smooth(share)), slowed_by)


def _smooth(share: Array) -> Array:
    """The share of a way that is gone at a share of the time (n,), with least jerk and rest at both ends.

    Source: Flash and Hogan, The coordination of arm movements, 1985.
    """
    return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))


def _at(line: Array, share: Array) -> Array:
    """Postures (n, h) at shares (n,) of a line of postures (k, h) with equal steps."""
    at = share * (len(line) - 1)
    below = np.minimum(at.astype(int), len(line) - 2)
    between = (at - below)[:, None]
    out = (1.0 - between) * line[below] + between * line[below + 1]
    out[share == 0.0], out[share == 1.0] = line[0], line[-1]
    return np.asarray(out)


def _distances(pregrasp: Pregrasp, positions: Array) -> Array:
    """How far the contact points are off the object along its normal (n, m), metres."""
    withdrawal = Withdrawal(pregrasp.problem, np.repeat(pregrasp.path[:1], len(positions), axis=0))
    return np.asarray(withdrawal.distances(withdrawal.actuation.actuated(positions), np.arange(len(positions))))


def _squeeze_positions(pregrasp: Pregrasp, squeeze: Mapping[str, float] | Sequence[float] | Array, at: Array) -> Array:
    """Positions (h,) of all joints at the end of the squeeze; joints that it does not name stay as at the grasp."""
    hand = pregrasp.problem.hand
    if not isinstance(squeeze, Mapping):
        stated = number_array(squeeze, "the squeeze")
        if stated.shape != at.shape:
            raise GraspAtlasError(
                f"a squeeze states {len(at)} joint positions in the order of the hand's joints, or some by name; its "
                f"shape is {stated.shape}"
            )
        squeeze = dict(zip(hand.joints, stated.tolist(), strict=True))
    for name, position in squeeze.items():
        if name not in hand.joints:
            raise unknown_name("joint", name, hand.joints, f"in hand '{hand.name}', for the squeeze")
        if not np.isfinite(number(position, f"the squeeze of joint '{name}'")):
            raise GraspAtlasError(f"the squeeze of joint '{name}' must be finite, got {position}")
    at_grasp = dict(zip(hand.joints, at.tolist(), strict=True))
    stays = {name: at_grasp[name] for name in hand.mechanism.actuated}
    full = hand.mechanism.completed({**stays, **squeeze}, "the squeeze")
    return np.array([full[name] for name in hand.joints])
