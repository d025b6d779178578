"""The commands that read more on a result: graspatlas pareto, densify and path."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from graspatlas.analysis.densify import Samples, densify
from graspatlas.analysis.pareto import knee, pareto_front, values_of
from graspatlas.commands.shared.arguments import FAILED, INTERRUPTED, Subcommands, chart_named, path_word
from graspatlas.errors import GraspAtlasError
from graspatlas.paths.path import GraspPath
from graspatlas.paths.shortest_path import shortest_path
from graspatlas.paths.time_parametrization import speed_limits
from graspatlas.quality.batched import quality_name
from graspatlas.result.result import Result, load_result
from graspatlas.storage.files import replaced, writable_folder
from graspatlas.support.terminal import say

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add pareto, densify and path to the subcommands of a parser."""
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
    denser.add_argument("--share", type=float, default=1.0, metavar="F", help="only the charts that promise most")
    denser.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    denser.set_defaults(run=_densify)

    way = commands.add_parser(
        "path", help="find the shortest path between two grasps of a result that keeps all contacts"
    )
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
    start, end = (chart_named(result, name) for name in (options.start, options.end))
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
