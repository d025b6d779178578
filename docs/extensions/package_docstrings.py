"""Reads the docstrings of the package as they are written.

What a function returns is prose here, not a type before a colon: the signature has the type. Names in docstrings and
types lead to where a reader finds them: ``Grasp.pregrasp``, and a class by the name under which the package offers it.
"""

from __future__ import annotations

import ast
import inspect
import re
from importlib import import_module
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError
from sphinx.ext.napoleon import GoogleDocstring
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.inspect import TypeAliasForwardRef
from sphinx.util.nodes import make_refnode

FIELD = re.compile(r":(ivar|param) (\w+(?:, \w+)+):(.*)")


def returned(self: GoogleDocstring, preprocess_types: bool = False) -> list[tuple[str, str, list[str]]]:
    """The section of what is returned, none of it a type."""
    return [("", "", self._dedent(self._consume_to_next_section()))]


def described(self: GoogleDocstring) -> list[str]:
    """The docstring of an attribute or property: prose, and sections as those of a method."""
    lines = self._dedent(self._consume_to_end())
    return GoogleDocstring(lines, self._config, None, "method", self._name, self._obj).lines()


def without_factories(
    app: Sphinx, what: str, name: str, obj: object, options: object, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """The signature with ``...`` where a default is made anew each time, which is no Python."""
    return signature and signature.replace("<factory>", "..."), returns


def best_match(target: str, objects: dict[str, Any]) -> str | None:
    """The documented object that a name means: the same last parts, the shortest full name; None if there is none."""
    parts = target.split(".")
    for count in (2, 1) if len(parts) > 1 else (1,):
        # The last part alone names a class or a function of a module, and no member of another class.
        last = ".".join(parts[-count:])
        found = sorted((n for n, o in objects.items() if f".{n}".endswith(f".{last}")), key=len)
        if count == 1:
            found = [n for n in found if objects[n].objtype in ("class", "function", "exception", "data")]
            found = found if len(parts) == 1 or parts[-2].islower() else []
        if found:
            return found[0]
    return None


def find(app: Sphinx, env: BuildEnvironment, node: pending_xref, text: nodes.TextElement) -> nodes.reference | None:
    """The place to which a name of the package leads that Sphinx does not find by itself."""
    if node.get("refdomain") != "py":
        return None
    target = str(node["reftarget"])
    objects = env.domains.python_domain.objects
    name = best_match(target, objects)
    if name is None or not (target.startswith("graspatlas.") or target.count(".") <= 1):
        return None
    entry = objects[name]
    return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, text, name)


def one_field(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Keep several names that are described together one field: Sphinx takes what is before a blank for a type."""
    for number, line in enumerate(lines):
        lines[number] = FIELD.sub(lambda found: f":{found[1]} {found[2].replace(', ', ',')}:{found[3]}", line)


def source_of(module: str, name: str) -> str:
    """The module that defines a name, followed through the imports of the modules that offer it."""
    for node in ast.parse(inspect.getsource(import_module(module))).body:
        if isinstance(node, ast.ImportFrom) and node.module and name in (alias.name for alias in node.names):
            return source_of(node.module, name)
    return module


def commented(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Describe a constant by the comment ``#:`` above its definition, wherever that is.

    Raises:
        ExtensionError: There is no such comment.
    """
    if what != "data":
        return
    module, _, last = name.rpartition(".")
    home = source_of(module, last)
    comment = ModuleAnalyzer.for_module(home).find_attr_docs().get(("", last))
    if comment is None:
        raise ExtensionError(f"{last} has no comment '#:' above it in {home}, which the reference would show")
    lines[:] = comment


def setup(app: Sphinx) -> dict[str, bool]:
    """Read docstrings as prose, print types by their short names, and find names."""
    TypeAliasForwardRef.__repr__ = lambda self: str(self.name)  # type: ignore[method-assign]
    GoogleDocstring._consume_returns_section = returned  # type: ignore[method-assign]
    GoogleDocstring._parse_attribute_docstring = described  # type: ignore[method-assign]
    app.connect("autodoc-process-docstring", one_field, priority=600)  # after napoleon
    app.connect("autodoc-process-docstring", commented)
    app.connect("autodoc-process-signature", without_factories)
    app.connect("missing-reference", find)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
