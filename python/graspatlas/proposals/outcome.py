"""What came of proposals: the assignments that were tried, and the best grasp of each that was worth an atlas."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspatlas.proposals.matching import Counts
from graspatlas.proposals.trial import LookEnd
from graspatlas.result.result import Result
from graspatlas.storage.files import write_csv
from graspatlas.support.words import Word

__all__ = ["Proposal", "Proposals", "ProposalsEnd", "Tried"]


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
    """

    links: tuple[str, ...]
    regions: tuple[str, ...]
    score: float
    end: LookEnd
    value: float
    why: str

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
    def quality(self) -> float:
        """The index of the best grasp."""
        refined = self.result.refined_best if self.result.refinement else None
        return float((refined or self.result.best).quality)


@dataclass(frozen=True, eq=False)
class Proposals:
    """The grasps that are proposed, the best first.

    Attributes:
        proposals: The proposals.
        tried: All assignments that were looked at, in the order of promise.
        counts: How many assignments there are, and why some were left out.
        status: Why the search ended.
        seconds: Time that it took.
        notes: What a user should know of hand and object, one sentence each.
    """

    proposals: tuple[Proposal, ...]
    tried: tuple[Tried, ...]
    counts: Counts
    status: ProposalsEnd
    seconds: float
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        best = f", the best {self.proposals[0].quality:.4g}" if self.proposals else ""
        return f"<Proposals: {len(self.proposals)} of {len(self.tried)} assignments tried{best}; {self.status}>"

    def rows(self) -> list[dict[str, Any]]:
        """A table with a row for each assignment that was looked at."""
        folders = {id(each.tried): each for each in self.proposals}
        rows = []
        for tried in self.tried:
            proposal = folders.get(id(tried))
            rows.append(
                {
                    "assignment": tried.name,
                    "score": tried.score,
                    "end": str(tried.end),
                    "missed": tried.why,
                    "first_value": tried.value,
                    "value": proposal.quality if proposal else None,
                    "charts": proposal.result.atlas.n_charts if proposal else None,
                    "accepted": int(proposal.result.accepted.sum()) if proposal else None,
                    "folder": proposal.folder.name if proposal else None,
                }
            )
        return rows

    def save_table(self, path: str | Path) -> None:
        """Write the table as CSV.

        Args:
            path: The file.

        Raises:
            GraspAtlasError: If it cannot be written.
        """
        rows = self.rows()
        names = list(rows[0]) if rows else ["assignment"]
        write_csv(path, {name: [row[name] for row in rows] for name in names})
