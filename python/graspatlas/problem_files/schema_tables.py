"""Tables of the schema that are generated from dataclasses: patches and requirements."""

from __future__ import annotations

import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model, model_validator
from pydantic_core import PydanticCustomError

from graspatlas.errors import unknown_name

__all__ = ["Finite", "Table", "exactly_one", "known_name", "list_like", "table_of"]

#: A number that is not infinite.
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Table(BaseModel):
    """Base of all tables: no conversions, and a field that is not known is an error that names the nearest one."""

    model_config = ConfigDict(extra="forbid", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _known_fields(cls, data: object) -> object:
        for name in data if isinstance(data, Mapping) else ():
            if name not in cls.model_fields:
                message = str(unknown_name("field", name, cls.model_fields))
                raise PydanticCustomError("unknown_field", "{message}", {"message": message, "field": name})
        return data


def exactly_one(table: Table, names: Iterable[str], what: str) -> None:
    """Raise unless a table has one, and only one, of some fields."""
    given = [name for name in names if getattr(table, name) is not None]
    if len(given) != 1:
        raise PydanticCustomError(
            "exactly_one",
            "{what} needs exactly one of {names}, got {given}",
            {"what": what, "names": ", ".join(names), "given": " and ".join(given) or "none"},
        )


def known_name(kind: str, names: Callable[[], Iterable[str]]) -> BeforeValidator:
    """A check that a text is one of some names, with the nearest one in the message."""

    def check(value: object) -> object:
        known = list(names())
        if isinstance(value, str) and value not in known:
            raise PydanticCustomError("unknown_name", "{message}", {"message": str(unknown_name(kind, value, known))})
        return value

    return BeforeValidator(check)


def list_like(annotation: object, patch: object = None) -> object:
    """The type of a dataclass's attribute as a file states it: lists for tuples.

    Args:
        annotation: The attribute's type.
        patch: What stands for a patch within a patch.
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is tuple and len(arguments) == 2 and arguments[1] is ...:
        return types.GenericAlias(list, list_like(arguments[0], patch))
    if origin is tuple:
        n = len(arguments)
        items = types.GenericAlias(list, list_like(arguments[0], patch))
        return Annotated[items, Field(min_length=n, max_length=n)]
    if origin in (Union, types.UnionType):
        return Union[tuple(list_like(one, patch) for one in arguments)]  # noqa: UP007
    if annotation in (float, int, str, bool, type(None)) or origin is Literal:
        return annotation
    return patch or Any


def table_of(cls: type, *, patch: object = None, **more: object) -> type[Table]:
    """A table with the attributes of a dataclass.

    Args:
        cls: The dataclass.
        patch: What stands for a patch within a patch.
        **more: Further fields, as (type, default).
    """
    hints = get_type_hints(cls)
    attributes: dict[str, Any] = dict(more)
    docs = _attribute_docs(cls)
    for item in fields(cls):
        required = item.default is MISSING and item.default_factory is MISSING
        default = ... if required else None if item.default is MISSING else _plain(item.default)
        attributes[item.name] = (
            list_like(hints[item.name], patch),
            Field(default, description=docs.get(item.name)),
        )
    name = f"{cls.__name__}Table"
    return create_model(name, __base__=Table, __doc__=(cls.__doc__ or "").partition("\n")[0], **attributes)


def _plain(default: object) -> object:
    """A default as JSON can state it: an infinite interval is none."""
    if isinstance(default, tuple):
        plain = [_plain(item) for item in default]
        return None if any(item in (float("inf"), float("-inf")) for item in plain) else plain
    return default


def _attribute_docs(cls: type) -> dict[str, str]:
    """Descriptions of attributes from the Attributes section of a docstring, those of base classes included."""
    docs: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        section = (base.__doc__ or "").partition("Attributes:\n")[2]
        names: list[str] = []
        for line in section.splitlines():
            text, indent = line.strip(), len(line) - len(line.lstrip())
            if not text:
                break
            if indent == 8 and ": " in text:
                names = text.partition(": ")[0].split(", ")
                docs |= dict.fromkeys(names, text.partition(": ")[2])
            else:
                docs |= {name: f"{docs[name]} {text}" for name in names}
    return docs
