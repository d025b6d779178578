"""The command graspatlas sweep: many problems with many options."""

from __future__ import annotations

import argparse
import json
import sys

from graspatlas.commands.shared.arguments import FAILED, INTERRUPTED, Subcommands, path_word
from graspatlas.support.terminal import say

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add sweep to the subcommands of a parser."""
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
