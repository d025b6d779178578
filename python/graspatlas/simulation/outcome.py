"""What trials of grasps have shown, for each grasp; as a file beside the result."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, fields
from typing import Any, TypedDict

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.storage.files import read_text, replaced
from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.support.words import Word

__all__ = ["Simulation", "SimulationSummary", "TrialRecord", "load_simulation"]

FORMAT = "graspatlas simulation"
FORMAT_VERSION = 1


class LostWhile(Word):
    """When the object of a trial was lost."""

    CLOSING = "closing"
    PUSHED = "pushed"


class TrialRecord(TypedDict):
    """What the trial of one grasp has shown, as the command line prints it; forces are None where not asked for."""

    chart: int
    refined: bool
    survived: int
    of: int
    shift_mm: float | None
    turn_deg: float | None
    lost_while: str | None
    closing_shift_mm: float | None
    unstable: bool
    contact_distance_mm: dict[str, float]
    penetration_mm: float
    pregrasp_mm: float
    pregrasp_reached: bool
    force_closed: bool
    breaking_force_n: float | None
    breaking_direction: list[float] | None


class SimulationSummary(TypedDict):
    """The trials as the command line prints them."""

    problem: str
    protocol: str
    friction: float
    torsional: float
    distance: float
    normal_force: float
    seed: int
    n_grasps: int
    n_held: int
    n_unstable: int
    rate: float
    lost_closing: int
    complete: bool
    seconds: float
    best: TrialRecord


@dataclass(frozen=True, eq=False)
class Simulation:
    """Trials of n grasps with m contacts under p pushes; the first grasp is the best one that was asked for.

    Attributes:
        problem: Name of the problem.
        protocol: Name of the protocol.
        friction: Coefficient of friction in the trials.
        torsional: Torsional friction in the trials [m].
        distance: From the object at which the fingertips began [m].
        normal_force: With which the fingers squeezed, in the mean of the contacts [N].
        seed: By which grasps were chosen at random.
        contacts: Frames of the hand that touch (m,).
        pushes: Unit vectors of the pushes in the palm's frame (p, 3).
        charts: Chart of each grasp (n,); of the refined best the one its climb began from, -1 for none.
        refined: Whether it is the refined best (n,).
        survived: Which pushes each survived (n, p).
        shifts: How far the object moved at most (n, p), metres.
        turns: How far it turned at most (n, p), radians.
        closing_shifts: How far the object moved while the hand closed (n,), metres.
        lost_closing: Whether it was lost while the hand closed (n,).
        unstable: Whether MuJoCo gave a trial of the grasp up, because its numbers grew without bound (n,): nothing that
            the others say of it counts, and it has not held.
        contact_distances: Of each contact's shapes before closing (n, m), metres; negative where they overlap.
        depths: Deepest overlap of hand and object before closing (n,), metres.
        pregrasp_distances: How far off the object the fingertips began (n,), metres.
        reached: Whether that was as far as was asked (n,).
        closes: Whether friction of the protocol closes the grasp (n,).
        breaking_forces: Smallest growing push that the object was lost under (n,), newtons; NaN where not asked for,
            inf where none did.
        breaking_directions: Its direction in the palm's frame (n, 3).
        seconds: How long it took.
        complete: False when it was interrupted.
    """

    problem: str
    protocol: str
    friction: float
    torsional: float
    distance: float
    normal_force: float
    seed: int
    contacts: tuple[str, ...]
    pushes: Array
    charts: IntArray
    refined: BoolArray
    survived: BoolArray
    shifts: Array
    turns: Array
    closing_shifts: Array
    lost_closing: BoolArray
    unstable: BoolArray
    contact_distances: Array
    depths: Array
    pregrasp_distances: Array
    reached: BoolArray
    closes: BoolArray
    breaking_forces: Array
    breaking_directions: Array
    seconds: float
    complete: bool = True

    def __len__(self) -> int:
        return len(self.charts)

    def __repr__(self) -> str:
        return f"<Simulation of {len(self)} grasps of {self.problem!r}: {int(self.held.sum())} held in {self.protocol}>"

    @property
    def held(self) -> BoolArray:
        """Whether each grasp survived all pushes (n,)."""
        return np.asarray(self.survived.all(axis=1))

    @property
    def rate(self) -> float:
        """Share of the grasps that survived all pushes."""
        return float(self.held.mean())

    def trial(self, i: int) -> TrialRecord:
        """What one trial has shown, in plain data."""
        breaking = _finite(self.breaking_forces[i])
        return {
            "chart": int(self.charts[i]),
            "refined": bool(self.refined[i]),
            "survived": int(self.survived[i].sum()),
            "of": len(self.pushes),
            "shift_mm": _finite(1e3 * self.shifts[i].max()),
            "turn_deg": _finite(np.degrees(self.turns[i].max())),
            "lost_while": self._lost_while(i),
            "closing_shift_mm": _finite(1e3 * self.closing_shifts[i]),
            "unstable": bool(self.unstable[i]),
            "contact_distance_mm": dict(zip(self.contacts, (1e3 * self.contact_distances[i]).tolist(), strict=True)),
            "penetration_mm": 1e3 * float(self.depths[i]),
            "pregrasp_mm": 1e3 * float(self.pregrasp_distances[i]),
            "pregrasp_reached": bool(self.reached[i]),
            "force_closed": bool(self.closes[i]),
            "breaking_force_n": breaking,
            "breaking_direction": None if breaking is None else self.breaking_directions[i].tolist(),
        }

    def _lost_while(self, i: int) -> str | None:
        if self.lost_closing[i]:
            return str(LostWhile.CLOSING)
        return None if self.held[i] else str(LostWhile.PUSHED)

    def summary(self) -> SimulationSummary:
        """The trials in plain data, as the command line prints them."""
        return {
            "problem": self.problem,
            "protocol": self.protocol,
            "friction": self.friction,
            "torsional": self.torsional,
            "distance": self.distance,
            "normal_force": self.normal_force,
            "seed": self.seed,
            "n_grasps": len(self),
            "n_held": int(self.held.sum()),
            "n_unstable": int(self.unstable.sum()),
            "rate": self.rate,
            "lost_closing": int(self.lost_closing.sum()),
            "complete": self.complete,
            "seconds": self.seconds,
            "best": self.trial(0),
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the trials to a JSON file, which :func:`load_simulation` reads.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        table = {
            "format": FORMAT,
            "version": FORMAT_VERSION,
            **{f.name: _plain(getattr(self, f.name)) for f in fields(self)},
        }
        with replaced(path) as stream:
            stream.write(json.dumps(table).encode())


def load_simulation(path: str | os.PathLike[str]) -> Simulation:
    """Read trials that :meth:`Simulation.save` wrote.

    Raises:
        GraspAtlasError: If the file is missing, damaged, or of another version.
    """
    try:
        table: dict[str, Any] = json.loads(read_text(path))
        if (table.pop("format"), table.pop("version")) != (FORMAT, FORMAT_VERSION):
            raise ValueError("it is of another format or version")
        return Simulation(**{name: _typed(name, value) for name, value in table.items()})
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise GraspAtlasError(f"'{path}' holds no simulation ({error}); run graspatlas simulate again") from None


_FLAGS = ("refined", "survived", "lost_closing", "unstable", "reached", "closes")
_NUMBERS = (
    "pushes",
    "shifts",
    "turns",
    "closing_shifts",
    "contact_distances",
    "depths",
    "pregrasp_distances",
    "breaking_forces",
    "breaking_directions",
)


def _finite(value: float) -> float | None:
    """A number that JSON knows, or nothing."""
    return float(value) if np.isfinite(value) else None


def _plain(value: Any) -> Any:
    """A value as JSON has it; numbers that JSON does not know as text."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value


def _typed(name: str, value: Any) -> Any:
    if name in _FLAGS:
        return np.asarray(value, bool)
    if name in _NUMBERS:
        return np.asarray(value, float)
    if name == "charts":
        return np.asarray(value, np.int64)
    return tuple(value) if name == "contacts" else value
