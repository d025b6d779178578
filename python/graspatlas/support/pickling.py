"""How objects are pickled and copied, for multiprocessing, Dask and joblib: by what they were made from.

Compiled objects are made again from the arguments of their constructor, and what was only computed once for reuse is
left out and computed again where it is asked for: the same numbers to the bit. Callables, such as an index of your own,
are left to the pickler: ``pickle`` takes functions that a module has by their name, and refuses lambdas; cloudpickle,
which Dask and joblib fall back on, and ``copy.deepcopy`` take them all.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar

T = TypeVar("T")

__all__ = ["Light", "rebuild", "reduced"]


class Light:
    """Base of classes whose cached properties are not pickled: they are computed again where they are asked for."""

    __slots__ = ()

    def __getstate__(self) -> dict[str, object]:
        """The attributes without the cached properties."""
        owner = type(self)
        kept = vars(self).items()
        return {name: value for name, value in kept if not isinstance(getattr(owner, name, None), cached_property)}


def reduced(
    thing: object, base: type, arguments: tuple[object, ...]
) -> tuple[Callable[..., object], tuple[object, ...], object]:
    """What ``__reduce__`` of a compiled object returns.

    Args:
        thing: The object, perhaps of a subclass written in Python; its attributes are kept too.
        base: The compiled class.
        arguments: Arguments of the compiled class's constructor that make such an object.
    """
    getstate = getattr(thing, "__getstate__", None)  # Python 3.10 has none
    state = getstate() if getstate is not None else getattr(thing, "__dict__", None)
    return rebuild, (type(thing), base, arguments), state or None


def rebuild(cls: type[T], base: Any, arguments: tuple[object, ...]) -> T:
    """An object of a class, the compiled part of which is made from these arguments; see :func:`reduced`."""
    thing = cls.__new__(cls)
    base.__init__(thing, *arguments)
    return thing
