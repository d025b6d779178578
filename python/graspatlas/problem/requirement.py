"""Requirements as a problem states them: a name and values. What asks grasps is :mod:`graspatlas.requirements`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from typing import ClassVar

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.support.validation import StatedTable, checked_table, shown

__all__ = ["REQUIREMENTS", "StatedRequirement", "parse_requirement", "requirement_from_dict"]

#: Values of a requirement are at most this.
LARGEST = 1e9

#: Classes of requirements by the name under which problem files and the command line state them, the cheapest
#: first. Each class with a name enters itself when its module is imported.
REQUIREMENTS: dict[str, type[StatedRequirement]] = {}


@dataclass(frozen=True)
class StatedRequirement:
    """A requirement's name and values, its attributes; a subclass with a name of its own can be read by that name.

    Attributes:
        cost: The cheaper ones are checked first.
        needs_arm: Only problems with an arm can meet it.
    """

    name: ClassVar[str] = ""
    cost: ClassVar[int] = 0
    needs_arm: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        """Enter the class under its name, if it has one of its own."""
        super().__init_subclass__()
        if cls.__dict__.get("name"):
            known = sorted({**REQUIREMENTS, cls.name: cls}.items(), key=lambda item: item[1].cost)
            REQUIREMENTS.clear()
            REQUIREMENTS.update(known)

    @property
    def values(self) -> dict[str, float]:
        """Its values by the name of the attribute, in their order."""
        return asdict(self)

    def __str__(self) -> str:
        return ":".join([self.name, *(f"{value:g}" for value in astuple(self))])

    def to_dict(self) -> dict[str, dict[str, float]]:
        """The requirement as plain data: its values under its name."""
        return {self.name: self.values}

    def _check(self, positive: Sequence[str], finite: Sequence[str] = ()) -> None:
        for attribute in (*positive, *finite):
            value = getattr(self, attribute)
            low = 0.0 if attribute in positive else -LARGEST
            if isinstance(value, bool) or not isinstance(value, int | float) or not low < value <= LARGEST:
                kind = "positive" if attribute in positive else "finite"
                raise GraspAtlasError(f"{attribute} of requirement {self.name} must be {kind}, got {shown(value)}")


def parse_requirement(text: str) -> StatedRequirement:
    """The requirement that a text such as ``force_closure:0.5:0.02`` names.

    Args:
        text: A name, then values of its attributes in their order, separated by colons.

    Raises:
        GraspAtlasError: If there is no such requirement, or a value is not a number.
    """
    name, *values = text.split(":")
    attributes = _attributes(name)
    if len(values) > len(attributes):
        raise GraspAtlasError(f"requirement {name} has the values {', '.join(attributes)}; got {shown(text)}")
    try:
        return REQUIREMENTS[name](*map(float, values))
    except ValueError as error:
        if isinstance(error, GraspAtlasError):
            raise
        raise GraspAtlasError(
            f"requirement {shown(text)} holds a value that is not a number; it is {name}:{':'.join(attributes)}"
        ) from None


def requirement_from_dict(data: StatedTable) -> StatedRequirement:
    """The requirement that :meth:`StatedRequirement.to_dict` described.

    Args:
        data: Its values by attribute, or nothing, under its name: ``{"force_closure": {"friction": 0.5}}``.

    Raises:
        GraspAtlasError: If there is no such requirement or attribute, or a value is wrong.
    """
    if not isinstance(data, Mapping) or len(data) != 1:
        raise GraspAtlasError(f"a requirement is a table of one name and its values, got {data!r}")
    ((name, values),) = data.items()
    attributes = _attributes(name)
    return REQUIREMENTS[name](**checked_table(values or {}, f"requirement {name}", (), attributes))


def _attributes(name: str) -> list[str]:
    """Names of the values of a requirement.

    Raises:
        GraspAtlasError: If there is no such requirement.
    """
    if name not in REQUIREMENTS:
        raise unknown_name("requirement", name, REQUIREMENTS)
    return [field.name for field in fields(REQUIREMENTS[name])]
