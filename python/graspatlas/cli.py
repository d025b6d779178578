"""Command line: the commands of graspatlas."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from graspatlas.analysis.climb import MAX_STEPS
from graspatlas.atlas.checkpoints import CheckpointFolder
from graspatlas.atlas.status import Status
from graspatlas.commands.arguments import path_word
from graspatlas.commands.exit_status import FAILED, INTERRUPTED, MISUSE
from graspatlas.commands.problem import add_problem_commands
from graspatlas.commands.result import add_result_commands
from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.components import Components, SearchStatus, find_components
from graspatlas.optimizer.optimize import optimize
from graspatlas.problems import bundled_problems, load_problem
from graspatlas.quality.evaluation import INDICES, quality_name
from graspatlas.requirements.screening import REQUIREMENTS, parse_requirement
from graspatlas.result.refinement import Refinement
from graspatlas.result.result import Result
from graspatlas.start_up import hear_interrupts
from graspatlas.support.files import replaced, writable_folder
from graspatlas.support.interrupts import stoppable, stopped_by
from graspatlas.support.terminal import finish_output, printable, say, shortened, silence_output
from graspatlas.version import __version__

__all__ = ["main"]

#: Requests to end, besides Ctrl-C: of a cluster whose time is up, and of a terminal that is closed.
_REQUESTS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: The words after ``graspatlas``; those of the process by default.

    Returns:
        Exit status: 0, 1 where no grasp meets the requirements or a check fails, 2 for wrong input, 130 when
        interrupted, 143 when terminated: a request to terminate keeps what there is, as Ctrl-C does.
    """
    hear_interrupts()
    try:
        with stoppable(also=_REQUESTS):
            status = _run(arguments)
            finish_output()
            return 128 + stopped_by() if status == INTERRUPTED and stopped_by() else status
    except GraspAtlasError as error:
        return _misuse(error)
    except BrokenPipeError:  # the reader of our output has seen enough
        silence_output()
        return 0
    except KeyboardInterrupt as error:
        say("graspatlas: interrupted", file=sys.stderr)
        return 128 + int(getattr(error, "signal", signal.SIGINT))


def _run(arguments: Sequence[str] | None) -> int:
    """Run a command; its exit status."""
    try:
        options = _parser().parse_args(arguments)
        return int(options.run(options))
    except SystemExit:  # help is printed, or a word is wrong
        finish_output()
        raise
    except MemoryError:
        return _misuse("there is not enough memory for this; choose a larger radius or a smaller input")
    except RecursionError:
        return _misuse("the input is nested too deeply to be one; correct it")
    except BrokenPipeError:
        raise
    except OSError as error:
        place = f" '{error.filename}'" if error.filename else ""
        return _misuse(f"{error.strerror or error}{place}; make sure that it can be read and written")


