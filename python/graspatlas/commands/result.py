"""The commands about a result: graspatlas view, export and check-result."""

from __future__ import annotations

import argparse
import json
import sys

from graspatlas.commands.shared.arguments import FAILED, Subcommands, chart_named, path_word
from graspatlas.errors import GraspAtlasError
from graspatlas.execution.pregrasp import DISTANCE
from graspatlas.formats.export import FORMATS, export_grasps
from graspatlas.result.result import load_result
from graspatlas.storage.columns import FRAME_ENDINGS, save_frame
from graspatlas.storage.files import is_folder
from graspatlas.support.terminal import say
from graspatlas.support.validation import PlainTable

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add view, export and check-result to the subcommands of a parser."""
    look = commands.add_parser(
        "view", help="look at a result and work on it: its whole atlas beside the hand, in the browser"
    )
    look.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    look.add_argument(
        "--html", type=path_word, metavar="FILE", help="write this page, which then needs no server and has no buttons"
    )
    look.add_argument(
        "--chart",
        metavar="CHART",
        help="open the page at this grasp, or show it beside the best: a chart's number, first, best, worst or nearest",
    )
    look.add_argument(
        "--alone",
        action="store_true",
        help="with --meshcat or --picture: without the worst beside the best, or the best beside a chart",
    )
    look.add_argument("--picture", type=path_word, metavar="FILE", help="write a PNG picture instead")
    look.add_argument(
        "--meshcat", action="store_true", help="show the best grasp and another in meshcat, without the atlas, instead"
    )
    look.add_argument("--no-browser", action="store_true", help="do not open a browser, only say where to look")
    look.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="serve on this address, such as 0.0.0.0 for all who reach this machine; this machine alone by default",
    )
    look.set_defaults(run=_view)

    out = commands.add_parser("export", help="write grasps of a result for other programs, or its charts as a table")
    out.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    out.add_argument(
        "--grasps", type=path_word, metavar="FILE", help="write joints, poses and contacts (.json or .csv)"
    )
    out.add_argument("--format", metavar="NAME", help=f"write grasps with pregrasp and squeeze: {', '.join(FORMATS)}")
    out.add_argument("--to", type=path_word, metavar="PATH", help="where to: a file, or of dexgraspbench a folder")
    out.add_argument("--best", type=int, metavar="N", help="only the N best grasps that meet the requirements")
    out.add_argument("--chart", nargs="+", metavar="CHART", help="only these: numbers of charts, first, best or worst")
    out.add_argument(
        "--accepted", "--feasible", action="store_true", help="only grasps that meet the result's requirements"
    )
    out.add_argument("--refined", action="store_true", help="put the refined best before the others")
    out.add_argument(
        "--pregrasp",
        type=float,
        metavar="M",
        help="add the hand's posture before each grasp, all contact points this far off the object [m], such as 0.01",
    )
    out.add_argument("--table", type=path_word, metavar="FILE", help="write the table of charts (.csv or .parquet)")
    out.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    out.set_defaults(run=_export)

    verify = commands.add_parser("check-result", help="verify a result again, from the problem that it carries")
    verify.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    verify.set_defaults(run=_check_result)


def _view(options: argparse.Namespace) -> int:
    if options.alone and not (options.meshcat or options.picture):
        raise GraspAtlasError("--alone is for --meshcat and --picture; the page shows the grasps that you pin")
    result = load_result(options.result)
    chart = None if options.chart is None else chart_named(result, options.chart)
    from graspatlas.viewer import export_html, save_picture, view  # slow to import

    if options.html:
        export_html(result, options.html, chart=chart)
        say(f"wrote {options.html}: open it in a browser", file=sys.stderr)
    if options.picture:
        save_picture(result, options.picture, chart=chart, worst=not options.alone)
        say(f"wrote {options.picture}", file=sys.stderr)
    if options.html or options.picture:
        return 0
    shown = {"open_browser": not options.no_browser, "host": options.host, "chart": chart}
    if options.meshcat:
        view(result, worst=not options.alone, **shown)
    else:
        from graspatlas.viewer.live.serve import serve  # slow to import

        serve(result, options.result / "result.npz" if is_folder(options.result) else options.result, **shown)
    return 0


def _export(options: argparse.Namespace) -> int:
    if not options.grasps and not options.table and not options.format:
        raise GraspAtlasError("nothing to write: give --grasps FILE, --table FILE, or --format NAME --to PATH")
    if bool(options.format) != bool(options.to):
        raise GraspAtlasError("--format NAME says how to write and --to PATH where: give both")
    if options.pregrasp is not None and not options.grasps and not options.format:
        raise GraspAtlasError("--pregrasp is for grasps: give --grasps FILE, or --format NAME --to PATH too")
    if options.table and options.table.suffix not in FRAME_ENDINGS:
        raise GraspAtlasError(f"table '{options.table}' must end in {' or '.join(FRAME_ENDINGS)}")
    result = load_result(options.result)
    wanted = options.best is not None or options.accepted
    if wanted and not result.accepted.any() and result.refinement is None:
        say(f"{result.problem.name}: no grasp meets the requirements, nothing was written", file=sys.stderr)
        return FAILED
    summary: PlainTable = {"problem": result.problem.name, "n_charts": result.atlas.n_charts}
    charts = options.chart and [chart_named(result, name) for name in options.chart]
    if options.grasps:
        chosen = {name: getattr(options, name) for name in ("best", "accepted", "refined", "pregrasp")}
        count = result.save_grasps(options.grasps, charts=charts, **chosen)
        summary |= {"n_grasps": count, "grasps": str(options.grasps)}
    if options.format:
        chosen = {"charts": charts, "best": options.best, "refined": options.refined}
        distance = DISTANCE if options.pregrasp is None else options.pregrasp
        handed = export_grasps(result, options.to, options.format, distance=distance, **chosen)
        summary |= {"format": options.format, "n_handed_over": handed, "to": str(options.to)}
    if options.table:
        save_frame(result.to_pandas(), options.table)
        summary["table"] = str(options.table)
    if options.json:
        say(json.dumps(summary))
        return 0
    if options.grasps:
        say(f"{result.problem.name}: {count} of {result.atlas.n_charts} grasps written to {options.grasps}")
    if options.format:
        say(f"{result.problem.name}: {handed} grasps written to {options.to} as {options.format}")
    if options.table:
        say(f"{result.problem.name}: {result.atlas.n_charts} charts written to {options.table}")
    return 0


def _check_result(options: argparse.Namespace) -> int:
    result = load_result(options.result)
    report = result.check()
    say(f"{result.problem.name}: {result.atlas.n_charts} charts, {result.status}")
    say(report)
    return 0 if report else FAILED
