"""The command graspatlas reproduce: the experiments of the paper on a page."""

from __future__ import annotations

import argparse

from graspatlas.commands.shared.arguments import Subcommands, path_word
from graspatlas.support.terminal import say

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add reproduce to the subcommands of a parser."""
    again = commands.add_parser("reproduce", help="run the paper's experiments and write a page to compare with it")
    again.add_argument(
        "--output", type=path_word, required=True, metavar="FOLDER", help="write index.html and its files there"
    )
    again.add_argument("--experiment", metavar="NAME", help="only this experiment")
    again.set_defaults(run=_reproduce)


def _reproduce(options: argparse.Namespace) -> int:
    from graspatlas.reproduce import reproduce  # slow to import

    page = reproduce(options.output, options.experiment)
    say(f"wrote {page}: open it in a browser")
    return 0
