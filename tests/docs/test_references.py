"""docs/references.md lists every publication that the code follows, and no other that it names."""

from __future__ import annotations

import re
import unicodedata

from helpers import ROOT

PAGE = (ROOT / "docs" / "references.md").read_text(encoding="utf-8")
#: The last part of a docstring, or a comment, that says where something comes from.
SOURCE = re.compile(r"Source: (.*?)(?:\"\"\"|\n\s*(?:/// *)?\n|\nclass )", re.DOTALL)
#: A title in quotes after the name of an author.
TITLE = re.compile(r'[A-Z]\. [^".;]*, "([^"]+)"')


def plain(text: str) -> str:
    """Letters in lower case without accents, one blank between words."""
    letters = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return " ".join(re.sub(r"[^a-z0-9]", " ", letters.lower()).split())


def followed() -> set[str]:
    """Titles that docstrings and headers name as their source."""
    files = [*(ROOT / "python").rglob("*.py"), *(ROOT / "cpp").rglob("*.hpp")]
    texts = [re.sub(r"\n *(?:///)? +", " ", s) for f in files for s in SOURCE.findall(f.read_text(encoding="utf-8"))]
    return {plain(title) for text in texts for title in TITLE.findall(text)}


def test_every_source_is_listed() -> None:
    titles = followed()
    assert len(titles) > 15
    listed = plain(PAGE)
    assert sorted(title for title in titles if title not in listed) == []


def test_entries_have_authors_title_and_year() -> None:
    entries = re.findall(r"^- (.*?)(?=\n- |\n\n)", PAGE, re.DOTALL | re.MULTILINE)
    assert len(entries) > 25
    for entry in entries:
        assert re.match(r"[A-Z][\w.\-]*\.? .*?, \*[^*]+\*.*\b(19|20)\d\d\b", " ".join(entry.split())), entry
