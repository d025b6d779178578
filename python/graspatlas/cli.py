"""Command line: graspatlas list, optimize, view, check-result, reproduce."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from graspatlas import __version__
from graspatlas.atlas import Status
from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer import optimize
from graspatlas.problems import bundled_problems, load_problem
from graspatlas.quality import INDICES, quality_name
from graspatlas.requirements import REQUIREMENTS, parse_requirement
from graspatlas.result import Result, load_result, writable_folder

__all__ = ["main"]

FAILED = 1
MISUSE = 2
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: The words after ``graspatlas``; those of the process by default.

    Returns:
        Exit status: 0, 1 where no grasp meets the requirements or a check fails, 2 for wrong input, 130 when
        interrupted.
    """
    options = _parser().parse_args(arguments)
    try:
        return int(options.run(options))
    except GraspAtlasError as error:
        print(f"graspatlas: error: {error}", file=sys.stderr)
        return MISUSE
    except BrokenPipeError:  # the reader of our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("graspatlas: interrupted", file=sys.stderr)
        return INTERRUPTED


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all others."""

    def error(self, message: str) -> NoReturn:
        self.exit(MISUSE, f"graspatlas: error: {message}; see '{self.prog} --help'\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="graspatlas",
        description="Find the globally best grasp of an object by a robotic hand when the contacts are given.",
    )
    parser.add_argument("--version", action="version", version=f"graspatlas {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="list the bundled problems, the quality indices and the requirements")
    listing.set_defaults(run=_list)

    best = commands.add_parser("optimize", help="trace all relevant grasps of a problem and find the best one")
    best.add_argument("problem", help="name of a bundled problem, or path of a problem file (.json)")
    best.add_argument("--dimension", type=int, metavar="K", help="dimension k of the set of relevant grasps")
    best.add_argument(
        "--radius",
        type=float,
        metavar="R",
        help="radius of a chart [rad, or lengths / length_scale]",
    )
    best.add_argument(
        "--epsilon",
        type=float,
        metavar="E",
        help="how different neighbouring charts may be, 0 to 1",
    )
    best.add_argument("--quality", metavar="NAME", help=f"quality index: {', '.join(INDICES)}")
    best.add_argument(
        "--require",
        action="append",
        default=[],
        metavar="NAME[:VALUE...]",
        help="requirement that the best grasp must meet, such as collision_free, force_closure:0.5:0.02 (friction, "
        "margin) or joint_margin:0.05; may be given several times",
    )
    best.add_argument("--max-charts", type=int, metavar="N", help="cut the atlas short after N charts")
    best.add_argument("--max-seconds", type=float, metavar="S", help="cut the atlas short after S seconds")
    best.add_argument("--threads", type=int, metavar="N", help="threads to use, all cores by default; same result")
    best.add_argument("--output", type=Path, metavar="FOLDER", help="write result.npz and summary.json there")
    best.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    best.set_defaults(run=_optimize)

    look = commands.add_parser("view", help="show the best and the worst grasp of a result")
    look.add_argument("result", type=Path, help="folder or file that optimize wrote")
    look.add_argument("--html", type=Path, metavar="FILE", help="write a page that needs no server instead")
    look.add_argument("--picture", type=Path, metavar="FILE", help="write a PNG picture instead")
    look.add_argument("--no-browser", action="store_true", help="do not open a browser, only say where to look")
    look.set_defaults(run=_view)

    verify = commands.add_parser("check-result", help="verify a result again, from the problem that it carries")
    verify.add_argument("result", type=Path, help="folder or file that optimize wrote")
    verify.set_defaults(run=_check_result)

    again = commands.add_parser(
        "reproduce", help="run the paper's experiments and write a page to lay beside the paper"
    )
    again.add_argument(
        "--output", type=Path, required=True, metavar="FOLDER", help="write index.html and its files there"
    )
    again.add_argument("--experiment", metavar="NAME", help="only this experiment")
    again.set_defaults(run=_reproduce)
    return parser


def _list(_: argparse.Namespace) -> int:
    print("problems:")
    for name in bundled_problems():
        problem = load_problem(name)
        print(f"  {name:22} t = {problem.full_dimension}. {problem.description}")
    print("quality indices:")
    for name, index in INDICES.items():
        print(f"  {name:26} {(index.__doc__ or '').splitlines()[0]}")
    print("requirements:")
    for name, requirement in REQUIREMENTS.items():
        values = ":".join(field.name.upper() for field in fields(requirement))
        print(f"  {name}:{values}  {(requirement.__doc__ or '').splitlines()[0]}")
    return 0


def _optimize(options: argparse.Namespace) -> int:
    problem = load_problem(options.problem)
    require = [parse_requirement(text) for text in options.require]
    folder = writable_folder(options.output) if options.output else None
    result = optimize(
        problem,
        dimension=options.dimension,
        radius=options.radius,
        epsilon=options.epsilon,
        quality=options.quality,
        require=require,
        max_charts=options.max_charts,
        max_seconds=options.max_seconds,
        threads=options.threads,
        progress=True,
    )
    if folder:
        result.save(folder / "result.npz")
        _write_summary(result, folder / "summary.json")
    print(json.dumps(result.summary()) if options.json else _report(result, folder))
    if result.status is Status.INTERRUPTED:
        return INTERRUPTED
    return 0 if result.feasible.any() else FAILED


def _write_summary(result: Result, path: Path) -> None:
    try:
        path.write_text(json.dumps(result.summary(), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise GraspAtlasError(f"cannot write '{path}': {error.strerror or error}") from None


def _report(result: Result, folder: Path | None) -> str:
    summary = result.summary()
    seconds = summary["seconds"]
    closed = {reason: count for reason, count in result.atlas.closed_vertices.items() if count}
    lines = [
        f"{summary['problem']}: {summary['n_charts']} charts of dimension {summary['dimension']} in "
        f"{seconds['atlas']:.3f} s, index in {seconds['quality']:.3f} s; {summary['status']}",
        f"  largest residual {summary['max_residual']:.1e}",
    ]
    if closed:
        lines.append(f"  vertices that no step could leave: {closed}")
    if result.requirements:
        counts = ", ".join(f"{name} refused {count}" for name, count in result.refused.items())
        lines.append(f"  {result.feasible.sum()} grasps meet the requirements; asked in turn, {counts}")
    lines += _best_lines(result) if result.feasible.any() else ["  no best grasp: relax a requirement"]
    if not result.is_global:
        lines.append("  the atlas does not cover all grasps: better ones may exist")
    if folder:
        lines.append(f"  written to {folder}; look at it with: graspatlas view {folder}")
    return "\n".join(lines)


def _best_lines(result: Result) -> list[str]:
    best, name = result.best, quality_name(result.quality)
    values = f"best {best.quality:.6g}, worst {result.worst.quality:.6g}, first grasp {result.at_x1.quality:.6g}"
    pose = f"object at {_row(best.object_xyz)} m, quaternion xyzw {_row(best.object_quat_xyzw)}"
    angles = [f"    {joint:20} {value:9.4f}" for joint, value in best.joint_positions.items()]
    return [f"  {name}: {values}", f"  best grasp (chart {best.chart}): {pose}, joints [rad or m]:", *angles]


def _row(values: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in values) + ")"


def _view(options: argparse.Namespace) -> int:
    result = load_result(options.result)
    from graspatlas.viewer import export_html, save_picture, view  # slow to import

    if options.html:
        export_html(result, options.html)
        print(f"wrote {options.html}: open it in a browser", file=sys.stderr)
    if options.picture:
        save_picture(result, options.picture)
        print(f"wrote {options.picture}", file=sys.stderr)
    if not options.html and not options.picture:
        view(result, open_browser=not options.no_browser)
    return 0


def _check_result(options: argparse.Namespace) -> int:
    result = load_result(options.result)
    report = result.check()
    print(f"{result.problem.name}: {result.atlas.n_charts} charts, {result.status}")
    print(report)
    return 0 if report else FAILED


def _reproduce(options: argparse.Namespace) -> int:
    from graspatlas.reproduce import reproduce  # slow to import

    page = reproduce(options.output, options.experiment)
    print(f"wrote {page}: open it in a browser")
    return 0


if __name__ == "__main__":
    sys.exit(main())
