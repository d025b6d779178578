"""Arguments and plain data from files, checked: tables with known keys, numbers where numbers belong."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from numbers import Integral, Real
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.support.arrays import Array

__all__ = [
    "Plain",
    "PlainTable",
    "StatedTable",
    "check_keywords",
    "checked_instance",
    "checked_table",
    "number",
    "number_array",
    "numbers",
    "positive",
    "read_only",
    "shown",
    "whole",
]

T = TypeVar("T", bound=np.generic)
#: Plain data, as JSON and YAML have it: texts, numbers and booleans, lists and tables of such, and None.
Plain: TypeAlias = "bool | int | float | str | Sequence[Plain] | Mapping[str, Plain] | None"
#: A table of plain data that is made here.
PlainTable: TypeAlias = "dict[str, Plain]"
#: A table that the user or a file states: its values are anything until they are checked.
StatedTable: TypeAlias = Mapping[str, Any]


def checked_instance(value: object, kind: type | tuple[type, ...], what: str, hint: str = "") -> None:
    """Make sure that a value is of a type.

    Args:
        value: What came.
        kind: The type or types that it may have.
        what: Its name for the message.
        hint: What makes one, for the message.

    Raises:
        GraspAtlasError: If it is of another.
    """
    if not isinstance(value, kind):
        kinds = kind if isinstance(kind, tuple) else (kind,)
        expected = " or ".join(k.__name__ for k in kinds)
        raise GraspAtlasError(f"{what} must be a {expected}, got {shown(value)}{hint and f'; see {hint}'}")


def shown(value: object) -> str:
    """A value for a message: text and numbers as they are, of large things the type."""
    text = repr(value)
    return text if len(text) <= 60 and "\n" not in text else f"a {type(value).__name__}"


def check_keywords(given: Iterable[str], known: Iterable[str], function: str) -> None:
    """Refuse keywords that a function does not have, as Python does.

    Raises:
        TypeError: If there is no such keyword; with the one that was meant, where that is clear.
    """
    known = list(known)
    for keyword in given:
        if keyword not in known:
            close = get_close_matches(keyword, known, 1)
            meant = f". Did you mean '{close[0]}'?" if close else ""
            raise TypeError(f"{function}() got an unexpected keyword argument '{keyword}'{meant}")


def checked_table(data: object, what: str, required: Sequence[str], optional: Sequence[str] | None = ()) -> StatedTable:
    """A table, with all the keys that it needs and none that is not known.

    Args:
        data: What came.
        what: Its name for the message.
        required: Keys that it must have.
        optional: Keys that it may have; None allows any.

    Returns:
        The table, whose values may be anything yet.

    Raises:
        GraspAtlasError: If it is not a table, lacks a key, or has an unknown one.
    """
    if not isinstance(data, Mapping):
        raise GraspAtlasError(f"{what} must be a table, got {shown(data)}")
    for key in required:
        if key not in data:
            raise GraspAtlasError(f"{what} has no '{key}'")
    if optional is not None:
        for key in data:
            if key not in required and key not in optional:
                raise unknown_name("key", key, [*required, *optional], f"one of {what}'s")
    return data


def number(value: object, what: str) -> float:
    """A number.

    Raises:
        GraspAtlasError: If it is not a number.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise GraspAtlasError(f"{what} must be a number, got {shown(value)}")
    try:
        return float(value)
    except OverflowError:
        raise GraspAtlasError(f"{what} is too large a whole number") from None


def positive(value: object, what: str, most: float = float("inf")) -> float:
    """A number above 0, and finite.

    Args:
        value: What came.
        what: Its name for the message.
        most: The largest that it may be.

    Raises:
        GraspAtlasError: If it is not.
    """
    kind = "a positive number" if most == float("inf") else f"above 0 and at most {most:g}"
    if isinstance(value, bool) or not isinstance(value, Real):
        raise GraspAtlasError(f"{what} must be {kind}, got {shown(value)}")
    given = number(value, what)
    if not 0.0 < given <= most or given == float("inf"):
        raise GraspAtlasError(f"{what} must be {kind}, got {shown(value)}")
    return given


def whole(value: object, what: str, least: int = 1, most: int | None = None) -> int:
    """A whole number.

    Args:
        value: What came.
        what: Its name for the message.
        least: The smallest that it may be.
        most: The largest that it may be; None for no limit.

    Raises:
        GraspAtlasError: If it is not.
    """
    kind = f"a whole number of at least {least}" if most is None else f"a whole number from {least} to {most}"
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise GraspAtlasError(f"{what} must be {kind}, got {shown(value)}")
    given = int(value)
    if given < least or (most is not None and given > most):
        raise GraspAtlasError(f"{what} must be {kind}, got {shown(value)}")
    return given


def numbers(value: object, what: str) -> tuple[float, ...]:
    """A row of numbers.

    Raises:
        GraspAtlasError: If it is not.
    """
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise GraspAtlasError(f"{what} must be a list of numbers, got {shown(value)}")
    return tuple(number(item, what) for item in value)


def number_array(value: object, what: str) -> Array:
    """An array of numbers.

    Raises:
        GraspAtlasError: If it is not.
    """
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise GraspAtlasError(f"{what} must be an array of numbers, got {shown(value)}") from None


def read_only(array: NDArray[T]) -> NDArray[T]:
    """The same numbers, without a copy, as an array that cannot be written to; the one given can, if it could."""
    view: NDArray[T] = array.view()
    view.flags.writeable = False
    return view
