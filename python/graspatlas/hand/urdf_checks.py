"""Numbers and names of a URDF, looked at before a parser does: that one drops a shape which it cannot read."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree import ElementTree

from graspatlas.errors import GraspAtlasError
from graspatlas.support.terminal import printable

__all__ = ["check_urdf"]

#: Lengths, angles and limits are smaller [m, rad]; larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9
#: Longest name of a link or joint [characters].
LONGEST_NAME = 200
#: Attributes of shapes: how many numbers, and whether all must be positive.
_SHAPES = {
    "box": (("size", 3, True),),
    "sphere": (("radius", 1, True),),
    "cylinder": (("radius", 1, True), ("length", 1, True)),
    "capsule": (("radius", 1, True), ("length", 1, True)),
    "mesh": (("scale", 3, False),),
}
#: Joints whose axis and limits count; parsers pass over those of others.
_WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
_WITH_LIMITS = ("revolute", "prismatic")
#: Attributes that may be left out.
_OPTIONAL = ("scale",)


def check_urdf(name: str, text: str) -> None:
    """Make sure that a URDF is one, and that its shapes, placements, axes and limits are numbers that can be.

    Args:
        name: Of the hand or object, for messages.
        text: The URDF.

    Raises:
        GraspAtlasError: If it is not; the message names link or joint, attribute and value.
    """
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise GraspAtlasError(f"the URDF of '{name}' is not XML: {error}") from None
    if root.tag != "robot":
        hint = "; an MJCF is read by mjcf: in a problem file, or Hand.from_mjcf" if root.tag == "mujoco" else ""
        raise GraspAtlasError(f"the URDF of '{name}' must hold a <robot>, not a <{root.tag}>{hint}")
    for kind in ("link", "joint"):
        seen: set[str] = set()
        for element in root.findall(kind):
            own = element.get("name") or ""
            if not own or len(own) > LONGEST_NAME or own != printable(own):
                raise _wrong(name, kind, own, f"needs a name of at most {LONGEST_NAME} letters, without control codes")
            if own in seen:
                raise _wrong(name, kind, own, "stands twice; rename one")
            seen.add(own)
            for reason in _faults(element):
                raise _wrong(name, kind, own, reason)


def _faults(element: ElementTree.Element) -> Iterator[str]:
    """What is wrong with a link or joint."""
    for origin in element.iter("origin"):
        yield from _numbers(origin, "xyz", 3)
        yield from _numbers(origin, "rpy", 3)
    kind = element.get("type")
    for axis in element.findall("axis") if kind in _WITH_AXIS else ():
        yield from _numbers(axis, "xyz", 3)
        if not any(map(float, (axis.get("xyz") or "1").split())):
            yield "has an axis of length 0; give it a direction"
    for limit in element.findall("limit") if kind in _WITH_LIMITS else ():
        for attribute in ("lower", "upper", "effort", "velocity"):
            yield from _numbers(limit, attribute, 1, finite=attribute in ("lower", "upper"))
    for geometry in element.iter("geometry"):
        for shape in geometry:
            yield from _shape_faults(shape)


def _shape_faults(shape: ElementTree.Element) -> Iterator[str]:
    if shape.tag == "mesh" and not (shape.get("filename") or "").strip():
        yield "has a <mesh> without filename; name the file"
    for attribute, count, positive in _SHAPES.get(shape.tag, ()):
        if shape.get(attribute) is None and attribute not in _OPTIONAL:
            yield f"has a <{shape.tag}> without {attribute}; state it"
        yield from _numbers(shape, attribute, count, positive=positive)
        if attribute == "scale" and 0.0 in map(float, (shape.get("scale") or "1").split()):
            yield "has a <mesh> of scale 0, which is flat; correct it"


def _numbers(
    element: ElementTree.Element, attribute: str, count: int, *, positive: bool = False, finite: bool = True
) -> Iterator[str]:
    """A fault, when an attribute that is there is not so many numbers."""
    text = element.get(attribute)
    if text is None:
        return
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    sound = len(values) == count and all(
        (abs(value) < LARGEST if finite else not math.isnan(value)) and (value > 0.0 or not positive)
        for value in values
    )
    if not sound:
        kind = f"{'positive ' if positive else ''}number{'s' if count > 1 else ''}"
        below = f" below {LARGEST:g}" if finite else ""
        wanted = f"{count if count > 1 else 'a'} {kind}{below}"
        yield f"has a <{element.tag}> with {attribute}={printable(text)[:60]!r}; it must be {wanted}"


def _wrong(body: str, kind: str, name: str, reason: str) -> GraspAtlasError:
    return GraspAtlasError(f"{kind} '{printable(name)[:60]}' of the URDF of '{printable(body)[:60]}' {reason}")
