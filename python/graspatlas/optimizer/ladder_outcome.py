"""What a ladder found: its rungs as a table, in plain data and in one sentence."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.rungs import Rung, RungSummary
from graspatlas.problem.problem import Problem
from graspatlas.result.refinement import PeakStatus
from graspatlas.storage.files import write_csv
from graspatlas.support.words import Word

__all__ = ["Ladder", "LadderStatus", "LadderSummary"]

#: Rungs that gain less than this share are as good as the best.
ENOUGH = 0.01


class LadderStatus(Word):
    """Why a ladder ended."""

    COMPLETE = "complete"
    TIME_LIMIT = "cut short: limit of time"
    INTERRUPTED = "cut short: interrupted"


class LadderSummary(TypedDict):
    """A ladder in plain data."""

    problem: str
    quality: str
    status: str
    seconds: float
    refined: bool
    answer: str
    missing: list[int]
    rungs: list[RungSummary]


@dataclass(frozen=True, eq=False)
class Ladder:
    """The best grasps for more and more hand motions, of :func:`graspatlas.ladder`.

    Attributes:
        problem: The problem, with the first grasp through which all rungs pass.
        quality: Name of the index.
        rungs: The rungs that were done, by ascending dimension; at least one.
        dimensions: The dimensions that were asked for.
        refined: Whether climbs were asked for.
        status: Whether all rungs were begun. Whether each is complete says its result.
        seconds: Time that all took.
    """

    problem: Problem
    quality: str
    rungs: tuple[Rung, ...]
    dimensions: tuple[int, ...]
    refined: bool
    status: LadderStatus
    seconds: float

    def __repr__(self) -> str:
        done = ", ".join(str(rung.dimension) for rung in self.rungs)
        return f"<Ladder of {self.problem.name!r}, k = {done}; {self.status}>"

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __len__(self) -> int:
        return len(self.rungs)

    @property
    def best(self) -> Rung:
        """The lowest of the rungs with the best grasp.

        Raises:
            GraspAtlasError: If no grasp of any meets the requirements.
        """
        values = [(rung.value, rung) for rung in self.rungs if rung.value is not None]
        if not values:
            raise GraspAtlasError(
                f"none of {len(self)} rungs holds a grasp that meets the requirements: relax a requirement"
            )
        return max(values, key=lambda pair: pair[0])[1]

    @property
    def missing(self) -> tuple[int, ...]:
        """Dimensions that were asked for and not begun."""
        return self.dimensions[len(self.rungs) :]

    @property
    def answer(self) -> str:
        """Whether the lowest rung is enough, in one sentence."""
        cut = [rung.dimension for rung in self.rungs if not rung.complete]
        parts = [self._worth()]
        if cut:
            parts.append(f"{_named(cut)} {'was' if len(cut) == 1 else 'were'} cut short")
        if self.missing:
            parts.append(f"{_named(self.missing)} {'was' if len(self.missing) == 1 else 'were'} not begun")
        return "; ".join(parts)

    def _worth(self) -> str:
        """What the rungs above the lowest gain."""
        held = [(rung.dimension, rung.value) for rung in self.rungs if rung.value is not None]
        if not held:
            return f"{_named([rung.dimension for rung in self.rungs])}: no grasp meets the requirements"
        unbounded = [r.dimension for r in self.rungs if r.top and r.top.status is PeakStatus.UNBOUNDED]
        if unbounded:
            return (
                f"from k = {unbounded[0]} on the index grows without bound: state requirements, or take another index"
            )
        (first, least), (last, _) = held[0], held[-1]
        most = max(value for _, value in held)
        enough, value = next((k, v) for k, v in held if v >= most - ENOUGH * abs(most))
        without = [rung.dimension for rung in self.rungs if rung.dimension < first]
        before = f"{_named(without)}: no grasp meets the requirements; " if without else ""
        if len(held) == 1:
            return before + f"only k = {first} tells, and reaches {least:.6g}"
        little = f"up to k = {last} nothing gains more than {100.0 * ENOUGH:g} % over"
        if enough == first:
            return before + f"k = {first} is enough: {little} it"
        gain = (
            f"gains {100.0 * (value - least) / abs(least):.3g} % over" if least else f"reaches {value:.4g} and not 0 as"
        )
        return before + f"k = {enough} {gain} k = {first}" + (f", and {little} that" if last > enough else "")

    def lines(self) -> list[str]:
        """The ladder as an aligned table, its notes, and the answer."""
        name = "refined" if self.refined else ""
        lines = [
            f"{'k':>2} {'radius':>7} {'charts':>7} {'seconds':>8} {'best':>12} {name:>12}  status, and what k frees"
        ]
        for rung in self.rungs:
            refined = ("-" if rung.refined is None else f"{rung.refined:.6g}") if self.refined else ""
            best = "-" if rung.best is None else f"{rung.best:.6g}"
            freed = f"; {rung.motion}" if rung.motion else ""
            atlas = rung.result.atlas
            sizes = f"{rung.dimension:2} {atlas.radius:7.3g} {atlas.n_charts:7} {rung.seconds:8.2f}"
            lines.append(f"{sizes} {best:>12} {refined:>12}  {rung.result.status}{freed}")
        lines += [f"   k = {rung.dimension}: {rung.note}" for rung in self.rungs if rung.note]
        return [*lines, self.answer]

    def summary(self) -> LadderSummary:
        """The ladder in plain data, as the command line prints it."""
        return {
            "problem": self.problem.name,
            "quality": self.quality,
            "status": str(self.status),
            "seconds": self.seconds,
            "refined": self.refined,
            "answer": self.answer,
            "missing": list(self.missing),
            "rungs": [rung.summary() for rung in self.rungs],
        }

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one row a rung: the columns of :meth:`summary`, and number and share of the motion that is freed.

        Args:
            path: Such as ``"ladder.csv"``; an existing file is replaced at once or not.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        rows = [rung.summary() for rung in self.rungs]
        names = [name for name in RungSummary.__annotations__ if name != "motion"]
        columns: dict[str, list[object]] = {name: [_cell(row.get(name)) for row in rows] for name in names}
        motions = [row["motion"] for row in rows]
        columns["motion"] = [_cell(motion and motion["number"]) for motion in motions]
        columns["variance_share"] = [_cell(motion and motion["variance_share"]) for motion in motions]
        write_csv(path, columns)


def _named(dimensions: Sequence[int]) -> str:
    """Some dimensions in words: "k = 4", "k = 4 and 5", "k = 4 to 7"."""
    first, last = dimensions[0], dimensions[-1]
    if len(dimensions) < 3:
        return "k = " + " and ".join(map(str, dimensions))
    if list(dimensions) == list(range(first, last + 1)):
        return f"k = {first} to {last}"
    return "k = " + ", ".join(map(str, dimensions[:-1])) + f" and {last}"


def _cell(value: object) -> object:
    return "" if value is None else value
