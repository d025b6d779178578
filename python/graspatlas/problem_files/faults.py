"""What is wrong with a problem file, in one line each: file, line, field, what came and what is allowed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.problem_files.documents import Document, Path

__all__ = ["ProblemFileError", "faults_of_validation", "field_name", "narrowed", "one_line"]

#: What pydantic tells of a fault, by its kind.
Context: TypeAlias = Mapping[str, Any]
#: What must stand where another type came.
_KINDS = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "a text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a table of names and values",
    "model_type": "a table of names and values",
    "model_attributes_type": "a table of names and values",
    "finite_number": "finite",
}
#: Fields for people, which no check is about.
_PROSE = ("name", "description", "source")
#: Longest piece of the file that a message quotes.
MOST_SHOWN = 60


class ProblemFileError(GraspAtlasError):
    """A problem file is wrong; the message is its first fault.

    Attributes:
        faults: All faults that were found, one line each.
    """

    def __init__(self, faults: list[str]) -> None:
        more = len(faults) - 1
        rest = f" (and {more} more fault{'s' if more > 1 else ''}: graspatlas check lists them)" if more > 0 else ""
        super().__init__(faults[0] + rest)
        self.faults = tuple(faults)


def field_name(path: Path) -> str:
    """A field as people write it: ``contacts[1].object.radius``."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")


def one_line(file: str, document: Document, path: Path, message: str) -> str:
    """A fault as text."""
    field = field_name(path)
    return f"{file}:{document.line(path)}: {field}{': ' if field else ''}{' '.join(message.split())}"


def faults_of_validation(file: str, document: Document, error: ValidationError) -> list[str]:
    """The faults that the schema found, in the order of the file, one for each field."""
    found: dict[Path, str] = {}
    for item in error.errors(include_url=False):
        path = _path(document.data, item["loc"], missing=item["type"] == "missing")
        if item["type"] == "unknown_field":
            path = (*path, item["ctx"]["field"])
        elif item["type"] == "union_tag_invalid":
            path = (*path, "type")
        found.setdefault(path, _message(item))
    ordered = sorted(found.items(), key=lambda fault: document.line(fault[0]))
    return [one_line(file, document, path, message) for path, message in ordered]


def _path(data: object, location: tuple[int | str, ...], *, missing: bool) -> Path:
    """The place in the file that a location of pydantic means, which also names the types that it tried."""
    path: list[int | str] = []
    for i, key in enumerate(location):
        if isinstance(data, Mapping) and key in data:
            data = data[str(key)]
        elif isinstance(data, list) and isinstance(key, int) and key < len(data):
            data = data[key]
        elif not (missing and i == len(location) - 1):
            continue
        path.append(key)
    return tuple(path)


def _message(item: ErrorDetails) -> str:
    kind, value, context = item["type"], item["input"], item.get("ctx", {})
    if kind == "missing":
        return "is missing"
    if kind in _KINDS:
        return f"must be {_KINDS[kind]}, got {shown(value)}"
    if kind in ("greater_than", "greater_than_equal", "less_than"):
        return f"must be {_bound(kind, context)}, got {shown(value)}"
    if kind in ("too_short", "too_long"):
        return _length(kind, context)
    if kind == "literal_error":
        return f"must be {context['expected']}, got {shown(value)}"
    if kind == "union_tag_not_found":
        return "has no type; give one such as 'type: point'"
    if kind == "union_tag_invalid":
        known = [name.strip(" '") for name in context["expected_tags"].split(",")]
        return str(unknown_name("patch type", context["tag"], known))
    return str(item["msg"])


def _bound(kind: str, context: Context) -> str:
    if kind == "less_than":
        return f"below {context['lt']:g}"
    if kind == "greater_than":
        return "positive" if context["gt"] == 0 else f"above {context['gt']:g}"
    return f"at least {context['ge']:g}"


def _length(kind: str, context: Context) -> str:
    wanted = context["min_length"] if kind == "too_short" else context["max_length"]
    least = "at least " if kind == "too_short" and wanted == 1 else ""
    return f"must hold {least}{wanted} item{'s' if wanted != 1 else ''}, got {context['actual_length']}"


def shown(value: object) -> str:
    """A value as a message quotes it."""
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."


def narrowed(document: Document, path: Path, message: str) -> tuple[Path, str]:
    """The field that a message of a later check is about, as far as the message tells.

    Args:
        document: The file.
        path: The field that was being read.
        message: What is wrong with it.

    Returns:
        The field within it whose name or value the message quotes or begins with, and the message without that name.
    """
    if not path:
        path = _subject(document.data, message, first_word=True)
    match = re.match(r"(?:[\w ]+ patch: )?(\w+)(?: of requirement \w+)? (must .*)", message, re.DOTALL)
    inside = list(_fields(document.at(path), path))
    for inner, key, _ in inside:
        if match and key == match[1]:
            return inner, match[2]
    for word in re.findall(r"'([^']+)'", message):
        for inner, key, value in inside:
            if word in (key, value) and inner[-1] not in _PROSE:
                return inner, message
    return path or _subject(document.data, message, first_word=False), message


def _subject(data: Mapping[str, object], message: str, *, first_word: bool) -> Path:
    """The field of the whole problem that a message begins with, or else mentions first."""
    text = message.removeprefix("the ").replace("hand motions", "hand_motions").replace("contact ", "contacts ")
    words = re.findall(r"\w+", text)[: 1 if first_word else None]
    named = [(words.index(key), key) for key in data if key in words and key not in _PROSE]
    return (min(named)[1],) if named else ()


def _fields(data: object, path: Path) -> Iterator[tuple[Path, str | int, object]]:
    """All fields below one, in the order of the file."""
    items = data.items() if isinstance(data, Mapping) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*path, key), key, value
        yield from _fields(value, (*path, key))
