"""Patches from plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.patches.base import Patch
from graspatlas.patches.curve import Curve
from graspatlas.patches.flat import Plane, Point
from graspatlas.patches.round import Ellipsoid, Sphere, Torus
from graspatlas.patches.spline import Bezier, BSpline
from graspatlas.patches.turned import Cone, Cylinder, Revolution
from graspatlas.support.validation import StatedTable, shown

__all__ = ["patch_from_dict", "patch_types"]

_ROUND = (Cylinder, Cone, Revolution, Sphere, Torus, Ellipsoid)
_CLASSES: tuple[type[Patch], ...] = (Point, Plane, *_ROUND, Bezier, BSpline, Curve)
_KINDS: dict[str, type[Patch]] = {c.kind: c for c in _CLASSES}


def patch_types() -> tuple[type[Patch], ...]:
    """All types of patches."""
    return _CLASSES


def patch_from_dict(data: StatedTable) -> Patch:
    """The patch that :meth:`Patch.to_dict` described.

    Args:
        data: ``type`` and the attributes of that patch.

    Raises:
        GraspAtlasError: For an unknown type or attribute, or values that make no patch.
    """
    if not isinstance(data, Mapping):
        raise GraspAtlasError(f"a patch is a table with a 'type', got {shown(data)}")
    values = dict(data)
    kind = values.pop("type", None)
    if kind not in _KINDS:
        raise unknown_name("patch type", kind, _KINDS)
    cls = _KINDS[kind]
    known = {field.name for field in fields(cls)}
    for name in values:
        if name not in known:
            raise unknown_name("attribute", name, known, f"one of a {kind} patch's")
    try:
        if isinstance(values.get("patch"), Mapping):
            values["patch"] = patch_from_dict(values["patch"])
        return cls(**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})
    except GraspAtlasError as error:
        raise GraspAtlasError(f"{kind} patch: {error}") from None
    except TypeError as error:
        raise GraspAtlasError(f"a {kind} patch cannot be made of {shown(values)}: {error}") from None
