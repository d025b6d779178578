"""YAML as plain data, with the line of every field."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import yaml

from graspatlas.support.validation import Plain, PlainTable

__all__ = ["Document", "DocumentError", "Path", "parse"]

#: Keys and list positions that lead to a field.
Path = tuple[str | int, ...]

#: A file with more fields than this, aliases counted as often as they stand, is refused.
MOST_FIELDS = 1_000_000
#: Tables and lists may stand within one another this often; those of a problem do so less than ten times.
MOST_LEVELS = 50
#: Longest whole number [digits]: larger ones are no numbers for a computer's arithmetic.
MOST_DIGITS = 300
_CORE = "tag:yaml.org,2002:"
_WORDS = {"true": True, "false": False}


class DocumentError(Exception):
    """What is wrong with a text as YAML, and its line, counted from 1."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class Document:
    """A file's content.

    Attributes:
        data: Tables, lists, texts, numbers, booleans and None.
        lines: Line of each field, counted from 1; the empty path is the whole document.
    """

    data: Any
    lines: dict[Path, int]

    def at(self, path: Path) -> Any:
        """The content of a field."""
        data = self.data
        for key in path:
            data = data[key]
        return data

    def line(self, path: Path) -> int:
        """Line of a field, or of the nearest table or list that would hold it."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)


class _Composer(yaml.composer.Composer, yaml.resolver.Resolver):
    """Recognises the numbers, booleans and nulls of YAML 1.2 and of JSON, and nothing else.

    YAML 1.1, which PyYAML reads, takes 1e-3 for a text, and a joint called y for true.
    """

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012
    _levels = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Read a node, which may hold others, but not without end."""
        self._levels += 1
        if self._levels > MOST_LEVELS:
            line = self.peek_event().start_mark.line + 1  # type: ignore[attr-defined]  # of the loader
            raise DocumentError(line, f"has more than {MOST_LEVELS} tables or lists within one another")
        node: yaml.Node | None = super().compose_node(parent, index)
        self._levels -= 1
        return node


for _tag, _pattern, _first in (
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("int", r"[-+]?[0-9]+", "-+0123456789"),
    (
        "float",
        r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?(?:\.inf|\.Inf|\.INF|Infinity)|\.nan|\.NaN|NaN",
        "-+.0123456789IN",
    ),
):
    _Composer.add_implicit_resolver(_CORE + _tag, re.compile(f"^(?:{_pattern})$"), list(_first))


class _Loader(_Composer, yaml.SafeLoader):
    """Reads with PyYAML's own parser, which says best what is wrong."""


_Fastest: type[Any] = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


class _FastLoader(_Composer, _Fastest):  # type: ignore[misc]  # whose base is chosen at run time
    """Reads with the parser of libyaml, ten times as fast, where PyYAML was built with it."""

    def __init__(self, stream: str) -> None:
        yaml.composer.Composer.__init__(self)
        _Fastest.__init__(self, stream)


def parse(text: str) -> Document:
    """Read a YAML text; JSON is YAML too. No tag is followed and no code is run.

    Raises:
        DocumentError: If it is not YAML, a key stands twice, or it holds anything but plain data.
    """
    try:
        try:
            node = yaml.compose(text, _FastLoader)
        except yaml.YAMLError:
            node = yaml.compose(text, _Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = " ".join(part for part in (error.context, error.problem) if part)
        raise DocumentError(mark.line + 1 if mark else 1, f"is not YAML: {reason}") from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise DocumentError(line, f"is not YAML: it holds the character {error.character!r}") from None
    if node is None:
        raise DocumentError(1, "is empty; a problem file is YAML with the fields hand, object and contacts")
    reader = _Reader()
    return Document(reader.read(node, ()), reader.lines)


class _Reader:
    """Makes plain data of YAML nodes and notes the lines."""

    def __init__(self) -> None:
        self.lines: dict[Path, int] = {}
        self._open: list[yaml.Node] = []

    def read(self, node: yaml.Node, path: Path, line: int | None = None) -> Plain:
        self.lines[path] = node.start_mark.line + 1 if line is None else line
        if len(self.lines) > MOST_FIELDS:
            raise DocumentError(self.lines[path], f"has more than {MOST_FIELDS} fields")
        if any(node is outer for outer in self._open):
            raise DocumentError(self.lines[path], "an alias (*) stands within its own anchor (&)")
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, self.lines[path])
        if node.tag not in (_CORE + "map", _CORE + "seq"):
            raise DocumentError(self.lines[path], f"the tag {node.tag} is not allowed: use plain tables and lists")
        self._open.append(node)
        data = self._table(node, path) if isinstance(node, yaml.MappingNode) else self._list(node, path)
        self._open.pop()
        return data

    def _table(self, node: yaml.MappingNode, path: Path) -> PlainTable:
        table: PlainTable = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, yaml.ScalarNode):
                raise DocumentError(line, "a name of a field must be a text")
            key = _text(key_node.value, line)
            place = (*path, key)
            if key in table:
                raise DocumentError(line, f"the field '{key}' stands twice, first on line {self.lines[place]}")
            table[key] = self.read(value_node, place, line)
        return table

    def _list(self, node: yaml.Node, path: Path) -> list[Plain]:
        return [self.read(item, (*path, i)) for i, item in enumerate(node.value)]

    @staticmethod
    def _scalar(node: yaml.ScalarNode, line: int) -> Plain:
        kind, value = node.tag.removeprefix(_CORE), node.value
        if kind == "str":
            return _text(value, line)
        if kind == "null":
            return None
        if kind == "int" and len(value) > MOST_DIGITS:
            raise DocumentError(line, f"a whole number of {len(value)} digits is too large; at most {MOST_DIGITS}")
        try:
            if kind == "bool":
                return _WORDS[value.lower()]
            if kind == "int":
                return int(value)
            if kind == "float":
                return float(re.sub(r"\.(?=[inIN])", "", value))
        except (KeyError, ValueError):
            raise DocumentError(line, f"the tag {node.tag} does not fit {value!r:.60}; leave it out") from None
        raise DocumentError(line, f"the tag {node.tag} is not allowed: write plain numbers and texts")


def _text(value: str, line: int) -> str:
    """A text that can be written to a file again; an escape may name half of a letter."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        raise DocumentError(line, f"{value!r:.60} holds an escape that is not a character; correct it") from None
    return value
