"""Lets the pages of docs/ read the same on GitHub and on the site.

Links to files of the repository become links to pages of the site, where it has them, or downloads; those to folders
lose their link. A page that says ``<!-- all of: ../CHANGELOG.md -->`` is that file.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
#: Files outside of docs/ that are pages of the site, or whose contents a page shows.
PAGES = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "benchmarks/RESULTS.md": "benchmarks.md",
    "examples": "README.md#examples",
}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
WHOLE = re.compile(r"<!-- all of: (\S+) -->")
#: Blocks and pieces of code, which hold no links.
CODE = re.compile(r"(^```.*?^```$|`[^`\n]+`)", re.DOTALL | re.MULTILINE)


def rewritten(text: str, folder: Path) -> str:
    """The text of a page with its links as the site needs them.

    Args:
        text: Markdown.
        folder: From which relative links go.
    """

    def link(found: re.Match[str]) -> str:
        picture, label, target = found.groups()
        label = rewritten(label, folder) if "](" in label else label
        if "://" in target or target.startswith("#"):
            return f"{picture}[{label}]({target})"
        path, _, anchor = target.partition("#")
        place = (folder / path).resolve()
        name = place.relative_to(ROOT).as_posix()
        if name in PAGES and not anchor:
            return f"[{label}]({PAGES[name]})"
        if not picture and (place.is_dir() or not place.exists()):
            return label
        shown = os.path.relpath(DOCS / PAGES[name].partition("#")[0] if name in PAGES else place, DOCS)
        return f"{picture}[{label}]({shown}{'#' * bool(anchor)}{anchor})"

    # A label may be code, so that what stands between two pieces of code is not yet a piece without them.
    pieces: list[str] = []

    def kept(found: re.Match[str]) -> str:
        pieces.append(found[0])
        return f"\x00{len(pieces) - 1}\x00"

    return re.sub("\x00(\\d+)\x00", lambda m: pieces[int(m[1])], LINK.sub(link, CODE.sub(kept, text)))


def read(app: Sphinx, docname: str, source: list[str]) -> None:
    """Give a page the links of the site, and the text of the file that it is."""
    if Path(app.env.doc2path(docname)).suffix != ".md":
        return
    folder, whole = DOCS, WHOLE.search(source[0])
    if whole:
        path = (DOCS / whole[1]).resolve()
        app.env.note_dependency(str(path))
        source[0], folder = path.read_text(encoding="utf-8"), path.parent
    source[0] = rewritten(source[0], folder)


def setup(app: Sphinx) -> dict[str, bool]:
    """Read pages through :func:`read`."""
    app.connect("source-read", read, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
