"""Plain data from files, checked: tables with known keys, numbers where numbers belong; and columns of tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas.errors import GraspAtlasError, unknown_name

__all__ = [
    "checked_instance",
    "checked_table",
    "joined",
    "number",
    "number_array",
    "numbers",
    "pose_columns",
    "read_only",
    "shown",
]

T = TypeVar("T", bound=np.generic)


def checked_instance(value: Any, kind: type | tuple[type, ...], what: str, hint: str = "") -> None:
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


def shown(value: Any) -> str:
    """A value for a message: text and numbers as they are, of large things the type."""
    text = repr(value)
    return text if len(text) <= 60 and "\n" not in text else f"a {type(value).__name__}"


def checked_table(
    data: Any, what: str, required: Sequence[str], optional: Sequence[str] | None = ()
) -> Mapping[str, Any]:
    """A table, with all the keys that it needs and none that is not known.

    Args:
        data: What came.
        what: Its name for the message.
        required: Keys that it must have.
        optional: Keys that it may have; None allows any.

    Raises:
        GraspAtlasError: If it is no table, lacks a key, or has an unknown one.
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


def number(value: Any, what: str) -> float:
    """A number.

    Raises:
        GraspAtlasError: If it is none.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise GraspAtlasError(f"{what} must be a number, got {shown(value)}")
    try:
        return float(value)
    except OverflowError:
        raise GraspAtlasError(f"{what} is too large a whole number") from None


def numbers(value: Any, what: str) -> tuple[float, ...]:
    """A row of numbers.

    Raises:
        GraspAtlasError: If it is none.
    """
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise GraspAtlasError(f"{what} must be a list of numbers, got {shown(value)}")
    return tuple(number(item, what) for item in value)


def number_array(value: ArrayLike, what: str) -> NDArray[np.float64]:
    """An array of numbers.

    Raises:
        GraspAtlasError: If it is none.
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


def joined(*tables: Mapping[str, Any]) -> dict[str, Any]:
    """Columns of several tables side by side.

    Raises:
        GraspAtlasError: If two have one name, as a joint called ``quality`` would.
    """
    columns: dict[str, Any] = {}
    for table in tables:
        for name in table:
            if name in columns:
                raise GraspAtlasError(f"two columns of the table would be called '{name}'; rename the joint or index")
        columns |= table
    return columns


def pose_columns(name: str, xyz: NDArray[np.float64], quat_xyzw: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Columns of poses: ``<name>_x``, ``_y``, ``_z`` and ``<name>_qx``, ``_qy``, ``_qz``, ``_qw``.

    Args:
        name: What has the poses.
        xyz: Positions [n, 3], metres.
        quat_xyzw: Unit quaternions [n, 4].
    """
    places = {f"{name}_{axis}": xyz[:, i] for i, axis in enumerate("xyz")}
    return {**places, **{f"{name}_q{axis}": quat_xyzw[:, i] for i, axis in enumerate("xyzw")}}
