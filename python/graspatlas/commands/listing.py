"""What there is: list names problems and indices, doctor what is installed, regions what a mesh is made of."""

from __future__ import annotations

import argparse
import json
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from graspatlas.commands.shared.arguments import Subcommands, path_word
from graspatlas.problem_files.outline import read_outline
from graspatlas.problems import bundled_problems, problem_text
from graspatlas.quality.evaluation import INDICES
from graspatlas.requirements.named import REQUIREMENTS
from graspatlas.support.terminal import say

if TYPE_CHECKING:
    from graspatlas.regions.region import Region
    from graspatlas.support.arrays import Array
    from graspatlas.support.validation import PlainTable

__all__ = ["add_commands"]

#: Size of the picture of regions [pixels].
WIDTH, HEIGHT = 1600, 900


def add_commands(commands: Subcommands) -> None:
    """Add list, doctor and regions to the subcommands of a parser."""
    listing = commands.add_parser("list", help="list the bundled problems, the quality indices and the requirements")
    listing.set_defaults(run=_list)

    patient = commands.add_parser("doctor", help="tell what is installed, missing or in the way, for a bug report")
    patient.add_argument("--json", action="store_true", help="print a list of JSON objects")
    patient.set_defaults(run=_doctor)

    regions = commands.add_parser(
        "regions", help="cut a mesh into smooth regions, each with the simplest patch that fits"
    )
    regions.add_argument("mesh", help="mesh file: STL, OBJ, PLY, OFF, ...")
    regions.add_argument("--scale", type=float, metavar="S", help="from the mesh's unit to metres, such as 0.001")
    regions.add_argument("--tolerance", type=float, metavar="T", help="largest distance of a region from its patch [m]")
    regions.add_argument("--crease", type=float, metavar="DEGREES", help="faces at a larger angle are cut apart; 35")
    regions.add_argument("--smallest", type=float, metavar="SHARE", help="least area, as a share of the mesh's; 0.005")
    regions.add_argument("--output", type=path_word, metavar="FILE", help="write the patches as YAML")
    regions.add_argument("--picture", type=path_word, metavar="FILE.png", help="draw the regions in colours")
    regions.add_argument("--json", action="store_true", help="print what was found as JSON")
    regions.set_defaults(run=_regions)


def _list(_: argparse.Namespace) -> int:
    say("problems:")
    for name in bundled_problems():
        text, _file, folder = problem_text(name)
        outline = read_outline(text, folder)
        say(f"  {name:22} t = {outline.freedoms}. {outline.description}")
    say("quality indices:")
    for name, index in INDICES.items():
        say(f"  {name:26} {(index.__doc__ or '').splitlines()[0]}")
    say("requirements:")
    for name, requirement in REQUIREMENTS.items():
        values = ":".join(field.name.upper() for field in fields(requirement))
        say(f"  {name}:{values}  {(requirement.__doc__ or '').splitlines()[0]}")
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from graspatlas import doctor  # slow to import

    findings = doctor.examine()
    say(doctor.as_json(findings) if options.json else doctor.report(findings))
    return doctor.status(findings)


def _regions(options: argparse.Namespace) -> int:
    import numpy as np

    from graspatlas.meshes.repair import repaired_triangles  # slow to import
    from graspatlas.regions.find import CREASE, SMALLEST, check_unit, regions_of

    _check_targets(options)
    mesh, report = repaired_triangles(options.mesh, 1.0 if options.scale is None else options.scale)
    if options.scale is None:
        check_unit(report)
    regions = regions_of(
        mesh,
        tolerance=options.tolerance,
        crease=CREASE if options.crease is None else float(np.radians(options.crease)),
        smallest=SMALLEST if options.smallest is None else options.smallest,
    )
    data: PlainTable = {
        "mesh": str(options.mesh),
        "repair": str(report),
        "regions": [region.to_dict() for region in regions],
    }
    if options.json:
        say(json.dumps(data))
    else:
        say(f"{options.mesh}: {report}")
        _list_regions(regions, float(mesh.areas.sum()))
    if options.output:
        _write_yaml(options.output, data)
    if options.picture:
        left = np.setdiff1d(mesh.source, np.concatenate([region.faces for region in regions]))
        _write_picture(options.picture, regions, mesh.corners[np.isin(mesh.source, left)])
    return 0


def _check_targets(options: argparse.Namespace) -> None:
    """Refuse names of files before the work is done."""
    from graspatlas.errors import GraspAtlasError
    from graspatlas.storage.files import checked_target

    for target in (options.output, options.picture):
        if target is not None:
            checked_target(target)
    if options.picture is not None and options.picture.suffix.lower() != ".png":
        raise GraspAtlasError(f"a picture's name must end in .png, not '{options.picture}'")


def _list_regions(regions: tuple[Region, ...], area: float) -> None:
    """Print a line for each region."""
    width = max(len(region.name) for region in regions)
    say(f"{'region':{width}}  area [cm2]  largest and rms distance [mm]  filled  centre [m]")
    for region in regions:
        (x, y, z), (largest, rms) = region.center, region.error
        say(
            f"{region.name:{width}}  {1e4 * region.area:10.4g}  {1e3 * largest:14.3f} {1e3 * rms:14.3f}"
            f"  {100.0 * region.filled:5.0f}%  ({x + 0.0:.4f}, {y + 0.0:.4f}, {z + 0.0:.4f})"
        )
    share = 100.0 * sum(region.area for region in regions) / area
    say(f"{len(regions)} region{'s' if len(regions) != 1 else ''} with {share:.4g} % of the area")


def _write_yaml(path: Path, data: PlainTable) -> None:
    """Write the regions so that a patch can be pasted into a problem file."""
    import yaml  # slow to import

    from graspatlas.storage.files import replaced

    with replaced(path) as stream:
        plain = json.loads(json.dumps(data))  # lists for tuples
        stream.write(yaml.safe_dump(plain, sort_keys=False, default_flow_style=None, width=120).encode("utf-8"))


def _write_picture(path: Path, regions: tuple[Region, ...], rest: Array) -> None:
    """Draw the regions, and what belongs to none in grey."""
    from graspatlas.storage.files import replaced
    from graspatlas.viewer.render.regions import draw_regions  # slow to import

    with replaced(path) as stream:
        draw_regions(regions, rest, WIDTH, HEIGHT).save(stream, "PNG")
