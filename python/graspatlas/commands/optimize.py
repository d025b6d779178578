"""The command graspatlas optimize: the main job, with its files and its report."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from graspatlas.analysis.climb import MAX_STEPS
from graspatlas.atlas.checkpoints import CheckpointFolder
from graspatlas.atlas.status import Status
from graspatlas.commands.shared.arguments import FAILED, INTERRUPTED, Subcommands, path_word
from graspatlas.commands.shared.report import component_lines, result_lines
from graspatlas.errors import GraspAtlasError
from graspatlas.multistart.checkpoint import RoundFolder
from graspatlas.multistart.search import SHARE
from graspatlas.optimizer.components import Components, SearchStatus, find_components
from graspatlas.optimizer.optimize import optimize
from graspatlas.problem.problem import Problem
from graspatlas.problems import load_problem
from graspatlas.quality.evaluation import INDICES
from graspatlas.requirements.named import parse_requirement
from graspatlas.result.refinement import SearchEnd
from graspatlas.result.result import Result
from graspatlas.storage.files import replaced, writable_folder
from graspatlas.support.terminal import say

if TYPE_CHECKING:
    from graspatlas.viewer.live.serve import Watch

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add optimize to the subcommands of a parser."""
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
        "margin), holding_force:2 (newtons) or joint_margin:0.05; may be given several times; replaces those of the "
        "problem, 'none' drops them",
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
        "--motions",
        choices=("relevant", "all"),
        default="relevant",
        help="with 'all' search the best of all feasible grasps, no hand motion frozen but couplings: climbs from many "
        "starts until little can be missing",
    )
    best.add_argument(
        "--share-missing",
        type=float,
        default=SHARE,
        metavar="P",
        help="such a search ends when at most this share of climbs may lead to maxima not found, 0.01 by default",
    )
    best.add_argument("--seed", type=int, default=0, metavar="N", help="seed of such a search, 0 by default")
    best.add_argument(
        "--refine-steps",
        type=int,
        default=MAX_STEPS,
        metavar="N",
        help="give such a climb up after N steps, 200 by default",
    )
    _add_limits(best)
    best.add_argument("--output", type=path_word, metavar="FOLDER", help="write result.npz and summary.json there")
    best.add_argument(
        "--watch",
        action="store_true",
        help="show in the browser how the atlas grows, and then the result as view does, until Ctrl-C",
    )
    best.add_argument("--no-browser", action="store_true", help="with --watch: do not open a browser, only say where")
    best.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    best.set_defaults(run=_optimize)


def _add_limits(best: argparse.ArgumentParser) -> None:
    """What cuts the work short, or makes more of it."""
    best.add_argument("--max-charts", type=int, metavar="N", help="cut the atlas short after N charts")
    best.add_argument("--max-seconds", type=float, metavar="S", help="cut the atlas short after S seconds")
    best.add_argument(
        "--components",
        action="store_true",
        help="search for other connected components too, and take the best grasp over all of them; --max-seconds then "
        "limits the whole search",
    )
    best.add_argument("--workers", type=int, metavar="N", help="with --motions all: processes that share the search")
    best.add_argument("--scheduler", metavar="ADDRESS", help="the same on the workers of a Dask scheduler")
    best.add_argument("--threads", type=int, metavar="N", help="threads to use, all cores by default; same result")


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
    if options.components and options.motions == "all":
        raise GraspAtlasError("a search over all motions looks into all components: leave --components out")
    if options.watch and options.components:
        raise GraspAtlasError("--watch shows one atlas: leave --components out, and look at the result with view")
    if options.components:
        if options.workers is not None or options.scheduler is not None:
            raise GraspAtlasError("components are searched in this process: leave --workers and --scheduler out")
        return _report_components(find_components(problem, **given, require=require, progress=True), options, folder)
    checkpoint = folder / "checkpoint" if folder else None
    search = {name: getattr(options, name) for name in ("motions", "share_missing", "seed", "workers", "scheduler")}
    with _watched(options, problem) as watch:
        result = optimize(problem, **given, **search, require=require, checkpoint=checkpoint, progress=True)
        status = _report(result, options, folder)
        if watch is not None:
            watch.serve(result, folder / "result.npz" if folder else None)
    return status


@contextmanager
def _watched(options: argparse.Namespace, problem: Problem) -> Iterator[Watch | None]:
    """A block whose atlas is shown while it grows, where that is asked for."""
    if not options.watch:
        yield None
        return
    from graspatlas.viewer.live.serve import watching  # slow to import

    names = options.quality or [problem.defaults.get("quality")]
    index = names[0] if isinstance(names[0], str) else None
    with watching(problem, index, open_browser=not options.no_browser) as watch:
        yield watch


def _report(result: Result, options: argparse.Namespace, folder: Path | None) -> int:
    """Write and print a result; the exit status."""
    if folder:
        result.save(folder / "result.npz")
        _write_json(result.summary(), folder / "summary.json")
        if result.status in (Status.COMPLETE, Status.BLOCKED):
            if result.refinement is None or result.refinement.complete:
                RoundFolder.remove(folder / "checkpoint" / "rounds")
            CheckpointFolder.remove(folder / "checkpoint")
    say(json.dumps(result.summary()) if options.json else "\n".join(result_lines(result, folder)))
    search_ended = result.refinement.search.status if result.refinement and result.refinement.search else None
    if result.status is Status.INTERRUPTED or search_ended is SearchEnd.INTERRUPTED:
        return INTERRUPTED
    return 0 if result.accepted.any() or result.refinement else FAILED


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
        say(*component_lines(found))
        say(*result_lines(best, folder))
    if found.status is SearchStatus.INTERRUPTED:
        return INTERRUPTED
    return 0 if best.accepted.any() else FAILED


def _write_json(table: Mapping[str, object], path: Path) -> None:
    with replaced(path) as stream:
        stream.write((json.dumps(table, indent=2) + "\n").encode("utf-8"))
