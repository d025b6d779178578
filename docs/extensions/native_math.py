"""Formulas as MathML, which browsers draw by themselves: neither the network nor JavaScript is needed."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx

#: An accented letter with its index below it: letter, index, accent.
ACCENTED = re.compile(r"<munderover>\s*(<mi>.*?</mi>)\s*(<m\w+>.*?</m\w+>)\s*(<mo[^>]*>[ˆ˙¯~]</mo>)\s*</munderover>")


def mathml(formula: str, block: bool) -> str:
    """A formula as MathML; one that cannot be read stops the build.

    Docutils sets the index of an accented letter below the letter; it belongs beside it.
    """
    text = tex2mathml(formula, as_block=block)
    return ACCENTED.sub(r"<msub><mover>\1\3</mover>\2</msub>", text)


def visit_inline(translator: Any, node: nodes.math) -> None:
    """Write a formula within a line."""
    translator.body.append(mathml(node.astext(), block=False))
    raise nodes.SkipNode


def visit_block(translator: Any, node: nodes.math_block) -> None:
    """Write a formula that stands by itself."""
    translator.body.append(f'<div class="math">{mathml(node.astext(), block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Offer the renderer to Sphinx."""
    app.add_html_math_renderer("native", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
