"""Runs the code of a page of the documentation, and compares what it prints with what the page says.

A page is run from top to bottom in an empty folder. Comments before a block say what it is:

    <!-- needs: examples/own_hand/three_fingers.urdf -->   a file of the repository that lies in the folder
    <!-- saved as: jar.yaml -->                            the block is that file
    <!-- goes into: jar.yaml -->                           its fields replace those of that file
    <!-- excerpt of: three_fingers.urdf -->                its lines stand in that file
    <!-- exit status: 1 -->                                of the command that the block holds
    <!-- not run: it opens a browser -->                   and why
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from helpers import ROOT

from graspatlas.cli import main
from graspatlas.patches import patch_from_dict
from graspatlas.problem_files import documents, read_problem

DOCS = ROOT / "docs"
BLOCK = re.compile(r"(?:<!-- ([\w ]+): ([^\n]*) -->\n)?```(\w*)\n(.*?)```\n", re.DOTALL)
#: Contents of the site, which are neither code nor output.
CONTENTS = re.compile(r"```\{toctree\}\n.*?```\n", re.DOTALL)
NEEDS = re.compile(r"<!-- needs: (\S+) -->")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#([^)]*))?\)")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)")
#: How far a number that a page shows may be from the one that is printed: atlases differ a little between machines.
CLOSE = 0.2
#: Numbers as small as this are rounding.
ROUNDING = 1e-5


def read(page: str) -> str:
    """The text of a page in docs/, or of ../README.md."""
    return (DOCS / page).read_text(encoding="utf-8")


@dataclass
class Block:
    """A block of a page, and what the comment before it says."""

    word: str
    value: str
    language: str
    text: str
    line: int


def blocks_of(page: str) -> list[Block]:
    text = CONTENTS.sub(lambda contents: "\n" * contents[0].count("\n"), read(page))
    return [
        Block(m[1] or "", m[2] or "", m[3], m[4], text.count("\n", 0, m.start(3)) + 1) for m in BLOCK.finditer(text)
    ]


class Run:
    """A page while it is run in the current folder."""

    def __init__(self, page: str) -> None:
        self.page, self.names, self.printed = page, {"__name__": page}, ""
        for path in NEEDS.findall(read(page)):
            shutil.copy(ROOT / path, Path(path).name)

    def run(self, block: Block) -> None:
        if block.word == "not run":
            assert block.value
            self.printed = ""
            return
        assert block.word in ("", "needs", "saved as", "goes into", "excerpt of", "exit status"), block.word
        if block.word == "excerpt of":
            assert lines_of(block.text) in lines_of(Path(block.value).read_text(encoding="utf-8"))
            return
        if block.word == "saved as":
            Path(block.value).write_text(block.text, encoding="utf-8")
        commands = not block.language and block.text.startswith("graspatlas ")
        kind = getattr(self, f"_{'sh' if commands else block.language or 'output'}", None)
        if kind is not None:
            kind(block)
        else:
            assert block.word == "saved as", f"a block of '{block.language}' is neither run nor saved"

    def _python(self, block: Block) -> None:
        with contextlib.redirect_stdout(io.StringIO()) as out:
            # Empty lines first, so that a traceback has the line of the page.
            exec(compile("\n" * block.line + block.text, str(DOCS / self.page), "exec"), self.names)
        self.printed = out.getvalue()

    def _sh(self, block: Block) -> None:
        expected = int(block.value) if block.word == "exit status" else 0
        with contextlib.redirect_stdout(io.StringIO()) as out:
            for line in block.text.replace("\\\n", " ").splitlines():
                program, *words = shlex.split(line, comments=True)
                assert program == "graspatlas", line
                if words[0] == "view" and not {"--html", "--picture"} & {*words}:
                    continue  # it opens a browser, and serves it until Ctrl-C
                assert main(words) == expected, line
        self.printed = out.getvalue()

    def _yaml(self, block: Block) -> None:
        """A problem file, or fields of one."""
        if block.word == "goes into":
            whole = documents.parse(Path(block.value).read_text(encoding="utf-8")).data
            whole |= documents.parse(block.text).data
            Path(block.value).write_text(json.dumps(whole), encoding="utf-8")
            read_problem(json.dumps(whole), block.value, Path())
        else:
            read_problem(block.text, block.value or self.page, Path())

    def _json(self, block: Block) -> None:
        for table in json.loads(block.text):
            patch_from_dict(table)

    def _output(self, block: Block) -> None:
        """What the block before printed; lines of ... stand for any others."""
        printed = self.printed
        for part in re.split(r"^ *\.\.\.\n", block.text, flags=re.MULTILINE):
            if part.strip():
                printed = after(part, printed)


def lines_of(text: str) -> str:
    return "\n".join(line.strip() for line in text.strip().splitlines())


def after(part: str, printed: str) -> str:
    """What is printed after some lines, which must be printed; blanks do not matter, numbers hardly."""
    wanted, lines = lines_of(part).split("\n"), lines_of(printed).split("\n")
    for start in range(len(lines) - len(wanted) + 1):
        if all(map(alike, wanted, lines[start : start + len(wanted)])):
            return "\n".join(lines[start + len(wanted) :])
    raise AssertionError(f"not printed:\n{part}\nbut:\n{printed}")


def alike(wanted: str, line: str) -> bool:
    if " ".join(NUMBER.sub("#", wanted).split()) != " ".join(NUMBER.sub("#", line).split()):
        return False
    for said, got in zip(NUMBER.finditer(wanted), NUMBER.finditer(line), strict=True):
        a, b = float(said[0]), float(got[0])
        varies = wanted[said.end() :].startswith((" s", " %"))  # times, and gains over the best chart
        if not varies and abs(a) > ROUNDING and b != pytest.approx(a, rel=CLOSE, abs=0.01):
            return False
    return True
