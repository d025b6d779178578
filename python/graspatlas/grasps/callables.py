"""What an index or a requirement of yours returns, checked: numbers and flags, and nothing that only looks like them.

A callable sees arrays that cannot be written to. What it returns is refused, with the reason, its name and the chart,
when it is no number or no flag: text, None, complex numbers, masked arrays with masked entries, NaN, infinity, another
shape. Nothing is converted that would lose a part.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.support.arrays import AnyArray, Array, BoolArray

__all__ = ["called_flags", "called_numbers", "is_batched"]

#: A function of one grasp, or of a batch: :func:`is_batched` tells which. What it returns is looked at.
GraspFunction: TypeAlias = Callable[[Any], object]
#: Kinds of NumPy types.
_NUMBERS, _FLAGS = "buif", "b"
#: Characters of an error's text that are passed on.
_LONGEST = 300


def is_batched(function: GraspFunction) -> bool:
    """True for a callable that takes all grasps at once; see :func:`graspatlas.batched`."""
    return bool(getattr(function, "batched", False))


def called_numbers(index: GraspFunction, name: str, grasps: Grasps) -> Array:
    """The numbers that an index of your own returns for grasps [n]; finite.

    Args:
        index: Of one grasp, or marked by :func:`graspatlas.batched`.
        name: Its name, for messages.
        grasps: The grasps.

    Raises:
        GraspAtlasError: If it raises, or returns anything else.
    """
    values = _called(index, f"quality index '{name}'", "number", _NUMBERS, grasps).astype(float)
    strange = np.flatnonzero(~np.isfinite(values))
    if len(strange):
        first = int(strange[0])
        value = "NaN" if np.isnan(values[first]) else f"{values[first]}"
        raise GraspAtlasError(
            f"quality index '{name}' returned {value} for {_place(grasps, first)}; return a finite number, 0 for a "
            "grasp to which it does not apply"
        )
    return values


def called_flags(requirement: GraspFunction, name: str, grasps: Grasps) -> BoolArray:
    """What a requirement of your own says of grasps [n].

    Args:
        requirement: Of one grasp, or marked by :func:`graspatlas.batched`.
        name: Its name, for messages.
        grasps: The grasps.

    Raises:
        GraspAtlasError: If it raises, or returns anything but True and False.
    """
    return _called(requirement, f"requirement '{name}'", "boolean", _FLAGS, grasps).astype(bool)


def _called(function: GraspFunction, who: str, what: str, kinds: str, grasps: Grasps) -> AnyArray:
    """One value for each grasp [n], of a NumPy type of these kinds."""
    n = len(grasps)
    if is_batched(function):
        with _named(who, ""):
            returned = function(grasps)
        return _checked(returned, (n,), f"{who} must return an array of {n} {what}s for {n} grasps", kinds)
    values = []
    for i, grasp in enumerate(grasps):
        place = _place(grasps, i)
        with _named(who, f" at {place}"):
            returned = function(grasp)
        values.append(_checked(returned, (), f"{who} must return one {what} for one grasp", kinds, f" for {place}"))
    return np.array(values).reshape(n)


@contextmanager
def _named(who: str, place: str) -> Iterator[None]:
    try:
        yield
    except GraspAtlasError:
        raise
    except Exception as error:
        text = " ".join(str(error).split())[:_LONGEST]
        raise GraspAtlasError(f"{who} raised {type(error).__name__}{place}: {text}") from error


def _checked(returned: object, shape: tuple[int, ...], rule: str, kinds: str, place: str = "") -> AnyArray:
    """What came as an array of this shape, if it is made of numbers or flags."""
    try:
        array = np.asarray(returned)
        masked = _has_masked(returned)
    except Exception:  # objects convert themselves as they like
        raise GraspAtlasError(f"{rule}; it returned {_shown(returned)}{place}") from None
    hint = ""
    if returned is None:
        hint = "; a return statement may be missing"
    elif array.dtype.kind == "c":
        hint = ", which is complex: take its real part or its absolute value"
    elif masked:
        hint = ", which is masked: fill it"
    elif array.dtype.kind not in kinds:
        hint = f" of type {array.dtype}" if array.ndim else ""
    elif array.shape == shape:
        return array
    else:
        hint = f", an array of shape {array.shape}"
        if not shape:
            hint += "; one that takes all grasps at once is marked with graspatlas.batched"
    raise GraspAtlasError(f"{rule}; it returned {_shown(returned)}{place}{hint}")


def _has_masked(returned: object) -> bool:
    """True for a masked array with a masked entry, and for a list of such: as plain arrays they have numbers there."""
    if isinstance(returned, list | tuple):
        return any(_has_masked(item) for item in returned if not isinstance(item, float))
    return bool(np.ma.is_masked(returned)) if np.ma.isMaskedArray(returned) else False


def _shown(value: object) -> str:
    """A value for a message, in one short line; of large things the type."""
    if value is None:
        return "None"
    try:
        text = reprlib.repr(value)
    except Exception:
        text = ""
    short = text and len(text) <= 60 and text.isprintable()
    return text if short else f"a {type(value).__name__}"


def _place(grasps: Grasps, row: int) -> str:
    chart = int(grasps.charts[row])
    return f"chart {chart}" if chart >= 0 else f"grasp {row}"
