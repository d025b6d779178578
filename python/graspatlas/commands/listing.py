"""What there is: graspatlas list names problems, indices and requirements, graspatlas doctor what is installed."""

from __future__ import annotations

import argparse
from dataclasses import fields

from graspatlas.commands.arguments import Subcommands
from graspatlas.problem_files.outline import read_outline
from graspatlas.problems import bundled_problems, problem_text
from graspatlas.quality.evaluation import INDICES
from graspatlas.requirements.named import REQUIREMENTS
from graspatlas.support.terminal import say

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add list and doctor to the subcommands of a parser."""
    listing = commands.add_parser("list", help="list the bundled problems, the quality indices and the requirements")
    listing.set_defaults(run=_list)

    patient = commands.add_parser("doctor", help="tell what is installed, missing or in the way, for a bug report")
    patient.add_argument("--json", action="store_true", help="print a list of JSON objects")
    patient.set_defaults(run=_doctor)


def _list(_: argparse.Namespace) -> int:
    say("problems:")
    for name in bundled_problems():
        text, _file, folder = problem_text(name)
        outline = read_outline(text, folder)
        say(f"  {name:22} t = {outline.freedoms}. {outline.description}")
    say("quality indices:")
    for name, index in INDICES.items():
        say(f"  {name:26} {(index.__doc__ or '').splitlines()[0]}")
    say("requirements:")
    for name, requirement in REQUIREMENTS.items():
        values = ":".join(field.name.upper() for field in fields(requirement))
        say(f"  {name}:{values}  {(requirement.__doc__ or '').splitlines()[0]}")
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from graspatlas import doctor  # slow to import

    findings = doctor.examine()
    say(doctor.as_json(findings) if options.json else doctor.report(findings))
    return doctor.status(findings)
