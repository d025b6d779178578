"""The command graspatlas list: bundled problems, quality indices and requirements."""

from __future__ import annotations

import argparse
from dataclasses import fields

from graspatlas.commands.arguments import Subcommands
from graspatlas.problem.requirement import REQUIREMENTS
from graspatlas.problems import bundled_problems, load_problem
from graspatlas.quality.evaluation import INDICES
from graspatlas.support.terminal import say

__all__ = ["add_list_command"]


def add_list_command(commands: Subcommands) -> None:
    """Add list to the subcommands of a parser."""
    listing = commands.add_parser("list", help="list the bundled problems, the quality indices and the requirements")
    listing.set_defaults(run=_list)


def _list(_: argparse.Namespace) -> int:
    say("problems:")
    for name in bundled_problems():
        problem = load_problem(name)
        say(f"  {name:22} t = {problem.full_dimension}. {problem.description}")
    say("quality indices:")
    for name, index in INDICES.items():
        say(f"  {name:26} {(index.__doc__ or '').splitlines()[0]}")
    say("requirements:")
    for name, requirement in REQUIREMENTS.items():
        values = ":".join(field.name.upper() for field in fields(requirement))
        say(f"  {name}:{values}  {(requirement.__doc__ or '').splitlines()[0]}")
    return 0
