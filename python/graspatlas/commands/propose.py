"""The command graspatlas propose: grasps of a mesh by a hand."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

from graspatlas.commands.shared.arguments import FAILED, INTERRUPTED, Subcommands, path_word
from graspatlas.support.terminal import say

if TYPE_CHECKING:
    from graspatlas.proposals.outcome import Proposals

__all__ = ["add_commands"]


def add_commands(commands: Subcommands) -> None:
    """Add propose to the subcommands of a parser."""
    some = commands.add_parser("propose", help="find grasps of a mesh by a hand, when nothing else is known")
    some.add_argument("hand", help="URDF or MJCF of a hand, or a name such as allegro_right_hand")
    some.add_argument("mesh", help="mesh file: STL, OBJ, PLY, OFF, ...")
    some.add_argument(
        "--output", type=path_word, required=True, metavar="FOLDER", help="write proposals.html and all else there"
    )
    some.add_argument("--scale", type=float, metavar="S", help="from the mesh's unit to metres, such as 0.001")
    some.add_argument("--fingers", type=int, metavar="N", help="how many fingertips touch; 3, or all of a smaller hand")
    some.add_argument("--links", nargs="+", metavar="LINK", help="links that may touch; the fingertips by default")
    some.add_argument("--on-table", action="store_true", help="the object stands on a table, z being upwards")
    some.add_argument(
        "--obstacles",
        metavar="FILE",
        help="a file whose obstacles, stated as in a problem file, the hand must not touch",
    )
    some.add_argument("--quality", metavar="NAME", help="index that ranks the grasps; holding_force by default")
    some.add_argument(
        "--require",
        action="append",
        default=[],
        metavar="NAME[:VALUE...]",
        help="as for optimize; force_closure:0.5:0.02 and collision_free by default",
    )
    some.add_argument("--top", type=int, metavar="N", help="how many grasps to propose at most, 5 by default")
    some.add_argument("--max-seconds", type=float, metavar="S", help="time for all of it, 90 s by default")
    some.add_argument("--seed", type=int, default=0, metavar="N", help="of the random numbers")
    some.add_argument("--workers", type=int, metavar="N", help="do looks and atlases in so many processes")
    some.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler whose workers do looks and atlases")
    some.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    some.set_defaults(run=_propose)


def _propose(options: argparse.Namespace) -> int:
    from graspatlas.problems import load_obstacles
    from graspatlas.proposals.outcome import ProposalsEnd
    from graspatlas.proposals.propose import PAGE, propose  # slow to import
    from graspatlas.requirements.named import parse_requirement

    names = ("scale", "fingers", "links", "quality", "top", "max_seconds", "seed", "workers", "scheduler")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    if options.obstacles is not None:
        given["obstacles"] = load_obstacles(options.obstacles)
    if options.require:
        given["require"] = [parse_requirement(text) for text in options.require if text != "none"]
    found = propose(options.hand, options.mesh, options.output, on_table=options.on_table, progress=True, **given)
    say(json.dumps(found.to_dict()) if options.json else "\n".join(_lines(found)))
    say(f"wrote {options.output / PAGE}: open it in a browser", file=sys.stderr)
    if found.status is ProposalsEnd.INTERRUPTED:
        return INTERRUPTED
    return 0 if found.proposals else FAILED


def _lines(found: Proposals) -> list[str]:
    """What is said of proposals."""
    from graspatlas.proposals.outcome import ProposalsEnd

    lines = [*found.notes, str(found.counts), found.summary()]
    for proposal in found.proposals:
        lines.append(f"  {proposal.quality:10.5g}  {proposal.tried.name}  ({proposal.folder.name})")
    left = found.counts.left - len(found.tried)
    if left:
        lines.append(f"{left} assignments are left: start it again with the same arguments to look at more of them")
    if found.status is ProposalsEnd.INTERRUPTED:
        lines.append("interrupted: start it again with the same arguments to go on; what was done is kept")
    elif not found.proposals:
        lines.append("no grasp was found that meets the requirements:")
        lines += [f"  {count:5} assignments: {reason}" for reason, count in found.refusals().items()]
        missed = [each for each in found.tried if each.lack]
        lines += [f"the most promising of these, {each.name}, came as near as {each.lack}" for each in missed[:1]]
        lines.append("try another --seed, more --max-seconds, other --fingers or --links, or softer requirements")
    return lines
