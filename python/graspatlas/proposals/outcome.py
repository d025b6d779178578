"""What came of proposals: the assignments that were tried, and the best grasp of each that was worth an atlas."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspatlas.grasps.grasp import Grasp
from graspatlas.proposals.assignments.matching import Counts
from graspatlas.proposals.trials.trial import LookEnd
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.result.result import Result
from graspatlas.storage.files import write_csv
from graspatlas.support.validation import PlainTable
from graspatlas.support.words import Word

__all__ = ["COLUMNS", "Proposal", "Proposals", "ProposalsEnd", "Tried"]

#: Columns of the table: which link on which region, how promising it was, what came of a first look, the requirement
#: that was missed and what the grasp lacks that came nearest, the index of the best grasp of the look and after the
#: atlas, its charts, those that meet the requirements, and the folder.
COLUMNS = ("assignment", "distance", "end", "missed", "lack", "first_value", "value", "charts", "accepted", "folder")


class ProposalsEnd(Word):
    """Why the search for proposals ended."""

    COMPLETE = "all assignments were tried"
    TIME_LIMIT = "limit of time"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Tried:
    """What a first look at an assignment found.

    Attributes:
        links: The links that touch.
        regions: The region that each touches.
        score: How far the nearest posture is from the nearest points on the regions; small is promising.
        end: What came of it.
        value: The index of the best grasp that was found; -inf where none meets the requirements.
        why: The requirement that was missed, where one was.
        lack: What the grasp lacks that came nearest to meeting the requirements, where none did.
    """

    links: tuple[str, ...]
    regions: tuple[str, ...]
    score: float
    end: LookEnd
    value: float
    why: str
    lack: str = ""

    @property
    def reason(self) -> str:
        """What came of it, and the requirement that was missed."""
        return f"{self.end}: {self.why}" if self.why else str(self.end)

    @property
    def name(self) -> str:
        """Which link touches which region."""
        return ", ".join(f"{link} on {region}" for link, region in zip(self.links, self.regions, strict=True))


@dataclass(frozen=True, eq=False)
class Proposal:
    """A grasp that is proposed.

    Attributes:
        tried: The assignment, and what a first look at it found.
        result: Its atlas, with the best grasp in all motions as ``result.refined_best``.
        folder: Where problem file, result, picture and page are.
    """

    tried: Tried
    result: Result
    folder: Path

    @property
    def grasp(self) -> Grasp:
        """The best grasp, refined where it was."""
        return self.result.refined_best if self.result.refinement else self.result.best

    @property
    def quality(self) -> float:
        """The index of the best grasp."""
        return float(self.grasp.quality)


@dataclass(frozen=True, eq=False)
class Proposals:
    """The grasps that are proposed, the best first.

    Attributes:
        proposals: The proposals.
        quality: The index that ranks them.
        tried: All assignments that were looked at, in the order of promise.
        counts: How many assignments there are, and why some were left out.
        status: Why the search ended.
        seconds: Time that it took.
        notes: What a user should know of hand and object, one sentence each.
    """

    proposals: tuple[Proposal, ...]
    quality: Quality
    tried: tuple[Tried, ...]
    counts: Counts
    status: ProposalsEnd
    seconds: float
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Proposals: {self.summary()}>"

    def _repr_html_(self) -> str:
        from graspatlas.viewer.notebook.card import card, folded, table
        from graspatlas.viewer.notebook.pictures import picture_of_grasp

        rows = [
            (each.quality, each.tried.name, each.result.atlas.n_charts, int(each.result.accepted.sum()), each.folder)
            for each in self.proposals
        ]
        content = [table(rows, (quality_name(self.quality), "assignment", "charts", "accepted", "folder"))]
        if refusals := self.refusals():
            content.append(folded("why others were refused", table(refusals)))
        content.append(table([[note] for note in self.notes]) if self.notes else "")
        beside = picture_of_grasp(self.proposals[0].grasp) if self.proposals else ""
        return card(f"Proposals: {self.summary()}", content, beside)

    def summary(self) -> str:
        """How many there are of how many that were looked at, the best, what refused the others, and why it ended."""
        best = f", the best of {quality_name(self.quality)} {self.proposals[0].quality:.4g}" if self.proposals else ""
        met = sum(each.end is LookEnd.MET for each in self.tried)
        looked = f"{len(self.tried)} of {self.counts.left} assignments looked at, {met} with grasps as required"
        return f"{len(self.proposals)} proposed{best}; {looked}; {self.status}, {self.seconds:.1f} s"

    def refusals(self) -> dict[str, int]:
        """What came of the assignments without a grasp that meets the requirements, the most frequent first."""
        ends = Counter(each.reason for each in self.tried if each.end is not LookEnd.MET)
        return dict(ends.most_common())

    def rows(self) -> list[dict[str, Any]]:
        """A table with a row for each assignment that was looked at."""
        proposed = {id(each.tried): each for each in self.proposals}
        return [_row(each, proposed.get(id(each))) for each in self.tried]

    def to_dict(self) -> PlainTable:
        """The figures as plain data, without the results."""
        return {
            "status": str(self.status),
            "seconds": self.seconds,
            "quality": quality_name(self.quality),
            "assignments": {"all": self.counts.all, "left": self.counts.left, "looked_at": len(self.tried)},
            "notes": list(self.notes),
            "refusals": dict(self.refusals()),
            "proposals": [
                {"quality": each.quality, "assignment": each.tried.name, "folder": str(each.folder)}
                for each in self.proposals
            ],
        }

    def save_table(self, path: str | Path) -> None:
        """Write the table as CSV.

        Args:
            path: The file.

        Raises:
            GraspAtlasError: If it cannot be written.
        """
        rows = self.rows()
        write_csv(path, {name: [row[name] for row in rows] for name in COLUMNS})


def _row(tried: Tried, proposal: Proposal | None) -> dict[str, Any]:
    """What the table says of an assignment; see :data:`COLUMNS`."""
    met = tried.end is LookEnd.MET
    row: dict[str, Any] = {
        "assignment": tried.name,
        "distance": tried.score,
        "end": str(tried.end),
        "missed": tried.why,
        "lack": tried.lack,
        "first_value": tried.value if met else float("nan"),
    }
    if proposal is None:
        return row | {"value": float("nan"), "charts": "", "accepted": "", "folder": ""}
    result = proposal.result
    counts = {"charts": result.atlas.n_charts, "accepted": int(result.accepted.sum())}
    return row | {"value": proposal.quality, **counts, "folder": proposal.folder.name}
