"""The commands about results: graspatlas view, export, pareto, densify, path and check-result."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from graspatlas.analysis.densify import Samples, densify
from graspatlas.analysis.pareto import knee, pareto_front, values_of
from graspatlas.commands.arguments import path_word
from graspatlas.commands.exit_status import FAILED, INTERRUPTED
from graspatlas.errors import GraspAtlasError
from graspatlas.paths.path import GraspPath
from graspatlas.paths.shortest_path import shortest_path
from graspatlas.paths.time_parametrization import speed_limits
from graspatlas.quality.evaluation import quality_name
from graspatlas.result.result import Result, load_result
from graspatlas.support.columns import FRAME_ENDINGS, save_frame
from graspatlas.support.files import replaced, writable_folder
from graspatlas.support.terminal import say
from graspatlas.support.validation import shown

__all__ = ["add_result_commands"]

#: Number of a chart [digits].
LONGEST_NUMBER = 18


def add_result_commands(commands: Any) -> None:
    """Add view, export, pareto, densify, path and check-result to the subcommands of a parser."""
    look = commands.add_parser("view", help="show the best and the worst grasp of a result")
    look.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    look.add_argument("--html", type=path_word, metavar="FILE", help="write a page that needs no server instead")
    look.add_argument("--picture", type=path_word, metavar="FILE", help="write a PNG picture instead")
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
    out.add_argument("--best", type=int, metavar="N", help="only the N best grasps that meet the requirements")
    out.add_argument("--chart", nargs="+", metavar="CHART", help="only these: numbers of charts, first, best or worst")
    out.add_argument(
        "--accepted", "--feasible", action="store_true", help="only grasps that meet the result's requirements"
    )
    out.add_argument("--refined", action="store_true", help="put the refined best before the others")
    out.add_argument("--table", type=path_word, metavar="FILE", help="write the table of charts (.csv or .parquet)")
    out.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    out.set_defaults(run=_export)

    front = commands.add_parser("pareto", help="list the grasps that no other beats in two indices")
    front.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    front.add_argument("first", metavar="FIRST", help="quality index, the best by which comes first")
    front.add_argument("second", metavar="SECOND", help="another quality index")
    front.add_argument("--picture", type=path_word, metavar="FILE", help="write a figure (.png, .pdf or .svg)")
    front.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    front.set_defaults(run=_pareto)

    denser = commands.add_parser("densify", help="read the index between the charts' centres, and write samples.npz")
    denser.add_argument(
        "result", type=path_word, help="folder or file that optimize wrote; samples.npz is written beside"
    )
    denser.add_argument("spacing", type=float, metavar="SPACING", help="distance of samples, in the unit of the radius")
    denser.add_argument(
        "--share", type=float, default=1.0, metavar="F", help="only the charts where the index jumps most"
    )
    denser.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    denser.set_defaults(run=_densify)

    way = commands.add_parser("path", help="find the shortest path between two grasps of a result that never lets go")
    way.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    where = "number of a chart, or first, best or worst"
    way.add_argument("--from", dest="start", default="first", metavar="CHART", help=f"{where}; first by default")
    way.add_argument("--to", dest="end", default="best", metavar="CHART", help=f"{where}; best by default")
    way.add_argument(
        "--accepted", "--feasible", action="store_true", help="only through grasps that meet the result's requirements"
    )
    way.add_argument("--csv", type=path_word, metavar="FILE", help="write a table: joints, pose of the object, quality")
    speed = "add times to the table: no joint faster than S [rad/s or m/s], or than the URDF's limits with 'urdf'"
    way.add_argument("--joint-speed", metavar="S", help=speed)
    way.add_argument("--html", type=path_word, metavar="FILE", help="write a page with a slider that needs no server")
    way.add_argument("--picture", type=path_word, metavar="FILE", help="write a PNG picture of six grasps on the way")
    way.set_defaults(run=_path)

    verify = commands.add_parser("check-result", help="verify a result again, from the problem that it carries")
    verify.add_argument("result", type=path_word, help="folder or file that optimize wrote")
    verify.set_defaults(run=_check_result)


def _view(options: argparse.Namespace) -> int:
    result = load_result(options.result)
    from graspatlas.viewer import export_html, save_picture, view  # slow to import

    if options.html:
        export_html(result, options.html)
        say(f"wrote {options.html}: open it in a browser", file=sys.stderr)
    if options.picture:
        save_picture(result, options.picture)
        say(f"wrote {options.picture}", file=sys.stderr)
    if not options.html and not options.picture:
        view(result, open_browser=not options.no_browser, host=options.host)
    return 0


def _export(options: argparse.Namespace) -> int:
    if not options.grasps and not options.table:
        raise GraspAtlasError("nothing to write: give --grasps FILE or --table FILE")
    if options.table and options.table.suffix not in FRAME_ENDINGS:
        raise GraspAtlasError(f"table '{options.table}' must end in {' or '.join(FRAME_ENDINGS)}")
    result = load_result(options.result)
    if (options.best is not None or options.accepted) and not result.accepted.any():
        say(f"{result.problem.name}: no grasp meets the requirements, nothing was written", file=sys.stderr)
        return FAILED
    summary: dict[str, Any] = {"problem": result.problem.name, "n_charts": result.atlas.n_charts}
    if options.grasps:
        charts = options.chart and [_chart(result, name) for name in options.chart]
        chosen = {name: getattr(options, name) for name in ("best", "accepted", "refined")}
        count = result.save_grasps(options.grasps, charts=charts, **chosen)
        summary |= {"n_grasps": count, "grasps": str(options.grasps)}
    if options.table:
        save_frame(result.to_pandas(), options.table)
        summary["table"] = str(options.table)
    if options.json:
        say(json.dumps(summary))
        return 0
    if options.grasps:
        say(f"{result.problem.name}: {count} of {result.atlas.n_charts} grasps written to {options.grasps}")
    if options.table:
        say(f"{result.problem.name}: {result.atlas.n_charts} charts written to {options.table}")
    return 0


def _pareto(options: argparse.Namespace) -> int:
    kinds = (".png", ".pdf", ".svg")
    if options.picture and options.picture.suffix not in kinds:
        raise GraspAtlasError(f"picture '{options.picture}' must end in one of {', '.join(kinds)}")
    result = load_result(options.result)
    names = (options.first, options.second)
    front = pareto_front(result, *names)
    values = values_of(result, *names)[front]
    at = knee(values)
    if options.picture:
        from graspatlas.viewer.figures import plot_pareto  # slow to import

        with replaced(options.picture) as stream:
            plot_pareto(result, *names).savefig(stream, format=options.picture.suffix[1:])
        say(f"wrote {options.picture}", file=sys.stderr)
    if options.json:
        rows = [{"chart": int(c), "values": v.tolist()} for c, v in zip(front, values, strict=True)]
        say(json.dumps({"indices": names, "front": rows, "knee": None if at is None else int(front[at])}))
        return 0
    say(f"{result.problem.name}: {len(front)} of {int(result.accepted.sum())} grasps are on the Pareto front")
    say(f"  {'chart':>8} {names[0]:>26} {names[1]:>26}")
    for row, (chart, pair) in enumerate(zip(front, values, strict=True)):
        say(f"  {chart:8} {pair[0]:26.6g} {pair[1]:26.6g}{'  knee' if row == at else ''}")
    return 0


def _densify(options: argparse.Namespace) -> int:
    result = load_result(options.result)
    folder = writable_folder(options.result if options.result.is_dir() else options.result.parent)
    samples = densify(result, options.spacing, share=options.share, progress=True)
    with replaced(folder / "samples.npz") as stream:
        np.savez_compressed(stream, **samples.to_arrays())
    best = samples.best if samples.accepted.any() else None
    if options.json:
        summary = {
            "n_samples": len(samples),
            "n_accepted": int(samples.accepted.sum()),
            "not_converged": samples.not_converged,
            "outside": samples.outside,
            "complete": samples.complete,
            "best": best and {"quality": best.quality, "chart": best.chart, "x": best.x.tolist()},
            "best_chart": result.best.quality if result.accepted.any() else None,
        }
        say(json.dumps(summary))
    else:
        say(*_sample_lines(result, samples, folder))
    if not samples.complete:
        return INTERRUPTED
    return 0 if best else FAILED


def _sample_lines(result: Result, samples: Samples, folder: Path) -> list[str]:
    lines = [
        f"{result.problem.name}: {len(samples)} samples in {len(np.unique(samples.charts))} charts"
        + ("" if samples.complete else "; interrupted"),
        f"  {samples.outside} were outside the bounds, {samples.not_converged} did not reach the manifold",
    ]
    if result.requirements:
        lines.append(f"  {samples.accepted.sum()} meet the requirements")
    if samples.accepted.any():
        best = samples.best
        lines.append(f"  {quality_name(result.quality)}: best sample {best.quality:.9g} (chart {best.chart})")
    else:
        lines.append("  no best sample: relax a requirement, or fill a larger share")
    if result.accepted.any():
        lines.append(f"  best centre of a chart {result.best.quality:.9g}")
    return [*lines, f"  written to {folder / 'samples.npz'}"]


def _path(options: argparse.Namespace) -> int:
    speed = _joint_speed(options.joint_speed)
    if speed is not None and not options.csv:
        raise GraspAtlasError("--joint-speed is for the table: give --csv FILE too")
    result = load_result(options.result)
    if speed is not None:
        speed_limits(result.problem.hand, speed)
    start, end = (_chart(result, name) for name in (options.start, options.end))
    path = shortest_path(result, start, end, accepted=options.accepted, progress=True)
    say(
        f"{result.problem.name}: path of length {path.length:.6g} from chart {start} to chart {end}, {len(path)} points"
    )
    if not path.tight:
        say("  cut short: a shorter one may exist nearby")
    say(f"  largest residual {path.residuals.max():.1e}")
    if path.knows_quality:
        lowest = int(path.qualities.argmin())
        say(f"  {quality_name(result.quality)}: smallest {path.qualities[lowest]:.6g}, at point {lowest}")
    if result.requirements and path.knows_requirements:
        say(f"  {path.accepted.sum()} of {len(path)} points meet the requirements")
    from graspatlas.viewer import export_html, save_picture

    def save_csv(path: GraspPath, file: Path) -> None:
        path.save_csv(file, joint_speed=speed)

    writers = ((options.csv, save_csv), (options.html, export_html), (options.picture, save_picture))
    for file, write in writers:
        if file:
            write(path, file)
            say(f"wrote {file}", file=sys.stderr)
    return 0


def _joint_speed(text: str | None) -> float | str | None:
    """The speed that a word states; what is neither a number nor 'urdf' is refused later."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def _chart(result: Result, name: str) -> int:
    """The chart that a word names."""
    if name == "first":
        return 0
    if name in ("best", "worst"):
        return int(getattr(result, name).chart)
    if name.isascii() and name.isdigit() and len(name) <= LONGEST_NUMBER:
        return int(name)
    raise GraspAtlasError(f"{shown(name)} names no grasp; give the number of a chart, or first, best or worst")


def _check_result(options: argparse.Namespace) -> int:
    result = load_result(options.result)
    report = result.check()
    say(f"{result.problem.name}: {result.atlas.n_charts} charts, {result.status}")
    say(report)
    return 0 if report else FAILED
