"""A card: a title, a table, a picture beside them, and what can be folded out. It follows a notebook's theme.

All texts are escaped: a name is shown as it is, whatever it holds. Colours are those of the page around it, lighter or
darker, so that a card can be read in light and dark themes.
"""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np

from graspatlas.support.arrays import Array

__all__ = ["bars", "card", "curve", "folded", "picture", "shown_number", "table"]

#: A line between rows, on light and dark ground.
LINE = "1px solid rgba(128, 128, 128, 0.3)"
CELL = f"padding: 0.15em 0.9em 0.15em 0; border: 0; border-bottom: {LINE}; text-align: left; vertical-align: top"
#: Size of curves and bars [pixels].
WIDE, HIGH = 320, 120


def card(title: str, content: Sequence[str], beside: str = "") -> str:
    """A card.

    Args:
        title: What it is about.
        content: HTML below the title: tables, and what is folded.
        beside: HTML of a picture, or nothing.
    """
    return (
        '<div style="display: flex; flex-wrap: wrap; gap: 1.2em; align-items: flex-start; color: inherit">'
        f'<div style="min-width: 0"><div style="font-weight: 600; padding-bottom: 0.3em">{html.escape(title)}</div>'
        f"{''.join(content)}</div>{beside}</div>"
    )


def table(rows: Mapping[str, object] | Sequence[Sequence[object]], head: Sequence[str] = ()) -> str:
    """A table.

    Args:
        rows: What is said of each thing, by its name; or cells row by row.
        head: Heads of the columns, if there are any.
    """
    listed = [list(row) for row in (rows.items() if isinstance(rows, Mapping) else rows)]
    top = "".join(f'<th style="{CELL}">{html.escape(name)}</th>' for name in head)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in listed)
    style = "border-collapse: collapse; margin: 0; font-size: inherit; color: inherit"
    return (
        f'<div style="overflow-x: auto"><table style="{style}">{f"<tr>{top}</tr>" if top else ""}{body}</table></div>'
    )


def _cell(value: object) -> str:
    text = shown_number(value) if isinstance(value, float) else str(value)
    return f'<td style="{CELL}">{html.escape(text)}</td>'


def folded(summary: str, content: str) -> str:
    """Something that is seen when its summary is clicked."""
    return f'<details><summary style="cursor: pointer">{html.escape(summary)}</summary>{content}</details>'


def shown_number(value: float) -> str:
    """A number to five digits."""
    return f"{value:.5g}"


def picture(uri: str, words: str) -> str:
    """A picture by its address, and what it shows in words; nothing where there is no address."""
    if not uri:
        return ""
    style = "max-width: 100%; height: auto; border-radius: 6px; margin: 0"
    return f'<img src="{html.escape(uri)}" alt="{html.escape(words)}" style="{style}">'


def curve(x: Array, y: Array, words: str) -> str:
    """A curve through points (n,), with what it shows in words below it."""
    places = np.column_stack([_scaled(np.asarray(x), WIDE - 8) + 4, HIGH - 4 - _scaled(np.asarray(y), HIGH - 8)])
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
    line = f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1.5"/>'
    return _drawn(line, words)


def bars(values: Sequence[float], words: str) -> str:
    """A bar for each value, from 0 on, with what they show in words below."""
    heights = np.maximum(np.asarray(values, float), 0.0)
    heights = heights / max(float(heights.max(initial=0.0)), 1e-300) * (HIGH - 8)
    step = (WIDE - 8) / max(len(heights), 1)
    drawn = "".join(
        f'<rect x="{4 + i * step:.1f}" y="{HIGH - 4 - height:.1f}" width="{0.8 * step:.1f}" height="{height:.1f}" '
        'fill="currentColor" fill-opacity="0.6"/>'
        for i, height in enumerate(heights)
    )
    return _drawn(drawn, words)


def _drawn(shapes: str, words: str) -> str:
    ground = f'<path d="M4 {HIGH - 3.5}H{WIDE - 4}" stroke="currentColor" stroke-opacity="0.3"/>'
    return (
        f'<div style="max-width: 100%"><svg viewBox="0 0 {WIDE} {HIGH}" width="{WIDE}" style="max-width: 100%" '
        f'role="img" aria-label="{html.escape(words)}">{ground}{shapes}</svg>'
        f'<div style="opacity: 0.7; font-size: 0.9em">{html.escape(words)}</div></div>'
    )


def _scaled(values: Array, size: float) -> Array:
    """Values from 0 to a size; those that are not finite at 0."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    return np.nan_to_num((values - low) / max(high - low, 1e-300) * size, nan=0.0, posinf=size, neginf=0.0)
