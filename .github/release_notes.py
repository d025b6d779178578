"""The changes of a version, from CHANGELOG.md: what a release says. `python .github/release_notes.py 0.2.0`."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def notes(version: str) -> str:
    """The section of a version.

    Raises:
        SystemExit: If the files name another version, or the section is missing or empty.
    """
    stated = {
        "pyproject.toml": r'^version = "(.*)"$',
        "python/graspatlas/version.py": r'^__version__ = "(.*)"$',
        "CITATION.cff": r"^version: (.*)$",
    }
    for name, pattern in stated.items():
        found = re.findall(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
        if found != [version]:
            raise SystemExit(f"{name} states version {', '.join(found)}, not {version}: make them one")
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    section = re.search(rf"^## \[{re.escape(version)}\][^\n]*\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    if section is None or not section[1].strip():
        raise SystemExit(f"CHANGELOG.md says nothing of version {version}: add '## [{version}]'")
    return section[1].strip()


if __name__ == "__main__":
    print(notes(sys.argv[1]))
