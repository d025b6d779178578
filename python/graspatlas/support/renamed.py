"""Names that were given up for clearer ones, and still work."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

__all__ = ["renamed_attribute", "renamed_keyword"]

P = ParamSpec("P")
T = TypeVar("T")


def renamed_attribute(old: str, new: str) -> property:
    """A property that hands on to the attribute that took its place, with a warning."""

    def get(self: object) -> object:
        warnings.warn(f"'{old}' is now called '{new}'", DeprecationWarning, stacklevel=2)
        return getattr(self, new)

    return property(get, doc=f"Deprecated name of ``{new}``.")


def renamed_keyword(old: str, new: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A function that also takes a keyword by its old name, with a warning."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        @wraps(function)
        def renamed(*args: P.args, **options: P.kwargs) -> T:
            if old in options:
                warnings.warn(f"the keyword '{old}' is now called '{new}'", DeprecationWarning, stacklevel=2)
                options[new] = options.pop(old)
            return function(*args, **options)

        return renamed

    return decorate
