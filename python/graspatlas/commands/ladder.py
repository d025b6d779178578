"""The command graspatlas ladder: what each further hand motion is worth."""

from __future__ import annotations

import argparse
import json
import sys

from graspatlas.analysis.climb import MAX_STEPS
from graspatlas.commands.shared.arguments import FAILED, INTERRUPTED, Subcommands, path_word
from graspatlas.errors import GraspAtlasError
from graspatlas.optimizer.ladder import CHARTS, MAX_SECONDS, ladder
from graspatlas.optimizer.ladder_outcome import Ladder, LadderStatus
from graspatlas.problems import load_problem
from graspatlas.quality.evaluation import INDICES
from graspatlas.requirements.named import parse_requirement
from graspatlas.storage.files import replaced, writable_folder
from graspatlas.support.terminal import say

__all__ = ["add_commands"]

PICTURES = (".png", ".pdf", ".svg")


def add_commands(commands: Subcommands) -> None:
    """Add ladder to the subcommands of a parser."""
    steps = commands.add_parser("ladder", help="find the best grasp for k = 2, 3, ...: what each hand motion is worth")
    steps.add_argument("problem", help="name of a bundled problem, or path of a problem file (YAML)")
    steps.add_argument("--dimension", type=int, nargs="+", metavar="K", help="the rungs; all from 2 on by default")
    steps.add_argument(
        "--radius",
        nargs="+",
        metavar="R",
        help="radius of the lowest rung, or of some as K:R, such as 2:0.17 3:0.5; the others are chosen by --charts",
    )
    steps.add_argument("--epsilon", type=float, metavar="E", help="how different neighbouring charts may be, 0 to 1")
    steps.add_argument("--quality", metavar="NAME", help=f"quality index: {', '.join(INDICES)}")
    steps.add_argument(
        "--require",
        action="append",
        default=[],
        metavar="NAME[:VALUE...]",
        help="requirement as optimize takes it; may be given several times; 'none' drops those of the problem",
    )
    steps.add_argument("--refine", action="store_true", help="climb to the maxima between the charts' centres")
    steps.add_argument("--refine-steps", type=int, default=MAX_STEPS, metavar="N", help="give a climb up after N steps")
    steps.add_argument("--charts", type=int, default=CHARTS, metavar="N", help="about how many charts a rung has")
    steps.add_argument(
        "--max-charts", type=int, metavar="N", help="cut a rung short after N charts, four times --charts"
    )
    steps.add_argument(
        "--max-seconds", type=float, default=MAX_SECONDS, metavar="S", help="time for all rungs, 60 s by default"
    )
    steps.add_argument("--threads", type=int, metavar="N", help="threads to use, all cores by default; same result")
    steps.add_argument("--csv", type=path_word, metavar="FILE", help="write the table")
    steps.add_argument("--picture", type=path_word, metavar="FILE", help="write a figure (.png, .pdf or .svg)")
    steps.add_argument(
        "--output",
        type=path_word,
        metavar="FOLDER",
        help="write ladder.json, and the result of each rung as 2.npz, ...",
    )
    steps.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    steps.set_defaults(run=_ladder)


def _ladder(options: argparse.Namespace) -> int:
    if options.picture and options.picture.suffix not in PICTURES:
        raise GraspAtlasError(f"picture '{options.picture}' must end in one of {', '.join(PICTURES)}")
    problem = load_problem(options.problem)
    require = [parse_requirement(text) for text in options.require if text != "none"] if options.require else None
    if options.output:
        writable_folder(options.output)
    limits = {"max_charts": options.max_charts} if options.max_charts is not None else {}
    found = ladder(
        problem,
        dimensions=options.dimension,
        radius=_radii(options.radius),
        require=require,
        progress=True,
        **{name: getattr(options, name) for name in ("epsilon", "quality", "refine", "refine_steps", "charts")},
        **{name: getattr(options, name) for name in ("max_seconds", "threads")},
        **limits,
    )
    _write(found, options)
    say(json.dumps(found.summary()) if options.json else f"{problem.name}: {found.quality}\n{found}")
    if found.status is LadderStatus.INTERRUPTED:
        return INTERRUPTED
    return 0 if any(rung.value is not None for rung in found.rungs) else FAILED


def _write(found: Ladder, options: argparse.Namespace) -> None:
    """The files that were asked for."""
    if options.csv:
        found.save_csv(options.csv)
        say(f"wrote {options.csv}", file=sys.stderr)
    if options.picture:
        from graspatlas.viewer.figures import plot_ladder  # slow to import

        with replaced(options.picture) as stream:
            plot_ladder(found).savefig(stream, format=options.picture.suffix[1:])
        say(f"wrote {options.picture}", file=sys.stderr)
    if options.output:
        for rung in found.rungs:
            rung.result.save(options.output / f"{rung.dimension}.npz")
        with replaced(options.output / "ladder.json") as stream:
            stream.write((json.dumps(found.summary(), indent=2) + "\n").encode("utf-8"))
        say(f"wrote {options.output}", file=sys.stderr)


def _radii(words: list[str] | None) -> float | dict[int, float] | None:
    """Radii that words state: one number, or K:R for some rungs.

    Raises:
        GraspAtlasError: If a word is neither.
    """
    if words is None:
        return None
    try:
        if len(words) == 1 and ":" not in words[0]:
            return float(words[0])
        return {int(k): float(r) for k, r in (word.split(":") for word in words)}
    except ValueError:
        raise GraspAtlasError(
            f"--radius takes one number, or K:R for some rungs such as 2:0.17 3:0.5; got '{' '.join(words)}'"
        ) from None
