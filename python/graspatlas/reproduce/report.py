"""What an experiment reports: numbers, figures and sentences."""

from __future__ import annotations

from dataclasses import dataclass, field

from matplotlib.figure import Figure

__all__ = ["Claim", "Number", "Plate", "Section"]

#: Where a number was measured or counted; nothing when it is text.
Value = float | int | str | None


@dataclass(frozen=True)
class Number:
    """One quantity, in the paper and here.

    Attributes:
        run: Which run it belongs to, such as ``"k = 3"``; empty when there is only one.
        quantity: What it is.
        paper: What the paper prints; None when it prints nothing.
        ours: What was measured here.
        unit: Its unit, or nothing.
        why: Why the two differ, in one sentence; empty when they do not, or nothing is printed.
    """

    run: str
    quantity: str
    paper: Value
    ours: Value
    unit: str = ""
    why: str = ""


@dataclass(frozen=True)
class Plate:
    """One figure of the page.

    Attributes:
        file: Name of the picture.
        figure: The figure.
        caption: What it shows.
        alternative: What a reader who does not see it should know.
    """

    file: str
    figure: Figure
    caption: str
    alternative: str


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, and what was found.

    Attributes:
        claim: The claim.
        found: What was found here.
    """

    claim: str
    found: str


@dataclass
class Section:
    """The report of one experiment.

    Attributes:
        name: Name of the experiment.
        title: Its heading.
        text: What was done, a sentence or two.
        numbers, plates, claims: Its content.
    """

    name: str
    title: str
    text: str
    numbers: list[Number] = field(default_factory=list)
    plates: list[Plate] = field(default_factory=list)
    claims: list[Claim] = field(default_factory=list)
