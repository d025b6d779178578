"""The commands about problem files: graspatlas new, check, schema and pads."""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from graspatlas.commands.diagnosis import OK, PROBLEM, Finding, diagnose, report, with_first_grasp_for
from graspatlas.commands.shared.arguments import Subcommands, path_word
from graspatlas.errors import GraspAtlasError
from graspatlas.problem.problem import Problem
from graspatlas.problems import bundled_problems, load_problem, problem_text
from graspatlas.storage.files import replaced
from graspatlas.support.terminal import printable, say

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add new, check, schema and pads to the subcommands of a parser."""
    new = commands.add_parser("new", help="write a commented problem file for a hand, to be filled in")
    new.add_argument(
        "hand",
        help="URDF or MJCF of the hand; or example_robot_data:NAME, robot_descriptions:NAME, or a name among these",
    )
    new.add_argument("--root", metavar="BODY", help="body of an MJCF that is the palm")
    new.add_argument("--object", metavar="FILE", help="URDF or mesh of the object")
    new.add_argument("--output", type=path_word, metavar="FILE", help="file to write; standard output by default")
    new.set_defaults(run=_new)

    check = commands.add_parser("check", help="look at all that decides whether an atlas of a problem can be traced")
    check.add_argument("problem", help="path of a problem file, or name of a bundled problem")
    check.add_argument("--dimension", type=int, metavar="K", help="dimension k to look at")
    check.add_argument("--radius", type=float, metavar="R", help="radius of a chart to look at")
    check.add_argument(
        "--write-x1", action="store_true", help="write the first grasp that is found into the file, which states none"
    )
    check.add_argument("--picture", type=path_word, metavar="FILE", help="draw patches, contacts and normals as PNG")
    check.add_argument("--json", action="store_true", help="print the findings as JSON")
    check.set_defaults(run=_check)

    schema = commands.add_parser("schema", help="write the JSON Schema of problem files, for editors")
    schema.add_argument("--output", type=path_word, metavar="FILE", help="file to write; standard output by default")
    schema.set_defaults(run=_schema)

    pads = commands.add_parser("pads", help="find where the fingertips of a hand touch, as contacts to paste")
    pads.add_argument(
        "hand",
        help="URDF or MJCF of the hand; or example_robot_data:NAME, robot_descriptions:NAME, or a name among these",
    )
    pads.add_argument("--link", action="append", metavar="NAME", help="link to look at, not the fingertips; repeatable")
    pads.add_argument("--root", metavar="BODY", help="body of an MJCF that is the palm")
    pads.add_argument("--output", type=path_word, metavar="FILE", help="YAML to write; standard output by default")
    pads.add_argument("--picture", type=path_word, metavar="FILE", help="draw the hand with its pads as PNG")
    pads.set_defaults(run=_pads)


def _new(options: argparse.Namespace) -> int:
    from graspatlas.problem_files.template import problem_template  # slow to import

    folder = options.output.parent if options.output else Path()
    text = problem_template(options.hand, options.object, folder=folder, root=options.root)
    _write(text, options.output, keep=True)
    return 0


def _check(options: argparse.Namespace) -> int:
    from graspatlas.problem_files import ProblemFileError  # slow to import

    written: list[Finding] = []
    try:
        problem = load_problem(options.problem)
        if options.write_x1:
            problem, written = _with_x1_written(problem, options.problem, options.dimension)
        findings = [*diagnose(problem, dimension=options.dimension, radius=options.radius), *written]
        if options.picture:
            from graspatlas.viewer import save_problem_picture  # slow to import

            save_problem_picture(problem, options.picture)
    except ProblemFileError as error:
        hint = "every field is explained in docs/problem_files.md"
        findings = [Finding(PROBLEM, "problem file", fault, hint) for fault in error.faults]
    say(json.dumps([finding.to_dict() for finding in findings]) if options.json else report(findings))
    return int(any(finding.mark == PROBLEM for finding in findings))


def _with_x1_written(problem: Problem, file: str, dimension: int | None) -> tuple[Problem, list[Finding]]:
    """The problem with a first grasp that is found, which is written into its file too."""
    from graspatlas.problem_files.first_grasp_in_file import with_x1  # slow to import

    if file in bundled_problems():
        raise GraspAtlasError(f"'{file}' is a bundled problem, whose file is not written to; copy it")
    text, _, _ = problem_text(file)
    if problem.x1 is not None:
        raise GraspAtlasError(f"'{file}' states an x1 already: remove it to have another one written")
    found = with_first_grasp_for(problem, dimension)
    if found.x1 is None:  # it has one, or the search has raised
        raise GraspAtlasError(f"no first grasp of '{file}' was found")
    with replaced(Path(file)) as stream:
        stream.write(with_x1(text, found.x1).encode("utf-8"))
    return found, [Finding(OK, "x1", f"written into {file}", "what is said above is of it")]


def _schema(options: argparse.Namespace) -> int:
    from graspatlas.problem_files import json_schema  # slow to import

    _write(json.dumps(json_schema(), indent=2) + "\n", options.output, keep=False)
    return 0


def _pads(options: argparse.Namespace) -> int:
    from graspatlas.hand.named_hands import named_hand  # slow to import
    from graspatlas.pads.find import find_pads
    from graspatlas.pads.text import pads_text

    hand = named_hand(options.hand, options.root).hand
    pads = find_pads(hand, options.link)
    _write(pads_text(pads, f"Pads of {printable(hand.name)}"), options.output, keep=False)
    if options.picture:
        from graspatlas.viewer import save_pads_picture  # slow to import

        save_pads_picture(hand, pads, options.picture)
    return 0


def _write(text: str, path: Path | None, *, keep: bool) -> None:
    """Write to a file, or to standard output; with `keep`, a file that exists is not overwritten."""
    if path is None:
        say(text, end="")
        return
    if keep and os.path.lexists(path):
        raise GraspAtlasError(f"'{path}' exists; choose another name or remove it")
    with replaced(path) as stream:
        stream.write(text.encode("utf-8"))
