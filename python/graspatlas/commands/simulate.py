"""The command graspatlas simulate: trials of grasps in MuJoCo."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from pathlib import Path

from graspatlas.commands.shared.arguments import FAILED, INTERRUPTED, Subcommands, chart_named, path_word
from graspatlas.errors import GraspAtlasError
from graspatlas.result.result import Result, load_result
from graspatlas.simulation.outcome import Simulation
from graspatlas.simulation.protocols import PROTOCOLS, find_protocol
from graspatlas.simulation.recording import record
from graspatlas.simulation.runs import simulate
from graspatlas.simulation.self_test import KNOWN_PROBLEM, self_test
from graspatlas.simulation.trials import LARGEST_FORCE
from graspatlas.support.terminal import say

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add simulate to the subcommands of a parser."""
    trial = commands.add_parser("simulate", help="try grasps of a result in MuJoCo: close the hand, push the object")
    trial.add_argument("result", type=path_word, nargs="?", help="folder or file that optimize wrote")
    trial.add_argument("--protocol", default="dexgraspbench", metavar="NAME", help=f"one of {', '.join(PROTOCOLS)}")
    trial.add_argument(
        "--chart", nargs="+", metavar="CHART", help="only these: numbers of charts, first, best or worst"
    )
    trial.add_argument(
        "--stated-contacts", action="store_true", help="with the friction that the result's force_closure states"
    )
    trial.add_argument("--sample", type=int, metavar="N", help="also N accepted charts, chosen at random")
    trial.add_argument("--all", action="store_true", help="also all charts that meet the result's requirements")
    trial.add_argument(
        "--breaking", action="store_true", help="find the breaking force of each, not of the first alone"
    )
    trial.add_argument("--distance", type=float, default=0.01, metavar="M", help="of the pregrasp from the object [m]")
    trial.add_argument(
        "--force", type=float, default=5.0, metavar="N", help="that squeezes, in the mean of contacts [N]"
    )
    trial.add_argument("--seed", type=int, default=0, metavar="N", help="of the random sample; 0 by default")
    trial.add_argument(
        "--html", type=path_word, metavar="FILE", help="write a page that plays the first grasp's trial, a growing push"
    )
    trial.add_argument("--picture", type=path_word, metavar="FILE", help="write a PNG picture of its moments")
    trial.add_argument("--self-test", action="store_true", help="try a grasp whose outcome is known instead")
    trial.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    trial.set_defaults(run=_simulate)


def _simulate(options: argparse.Namespace) -> int:
    if options.self_test:
        return _self_test()
    if options.result is None:
        raise GraspAtlasError("name the folder or file that optimize wrote, or give --self-test")
    result = load_result(options.result)
    if not result.accepted.any() and result.refinement is None and not options.chart:
        say(f"{result.problem.name}: no grasp meets the requirements, nothing was tried", file=sys.stderr)
        return FAILED
    trials = simulate(
        result,
        protocol=options.protocol,
        stated_contacts=options.stated_contacts,
        charts=options.chart and [chart_named(result, name) for name in options.chart],
        sample=options.sample,
        everything=options.all,
        distance=options.distance,
        normal_force=options.force,
        breaking=options.breaking,
        seed=options.seed,
    )
    place = _place(options.result, trials)
    trials.save(place)
    if options.html or options.picture:
        _show(result, trials, options)
    if options.json:
        say(json.dumps(trials.summary()))
    else:
        _report(trials)
        say(f"stored in {place}")
    return 0 if trials.complete else INTERRUPTED


def _show(result: Result, trials: Simulation, options: argparse.Namespace) -> None:
    """Write the film of the first grasp."""
    from graspatlas.viewer import export_html, save_picture  # slow to import

    chart = None if options.chart is None else int(trials.charts[0])
    protocol = replace(find_protocol(trials.protocol), friction=trials.friction, torsional=trials.torsional)
    film = record(result, chart=chart, protocol=protocol, distance=trials.distance, normal_force=trials.normal_force)
    for file, write in ((options.html, export_html), (options.picture, save_picture)):
        if file:
            write(film, file)
            say(f"wrote {file}", file=sys.stderr)


def _place(result: Path, trials: Simulation) -> Path:
    """Where trials of a result are stored: in its folder, or beside its file."""
    name = f"simulation-{trials.protocol}.json"
    return result / name if result.is_dir() else result.with_name(f"{result.stem}-{name}")


def _report(trials: Simulation) -> None:
    first = trials.trial(0)
    what = "the refined best" if first["refined"] else f"chart {first['chart']}"
    say(f"{trials.problem}, {trials.protocol}: {what} survived {first['survived']} of {first['of']} pushes")
    if first["unstable"] or first["shift_mm"] is None:
        say("  MuJoCo gave this trial up, because its numbers grew without bound: nothing is known of this grasp")
    else:
        fell = f"; lost while {first['lost_while']}" if first["lost_while"] else ""
        say(f"  the object moved {first['shift_mm']:.2g} mm and turned {first['turn_deg']:.2g} degrees at most{fell}")
    if first["breaking_direction"] is not None:
        along = ", ".join(f"{value:.2f}" for value in first["breaking_direction"])
        force = first["breaking_force_n"]
        say(f"  it was lost under a growing push of {force:.2f} N along ({along}) of the palm")
    elif trials.breaking_forces[0] == math.inf:
        say(f"  a growing push took it away in no direction, up to {LARGEST_FORCE:g} N")
    distances = ", ".join(f"{name} {round(value, 3) + 0.0:.3f}" for name, value in first["contact_distance_mm"].items())
    penetration = first["penetration_mm"]
    say(f"  at the start: distance of contacts {distances} mm; penetration {penetration:.3f} mm")
    if not first["pregrasp_reached"]:
        say(f"  the fingertips began {first['pregrasp_mm']:.1f} mm off: farther they cannot; grasp.pregrasp() says why")
    if len(trials) > 1:
        lost = int(trials.lost_closing.sum())
        say(f"  of {len(trials)} grasps {int(trials.held.sum())} survived all pushes; {lost} were lost while closing")
        if trials.unstable.any():
            say(f"  MuJoCo gave up {int(trials.unstable.sum())} trials, because their numbers grew without bound")
    say(f"  {trials.seconds:.1f} s" + ("" if trials.complete else "; interrupted"))


def _self_test() -> int:
    held, lost, passed = self_test()
    say(f"{KNOWN_PROBLEM}, first grasp: survived {int(held.survived.sum())} of {held.survived.size}, expected all")
    say(f"on ice: survived {int(lost.survived.sum())} of {lost.survived.size}, expected none")
    say(
        "self-test passed" if passed else "self-test failed: this MuJoCo behaves differently; trust no trial",
        file=sys.stderr,
    )
    return 0 if passed else FAILED
