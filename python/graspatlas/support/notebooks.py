"""What Jupyter shows of an object: a card with a table and a picture, or a page of its own.

A notebook asks the object itself, and what draws lies on a floor above it. So the module that draws is named here, and
imported when a notebook asks for the first time.
"""

from __future__ import annotations

import html
from dataclasses import dataclass, field
from importlib import import_module

__all__ = ["Displayed", "EmbeddedPage", "explorer_of"]

#: Draws cards and pages.
DRAWN_BY = "graspatlas.viewer.notebook.cards"


class Displayed:
    """Base of classes of which notebooks show a card."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        return str(import_module(DRAWN_BY).html_of(self))


@dataclass(frozen=True)
class EmbeddedPage:
    """A page that a notebook shows where the cell that returns it has its output.

    It needs neither server nor network, and is meant for Jupyter and what shows cells as it does, as VS Code and Colab
    do; it was tried in Chromium, and in none of these. A notebook shows it once it is trusted, as after its cells were
    run; :func:`graspatlas.export_html` writes the same page to a file.

    Attributes:
        page: The text of the page.
        title: What it shows, for who does not see it.
        height: Its height in the notebook [pixels].
    """

    page: str = field(repr=False)
    title: str
    height: int

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" title="{html.escape(self.title)}" loading="lazy" '
            f'allow="clipboard-write; fullscreen" allowfullscreen '
            f'style="display: block; width: 100%; height: {self.height}px; border: 0"></iframe>'
        )


def explorer_of(result: Displayed, chart: int | None, height: int) -> EmbeddedPage:
    """The page of a result; see :meth:`graspatlas.Result.explore`."""
    page: EmbeddedPage = import_module(DRAWN_BY).explorer(result, chart, height)
    return page
