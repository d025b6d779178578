"""Opens the pictures of the gallery as pages of the whole atlas, made when the site is built."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx

import graspatlas as ga

PICTURE = re.compile(r"!\[([^\]]*)\]\(images/gallery_(\w+)\.png\)")
FOLDER = "explore"
#: An atlas with more charts is not drawn: the site is built in a minute or two.
MOST_CHARTS = 7000


def link_pictures(app: Sphinx, docname: str, source: list[str]) -> None:
    """Make the pictures of the gallery links to those pages that are written."""

    def link(found: re.Match[str]) -> str:
        return f'<a href="{FOLDER}/{found[2]}.html">{found[0]}</a>' if found[2] in shown(app) else found[0]

    if docname == "gallery" and app.builder.format == "html":
        source[0] = PICTURE.sub(link, source[0])


def shown(app: Sphinx) -> list[str]:
    """Problems that get a page."""
    return app.config.explorer_problems or ga.bundled_problems()


def write_pages(app: Sphinx, exception: Exception | None) -> None:
    """Solve the problems of ``explorer_problems``, or all bundled ones, and write their pages; what is there stays."""
    if exception or app.builder.format != "html":
        return
    folder = Path(app.outdir) / FOLDER
    folder.mkdir(exist_ok=True)
    for name in shown(app):
        page = folder / f"{name}.html"
        if not page.exists():
            result = ga.optimize(ga.load_problem(name), refine=True, max_charts=MOST_CHARTS)
            ga.export_html(result, page)


def setup(app: Sphinx) -> dict[str, bool]:
    """Link the pictures, and write the pages at the end."""
    app.add_config_value("explorer_problems", [], "env")
    app.connect("source-read", link_pictures, priority=500)
    app.connect("build-finished", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
