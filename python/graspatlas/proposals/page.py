"""The page of proposals: the best grasps as pictures, each of which opens its whole atlas, and all that was tried."""

from __future__ import annotations

import html
import os
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template
from urllib.parse import quote

from graspatlas.proposals.outcome import Proposal, Proposals
from graspatlas.quality.batched import quality_name
from graspatlas.regions.region import Region
from graspatlas.storage.files import replaced
from graspatlas.viewer import export_html, save_picture
from graspatlas.viewer.render.regions import draw_regions

__all__ = ["GRASPS", "PICTURE", "REGIONS", "write_page", "write_regions", "write_views"]

#: What lies in the folder of a proposal to look at.
PICTURE, GRASPS = "grasp.png", "grasps.html"
#: The picture of the object's regions, beside the page.
REGIONS = "regions.png"
#: Size of a picture of a grasp, and of that of the regions [pixels].
WIDTH, HEIGHT = 960, 600
REGIONS_WIDTH, REGIONS_HEIGHT = 1400, 700


def write_views(proposal: Proposal) -> None:
    """Write the picture of a proposal's best grasp, and the page of all its grasps, into its folder.

    Raises:
        GraspAtlasError: If a mesh cannot be read or a file cannot be written.
    """
    save_picture(proposal.result, proposal.folder / PICTURE, width=WIDTH, height=HEIGHT, worst=False)
    export_html(proposal.result, proposal.folder / GRASPS)


def write_regions(regions: Sequence[Region], path: Path) -> None:
    """Write the picture of the regions, in colours with their names.

    Raises:
        GraspAtlasError: If it cannot be written.
    """
    with replaced(path) as stream:
        draw_regions(regions, None, REGIONS_WIDTH, REGIONS_HEIGHT).save(stream, "PNG")


def write_page(found: Proposals, title: str, path: Path) -> None:
    """Write the page.

    Args:
        found: The proposals, with :func:`write_views` done for each.
        title: Of the page, such as ``"mug by allegro_right_hand"``.
        path: Where to; the folders of the proposals lie beside it.

    Raises:
        GraspAtlasError: If it cannot be written.
    """
    template = Template(resources.files("graspatlas.proposals").joinpath("page.html").read_text(encoding="utf-8"))
    text = template.substitute(
        title=html.escape(title),
        summary=html.escape(found.summary()),
        regions=f'<img src="{REGIONS}" width="{REGIONS_WIDTH}" height="{REGIONS_HEIGHT}" alt="regions of the object">',
        cards="\n".join(_card(rank, each, path.parent) for rank, each in enumerate(found.proposals, start=1)),
        notes=_notes(found),
        counts=html.escape(str(found.counts)),
        quality=html.escape(quality_name(found.quality)),
        rows="\n".join(_row(row) for row in found.rows()),
    )
    with replaced(path) as stream:
        stream.write(text.encode("utf-8"))


def _card(rank: int, proposal: Proposal, beside: Path) -> str:
    """A proposal: its picture, which opens its grasps, and its figures."""
    result, place = proposal.result, quote(os.path.relpath(proposal.folder, beside).replace(os.sep, "/"))
    pairs = zip(proposal.tried.links, proposal.tried.regions, strict=True)
    touching = "".join(f"<li>{html.escape(f'{link} on {region}')}</li>" for link, region in pairs)
    accepted, charts = int(result.accepted.sum()), result.atlas.n_charts
    name = html.escape(quality_name(result.quality))
    return (
        f'<div class="card"><a href="{place}/{GRASPS}"><img src="{place}/{PICTURE}" width="{WIDTH}" height="{HEIGHT}"'
        f' alt="proposal {rank}"></a><div><h2>{rank}. {name} {proposal.quality:.4g}</h2><ul>{touching}</ul>'
        f"<p>{accepted} of {charts} charts meet the requirements: "
        f'<a href="{place}/{GRASPS}">all grasps</a>, <a href="{place}/problem.yaml">problem file</a></p></div></div>'
    )


def _notes(found: Proposals) -> str:
    return "".join(f"<p>{html.escape(note[:1].upper() + note[1:])}.</p>" for note in found.notes)


def _row(row: dict[str, object]) -> str:
    value = row["value"] if row["value"] == row["value"] else row["first_value"]
    shown = f"{value:.4g}" if value == value else ""
    end = html.escape(str(row["end"]) + (f": {row['missed']}" if row["missed"] else ""))
    lack = f"<br><small>nearest: {html.escape(str(row['lack']))}</small>" if row["lack"] else ""
    return (
        f'<tr><td>{html.escape(str(row["assignment"]))}</td><td class="number">{row["distance"]:.3g}</td>'
        f'<td>{end}{lack}</td><td class="number">{shown}</td></tr>'
    )
