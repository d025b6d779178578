"""The page that is laid beside the paper; it loads nothing from the network."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib import resources
from itertools import groupby
from string import Template

from graspatlas.reproduce.climbing import MAX_STEPS, SEED, STARTS
from graspatlas.reproduce.published import MACHINE
from graspatlas.reproduce.report import Number, Plate, Section

__all__ = ["page"]

#: Quantities of the overview: what stands in the column, and what the number is called.
OVERVIEW = {
    "t": "dimension t of feasible grasps",
    "s": "frozen hand motions s",
    "k": "dimension k of relevant grasps",
    "r": "radius r of a chart",
    "charts": "charts",
    "atlas [s]": "time for the atlas",
    "index [s]": "time for the index",
    "both [s]": "time for atlas and index",
}


def page(sections: Sequence[Section], machine: Mapping[str, str | int], seconds: Mapping[str, float]) -> str:
    """The page's text.

    Args:
        sections: The experiments.
        machine: See :func:`graspatlas.reproduce.machine.describe_machine`.
        seconds: Time that each experiment took, with local searches and figures.
    """
    template = Template((resources.files("graspatlas.reproduce") / "page.html").read_text(encoding="utf-8"))
    took = ", ".join(f"{name} {value:.0f} s" for name, value in seconds.items())
    return template.substitute(
        contents="".join(f'<li><a href="#{escape(s.name)}">{escape(s.title)}</a></li>' for s in sections),
        overview=_overview(sections),
        sections="\n".join(_section(section) for section in sections),
        machine=escape(", ".join(f"{key} {value}" for key, value in machine.items())),
        paper_machine=escape(MACHINE),
        seconds=escape(f"Time with local searches and figures: {took}; {sum(seconds.values()):.0f} s in all."),
    )


def _overview(sections: Sequence[Section]) -> str:
    """Paper and ours in two lines a run."""
    body = []
    for section in sections:
        for run, numbers in _runs(section):
            found = {n.quantity: n for n in numbers}
            if "charts" not in found:
                continue
            title = f"{section.title.partition(': ')[2] or section.title}{', ' if run else ''}{run}"
            for who, side in (("paper", "paper"), ("here", "ours")):
                cells = "".join(_cell(getattr(found[q], side) if q in found else None) for q in OVERVIEW.values())
                head = f'<th scope="row" rowspan="2">{escape(title)}</th>' if who == "paper" else ""
                body.append(f"<tr>{head}<td>{who}</td>{cells}</tr>")
    if not body:
        return ""
    heads = "".join(f'<th class="n" scope="col">{escape(name)}</th>' for name in OVERVIEW)
    return (
        '<h2 id="overview">At a glance</h2><div class="scroll" tabindex="0"><table><thead><tr>'
        f'<th scope="col">experiment</th><th scope="col"></th>{heads}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>"
    )


def _section(section: Section) -> str:
    plates = "\n".join(_plate(plate) for plate in section.plates)
    tables = _tables(section)
    claims = "".join(f"<dt>{escape(c.claim)}</dt><dd>{escape(c.found)}</dd>" for c in section.claims)
    tested = f"<h3>The paper&rsquo;s claims, tested</h3><p class='note'>{escape(_method())}</p><dl>{claims}</dl>"
    return (
        f'<section id="{escape(section.name)}"><h2>{escape(section.title)}</h2><p>{escape(section.text)}</p>'
        f"{plates}{tested if claims else ''}<h3>Numbers</h3>{tables}</section>"
    )


def _method() -> str:
    return (
        "The local optimiser is sequential quadratic programming in the tangent space of the current grasp, with joint "
        "limits, patch intervals and requirements as constraints; it moves on until the slope of the index vanishes or "
        f"is held back by them, at most {MAX_STEPS} steps. It starts from {STARTS} charts drawn at random (seed "
        f"{SEED}), or from all where "
        "fewer meet the requirements: grasps that the atlas gives it for nothing, so that it is a strong opponent. "
        "Ends that are less than half a chart radius apart count as one place."
    )


def _runs(section: Section) -> Iterator[tuple[str, list[Number]]]:
    """Numbers grouped by run, in the order in which the runs first appear."""
    order = list(dict.fromkeys(n.run for n in section.numbers))
    ranked = sorted(section.numbers, key=lambda n: order.index(n.run))
    for run, numbers in groupby(ranked, key=lambda n: n.run):
        yield run, list(numbers)


def _tables(section: Section) -> str:
    """Runs that the paper has numbers for, each in a table; the others side by side."""
    runs = list(_runs(section))
    printed = [(run, numbers) for run, numbers in runs if any(n.paper is not None for n in numbers)]
    own = [(run, numbers) for run, numbers in runs if all(n.paper is None for n in numbers)]
    alike: dict[tuple[str, ...], list[tuple[str, list[Number]]]] = {}
    for run, numbers in own:
        alike.setdefault(tuple(n.quantity for n in numbers), []).append((run, numbers))
    return "\n".join([*(_table(*item) for item in printed), *(_columns(runs) for runs in alike.values())])


def _columns(runs: Sequence[tuple[str, Sequence[Number]]]) -> str:
    """Runs with the same quantities, one a column."""
    heads = "".join(f'<th class="n" scope="col">{escape(run) or "here"}</th>' for run, _ in runs)
    rows = "".join(
        f'<tr><th scope="row">{_quantity(row[0])}</th>{"".join(_cell(n.ours) for n in row)}</tr>'
        for row in zip(*(numbers for _, numbers in runs), strict=True)
    )
    return (
        f'<div class="scroll" tabindex="0"><table class="small"><thead><tr><th scope="col">quantity</th>{heads}</tr>'
        f"</thead><tbody>{rows}</tbody></table></div>"
    )


def _quantity(number: Number) -> str:
    return escape(f"{number.quantity} [{number.unit}]" if number.unit else number.quantity)


def _table(run: str, numbers: Sequence[Number]) -> str:
    rows = "".join(
        f'<tr><th scope="row">{_quantity(n)}</th>'
        f'{_cell(n.paper)}{_cell(n.ours)}<td class="why">{escape(n.why)}</td></tr>'
        for n in numbers
    )
    caption = f"<caption>{escape(run)}</caption>" if run else ""
    return (
        f'<div class="scroll" tabindex="0"><table>{caption}<thead><tr><th scope="col">quantity</th>'
        '<th class="n" scope="col">paper</th><th class="n" scope="col">here</th><th scope="col">why they differ</th>'
        f"</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _plate(plate: Plate) -> str:
    file = escape(plate.file)
    return (
        f'<figure><a href="{file}"><img src="{file}" alt="{escape(plate.alternative)}" loading="lazy"></a>'
        f"<figcaption>{escape(plate.caption)}</figcaption></figure>"
    )


def _cell(value: float | int | str | None) -> str:
    return f'<td class="n">{_words(value)}</td>'


def _words(value: float | int | str | None) -> str:
    """A value for people, as HTML."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return escape(value)
    if isinstance(value, int) or 1e4 <= abs(value) < 1e6:
        return f"{value:,.0f}".replace(",", "\u202f")
    if value and not 1e-3 <= abs(value) < 1e4:
        mantissa, _, exponent = f"{value:.2e}".partition("e")
        return f"{mantissa} × 10<sup>{int(exponent)}</sup>".replace("-", "\u2212")
    return f"{value:.3g}" if abs(value) < 100.0 else f"{value:.4g}"