def _misuse(reason: object) -> int:
    say(shortened(" ".join(f"graspatlas: error: {reason}".split("\n"))), file=sys.stderr)
    return MISUSE


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all others."""

    def _print_message(self, message: str, file: Any = None) -> None:
        """Help and version; argparse keeps quiet where they cannot be written."""
        say(message, file=None if file is sys.stdout else file, end="")

    def error(self, message: str) -> NoReturn:
        line = shortened(printable(f"graspatlas: error: {message}; see '{self.prog} --help'"))
        self.exit(MISUSE, line + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="graspatlas",
        description="Find the globally best grasp of an object by a robotic hand when the contacts are given.",
    )
    parser.add_argument("--version", action="version", version=f"graspatlas {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="list the bundled problems, the quality indices and the requirements")
    listing.set_defaults(run=_list)

    add_problem_commands(commands)

    best = commands.add_parser("optimize", help="trace all relevant grasps of a problem and find the best one")
    best.add_argument("problem", help="name of a bundled problem, or path of a problem file (YAML)")
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
    best.add_argument(
        "--quality",
        action="append",
        metavar="NAME",
        help=f"quality index; may be given several times, the first chooses the best: {', '.join(INDICES)}",
    )
    best.add_argument(
        "--require",
        action="append",
        default=[],
        metavar="NAME[:VALUE...]",
        help="requirement that the best grasp must meet, such as collision_free, force_closure:0.5:0.02 (friction, "
        "margin) or joint_margin:0.05; may be given several times; replaces those of the problem, 'none' drops them",
    )
    best.add_argument(
        "--refine",
        nargs="?",
        const="relevant",
        choices=("relevant", "feasible"),
        default=False,
        metavar="WHERE",
        help="climb to the maximum between the charts' centres: among the relevant grasps, or with 'feasible' on among "
        "all feasible ones, no hand motion frozen but couplings",
    )
    best.add_argument(
        "--refine-steps",
        type=int,
        default=MAX_STEPS,
        metavar="N",
        help="give such a climb up after N steps, 200 by default",
    )
    best.add_argument("--max-charts", type=int, metavar="N", help="cut the atlas short after N charts")
    best.add_argument("--max-seconds", type=float, metavar="S", help="cut the atlas short after S seconds")
    best.add_argument(
        "--components",
        action="store_true",
        help="search for other connected components too, and take the best grasp over all of them; --max-seconds then "
        "limits the whole search",
    )
    best.add_argument("--threads", type=int, metavar="N", help="threads to use, all cores by default; same result")
    best.add_argument("--output", type=path_word, metavar="FOLDER", help="write result.npz and summary.json there")
    best.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    best.set_defaults(run=_optimize)

    add_result_commands(commands)
    _add_sweep(commands)

    again = commands.add_parser(
        "reproduce", help="run the paper's experiments and write a page to lay beside the paper"
    )
    again.add_argument(
        "--output", type=path_word, required=True, metavar="FOLDER", help="write index.html and its files there"
    )
    again.add_argument("--experiment", metavar="NAME", help="only this experiment")
    again.set_defaults(run=_reproduce)
    return parser


def _add_sweep(commands: Any) -> None:
    many = commands.add_parser("sweep", help="run many problems with many options, on all cores or a cluster")
    many.add_argument("problems", nargs="+", metavar="PROBLEM", help="names of bundled problems, or problem files")
    many.add_argument(
        "--output", type=path_word, required=True, metavar="FOLDER", help="keep the rows in runs.parquet there"
    )
    many.add_argument("--dimension", type=int, nargs="+", default=[], metavar="K", help="dimensions k to try")
    many.add_argument("--radius", type=float, nargs="+", default=[], metavar="R", help="radii of a chart to try")
    many.add_argument("--epsilon", type=float, nargs="+", default=[], metavar="E", help="values of epsilon to try")
    many.add_argument("--quality", nargs="+", default=[], metavar="NAME", help="quality indices to try")
    many.add_argument("--require", action="append", default=[], metavar="NAME[:VALUE...]", help="as for optimize")
    many.add_argument("--refine", action="store_true", help="climb to the maximum between the charts' centres")
    many.add_argument("--max-charts", type=int, metavar="N", help="cut every atlas short after N charts")
    many.add_argument("--max-seconds", type=float, metavar="S", help="cut every atlas short after S seconds")
    many.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler; the cores of this machine else")
    many.add_argument("--workers", type=int, metavar="N", help="processes on this machine; one a core else")
    many.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    many.set_defaults(run=_sweep)


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


def _optimize(options: argparse.Namespace) -> int:
    problem = load_problem(options.problem)
    require = [parse_requirement(text) for text in options.require if text != "none"] if options.require else None
    folder = writable_folder(options.output) if options.output else None
    names = (
        "dimension",
        "radius",
        "epsilon",
        "quality",
        "refine",
        "refine_steps",
        "max_charts",
        "max_seconds",
        "threads",
    )
    given = {name: getattr(options, name) for name in names}
    if options.components:
        return _report_components(find_components(problem, **given, require=require, progress=True), options, folder)
    checkpoint = folder / "checkpoint" if folder else None
    result = optimize(problem, **given, require=require, checkpoint=checkpoint, progress=True)
    if folder:
        result.save(folder / "result.npz")
        _write_json(result.summary(), folder / "summary.json")
        if result.status in (Status.COMPLETE, Status.BLOCKED):
            CheckpointFolder.remove(folder / "checkpoint")
    say(json.dumps(result.summary()) if options.json else _report(result, folder))
    if result.status is Status.INTERRUPTED:
        return INTERRUPTED
    return 0 if result.accepted.any() else FAILED


def _report_components(found: Components, options: argparse.Namespace, folder: Path | None) -> int:
    """Write and print the components; the exit status."""
    best = found.best_result
    if folder:
        best.save(folder / "result.npz")
        _write_json(best.summary(), folder / "summary.json")
        _write_json(found.summary(), folder / "components.json")
        others = writable_folder(folder / "components")
        for number, result in enumerate(found.results[1:], start=2):
            result.save(others / f"{number}.npz")
    if options.json:
        say(json.dumps(found.summary()))
    else:
        say(*_component_lines(found))
        say(_report(best, folder))
    if found.status is SearchStatus.INTERRUPTED:
        return INTERRUPTED
    return 0 if best.accepted.any() else FAILED


def _component_lines(found: Components) -> list[str]:
    lines = [
        f"{len(found)} components from {found.found} grasps found in {found.tries} tries, {found.seconds:.1f} s; the "
        f"last {found.covered} lie in these: others get at most {found.share_not_found():.1%} of the finds, with 95 % "
        "confidence"
    ]
    for number, (result, hits) in enumerate(zip(found.results, found.hits, strict=True), start=1):
        quality = f"best {result.best.quality:.6g}" if result.accepted.any() else "no grasp meets the requirements"
        lines.append(
            f"  component {number}: {result.atlas.n_charts} charts, hit {hits} times, {quality}; {result.status}"
        )
    if found.status is not SearchStatus.COVERED:
        lines.append(f"  search cut short ({found.status}): other components may exist")
    return lines


def _write_json(table: dict[str, Any], path: Path) -> None:
    with replaced(path) as stream:
        stream.write((json.dumps(table, indent=2) + "\n").encode("utf-8"))


def _report(result: Result, folder: Path | None) -> str:
    summary = result.summary()
    seconds = summary["seconds"]
    closed = {reason: count for reason, count in result.atlas.closed_vertices.items() if count}
    audit = result.atlas.audit
    lines = [
        f"{summary['problem']}: {summary['n_charts']} charts of dimension {summary['dimension']} in "
        f"{seconds['atlas']:.3f} s, index in {seconds['quality']:.3f} s; {summary['status']}",
        f"  largest residual {summary['max_residual']:.1e}",
    ]
    if closed:
        lines.append(f"  vertices that no step could leave: {closed}")
    if result.atlas.complete:
        lines.append(
            f"  audited at {audit.points} points of random walks, all covered: at most {audit.share_missing():.2g} of "
            f"such points are missing, with 95 % confidence"
        )
    if result.requirements:
        counts = ", ".join(f"{name} rejected {count}" for name, count in result.rejected.items())
        lines.append(f"  {result.accepted.sum()} grasps meet the requirements; checked in this order, {counts}")
    lines += _best_lines(result) if result.accepted.any() else ["  no best grasp: relax a requirement"]
    if result.refinement:
        lines += _refined_lines(result)
    lines += [f"  better grasps may exist: {doubt}" for doubt in result.atlas.doubts]
    if folder and result.status not in (Status.COMPLETE, Status.BLOCKED):
        lines.append("  run the same command again, with a higher limit if there was one, and it goes on from here")
    if folder:
        lines.append(f"  written to {folder}; look at it with: graspatlas view {folder}")
    return "\n".join(lines)


def _best_lines(result: Result) -> list[str]:
    best, name = result.best, quality_name(result.quality)
    values = f"best {best.quality:.6g}, worst {result.worst.quality:.6g}, first grasp {result.at_x1.quality:.6g}"
    pose = f"object at {_row(best.object_xyz)} m, quaternion xyzw {_row(best.object_quat_xyzw)}"
    angles = [f"    {joint:20} {value:9.4f}" for joint, value in best.joint_positions.items()]
    others = [f"  {name}: {values[best.chart]:.6g} at the best grasp" for name, values in result.others.items()]
    return [f"  {name}: {values}", *others, f"  best grasp (chart {best.chart}): {pose}, joints [rad or m]:", *angles]


def _refined_lines(result: Result) -> list[str]:
    refinement, best = result.refinement, result.refined_best
    assert refinement is not None
    where = "all feasible grasps" if refinement.all_motions else "the relevant grasps"
    if refinement.unbounded[0]:
        lines = _runaway_lines(refinement, where)
    else:
        peaks = f"{refinement.n_peaks} local maxima" if refinement.n_peaks > 1 else "one local maximum"
        what = f"the highest of {peaks}" if refinement.converged[0] else "not yet a maximum"
        lines = [
            f"  refined best {best.quality:.9g} ({100.0 * result.gain:+.3g} %), {what} among {where}:",
            f"    object at {_row(best.object_xyz)} m, quaternion xyzw {_row(best.object_quat_xyzw)}, "
            "joints [rad or m]:",
            *(f"    {joint:20} {value:9.4f}" for joint, value in best.joint_positions.items()),
        ]
    if refinement.advice:
        lines.append(f"    {refinement.advice}")
    if not refinement.complete:
        lines.append("    interrupted: local maxima may be missing")
    return lines


def _runaway_lines(refinement: Refinement, where: str) -> list[str]:
    """An index without a maximum, and the highest maximum that it has elsewhere."""
    n, runs = refinement.n_peaks, int(refinement.unbounded.sum())
    lines = [
        f"  no refined best among {where}: the index grows without bound at {runs} of the {n} places where climbs "
        f"ended, {refinement.qualities[0]:.3g} when they were stopped"
    ]
    if refinement.converged.any():
        lines.append(f"    the highest of the others: {refinement.qualities[refinement.converged][0]:.9g}")
    return lines


def _row(values: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in values) + ")"


def _sweep(options: argparse.Namespace) -> int:
    from graspatlas.sweep.sweep import run_sweep  # slow to import

    sweep = run_sweep(
        options.problems,
        options.output,
        dimensions=options.dimension,
        radii=options.radius,
        epsilons=options.epsilon,
        qualities=options.quality,
        require=options.require,
        refine=options.refine,
        max_charts=options.max_charts,
        max_seconds=options.max_seconds,
        scheduler=options.scheduler,
        workers=options.workers,
        progress=True,
    )
    if options.json:
        counts = {"runs": len(sweep.rows), "skipped": sweep.skipped, "failed": len(sweep.failed)}
        say(json.dumps({**counts, "missing": sweep.missing, "rows": str(sweep.path), "best": sweep.best()}))
    else:
        say(f"{len(sweep.rows)} runs in {sweep.path}: {sweep.skipped} from before, {len(sweep.failed)} failed")
        for row in sweep.failed:
            say(f"  {row['file']}: {row['error']}")
        for name, row in sweep.best().items():
            options_of = ", ".join(f"{key} {row[key]:g}" for key in ("dimension", "radius", "epsilon"))
            say(f"  best {name}: {row['quality_best']:.9g}, {row['problem']} with {options_of}; {row['status']}")
    if sweep.missing:
        say(f"interrupted: {sweep.missing} runs are left; start the sweep again to go on", file=sys.stderr)
        return INTERRUPTED
    return FAILED if sweep.failed else 0


def _reproduce(options: argparse.Namespace) -> int:
    from graspatlas.reproduce import reproduce  # slow to import

    page = reproduce(options.output, options.experiment)
    say(f"wrote {page}: open it in a browser")
    return 0


if __name__ == "__main__":
    sys.exit(main())
