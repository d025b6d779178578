"""Pads as YAML, to be pasted into the contacts of a problem file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields

import yaml

from graspatlas.pads.pad import Pad
from graspatlas.patches.base import Patch
from graspatlas.support.validation import Plain, PlainTable

__all__ = ["pads_text"]

#: Digits after the point of lengths, angles and directions: a tenth of a micrometre.
DIGITS = 7


def pads_text(pads: Sequence[Pad], head: str = "") -> str:
    """YAML of pads, each a contact that lacks its ``object``.

    Args:
        pads: The pads.
        head: What the first line says.
    """
    lines = [f"# {head}"] if head else []
    lines.append("# Contacts that lack their object: paste those that are to touch under contacts: of a problem file.")
    for pad in pads:
        where, normal = (
            " ".join(f"{round(value, 4) + 0.0:g}" for value in vector) for vector in (pad.position, pad.normal)
        )
        error = f"error {1e3 * pad.error:.3f} mm"
        lines.append(f"- frame: {_flow(pad.frame)} # middle {where} m, normal {normal}; {error}")
        lines.append("  hand:")
        lines += [f"    {line}" for line in _patch_lines(pad.patch)]
    return "\n".join(lines) + "\n"


def _patch_lines(patch: Patch) -> list[str]:
    """A patch, a line for each of its attributes that is not as by default; control points a line for each row."""
    lines = []
    for name, value in _stated(patch).items():
        if name == "control_points" and isinstance(value, Sequence):
            lines += [f"{name}:", *(f"  - {_flow(row)}" for row in value)]
        else:
            lines.append(f"{name}: {_flow(value)}")
    return lines


def _stated(patch: Patch) -> PlainTable:
    """What has to be said of a patch: its type, and the attributes that differ from the defaults."""
    defaults = {field.name: field.default for field in fields(patch)}
    table = {name: value for name, value in patch.to_dict().items() if name == "type" or value != defaults.get(name)}
    return {name: _rounded(value) for name, value in table.items()}


def _rounded(value: Plain) -> Plain:
    if isinstance(value, float):
        return round(value, DIGITS) + 0.0  # no negative zero
    if isinstance(value, str | bool | int) or value is None:
        return value
    if isinstance(value, Mapping):
        return {name: _rounded(inner) for name, inner in value.items()}
    return [_rounded(inner) for inner in value]


def _flow(value: Plain) -> str:
    text = str(yaml.safe_dump(value, default_flow_style=True, width=10_000)).strip()
    return text.removesuffix("\n...").strip()
