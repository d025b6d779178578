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
    """Make the pictures of the gallery links to their pages."""
    if docname == "gallery" and app.builder.format == "html":
        source[0] = PICTURE.sub(rf'<a href="{FOLDER}/\2.html">\g<0></a>', source[0])


def write_pages(app: Sphinx, exception: Exception | None) -> None:
    """Solve the bundled problems and write the page of each; what is there already stays."""
    if exception or app.builder.format != "html":
        return
    folder = Path(app.outdir) / FOLDER
    folder.mkdir(exist_ok=True)
    for name in ga.bundled_problems():
        page = folder / f"{name}.html"
        if not page.exists():
            result = ga.optimize(ga.load_problem(name), refine=True, max_charts=MOST_CHARTS)
            ga.export_html(result, page)


def setup(app: Sphinx) -> dict[str, bool]:
    """Link the pictures, and write the pages at the end."""
    app.connect("source-read", link_pictures, priority=500)
    app.connect("build-finished", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
