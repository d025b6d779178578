"""A result as one page that needs neither server nor network: the atlas, and the hand beside it.

The page is put together from the files in ``scripts``, which share one scope: what they are for is said at the top of
each. Numbers are in the page as :class:`~graspatlas.viewer.explorer.numbers.Numbers` packs them, everything else as
JSON in which no text can end the element that it stands in.
"""

from __future__ import annotations

import html
import json
from dataclasses import dataclass
from importlib import resources
from string import Template

import numpy as np

from graspatlas.collision.clash import Clash
from graspatlas.grasps.grasp import Grasp
from graspatlas.result.exports import identity
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.explorer.charts import Charts
from graspatlas.viewer.explorer.layout import Layout
from graspatlas.viewer.explorer.numbers import Numbers
from graspatlas.viewer.explorer.shapes import write_clash, write_shapes
from graspatlas.viewer.explorer.words import index_tables, requirement_label
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.captions import index_name, legend, rejected_by, subtitle
from graspatlas.viewer.scene.clashing import WIDTH
from graspatlas.viewer.scene.scene import (
    COLOURS,
    CONTACT_RADIUS,
    ELLIPSOID_LENGTH,
    ELLIPSOID_THICKNESS,
    NORMAL_LENGTH,
    NORMAL_RADIUS,
    body_parts,
    clash_of,
    direction_to,
    outermost,
    size_of,
    subject_of,
    up_of_object,
    upright_parts,
    vertices_of,
)
from graspatlas.viewer.web.page import meshcat_script

__all__ = ["Additions", "explorer_page"]

#: The page's own scripts, in the order in which they stand in it.
SCRIPTS = (
    "data",
    "kinematics",
    "walks",
    "colours",
    "selection",
    "orbit",
    "atlas_view",
    "hand_view",
    "plots",
    "numbers_table",
    "keys",
    "main",
)


@dataclass(frozen=True)
class Additions:
    """What a page has besides, where a server answers it.

    Attributes:
        charts: The grasps of the page.
        layout: Where it draws them.
        facts: What its scripts know, as ``facts.live``.
        controls: Markup below the buttons that copy.
        style: Style sheet.
        scripts: Scripts, in the scope of the page's own, after them.
    """

    charts: Charts
    layout: Layout
    facts: PlainTable
    controls: str
    style: str
    scripts: str


def explorer_page(result: GraspAtlas, chart: int | None = None, additions: Additions | None = None) -> str:
    """The page's text.

    Args:
        result: The result.
        chart: The chart that it opens at; by default it opens at the best grasp, the worst beside it.
        additions: What the page has besides; with it, it may ask the server that it comes from.

    Raises:
        GraspAtlasError: If a mesh of the hand or the object cannot be read, or there is no such chart.
    """
    numbers = Numbers()
    nearest = None if result.refinement or result.nearest is None else int(result.nearest.chart)
    opens_at = nearest if chart is None else result.checked_chart(chart)
    charts, layout = (additions.charts, additions.layout) if additions else (Charts(result), Layout(result.atlas))
    facts = _facts(charts, layout, numbers, opens_at)
    facts["opens_at"], facts["nearest"] = opens_at, nearest
    facts["numbers"] = numbers.entries  # type: ignore[assignment]  # plain data, but typed more closely
    if additions:
        facts["live"] = additions.facts
    files = resources.files("graspatlas.viewer.explorer")
    scripts = [(files / "scripts" / f"{name}.js").read_text(encoding="utf-8") for name in SCRIPTS]
    scripts += [additions.scripts] if additions else []
    template = Template((files / "page.html").read_text(encoding="utf-8"))
    return template.substitute(
        title=html.escape(f"graspatlas: {result.problem.name}"),
        name=html.escape(result.problem.name),
        summary=html.escape(subtitle(result).split(": ", 1)[1]),
        extremes=html.escape(_extremes(result)),
        style=(files / "style.css").read_text(encoding="utf-8") + (additions.style if additions else ""),
        connect="; connect-src 'self'" if additions else "",
        controls=additions.controls if additions else "",
        meshcat=meshcat_script(),
        facts=json.dumps(facts, allow_nan=False).replace("<", "\\u003c"),
        numbers=numbers.text(),
        scripts="\n".join(scripts),
    )


def _extremes(result: GraspAtlas) -> str:
    """Values of the best and the worst grasp, in words."""
    grasps = [("refined best", result.refined_best)] if result.refinement else []
    if result.accepted.any():
        grasps += [] if grasps else [("best", result.best)]
        grasps.append(("worst", result.worst))
    if not grasps:
        nearest = result.nearest
        assert nearest is not None
        why = "; ".join(rejected_by(result.rejections(nearest.chart)))
        return f"no grasp meets the requirements, nearest is chart {nearest.chart}: {why}"
    places = [f" (chart {grasp.chart})" if grasp.chart >= 0 else "" for _, grasp in grasps]
    values = ", ".join(f"{name} {g.quality:.3g}{place}" for (name, g), place in zip(grasps, places, strict=True))
    return f"{index_name(result)}: {values}"


def _facts(charts: Charts, layout: Layout, numbers: Numbers, opens_at: int | None) -> PlainTable:
    """What the page knows besides its numbers, which it writes; of the chart that it opens at also what it lacks."""
    result, problem = charts.result, charts.result.problem
    shapes = BodyShapes(problem)
    rejected = () if opens_at is None else result.rejections(opens_at)
    clash = clash_of(rejected)
    shown = [result.best, result.worst] if result.accepted.any() else [result.at_x1]
    if result.refinement:
        shown[0] = result.refined_best
    size = size_of(body_parts(shapes, shown[0]))
    charts.write(numbers)
    maxima = result.refinement.x[: charts.n_maxima] if result.refinement else result.atlas.centers[:0]
    requirements, _ = charts.rejections
    friction, torsional = charts.friction
    return {
        "problem": problem.name,
        "status": str(result.status),
        "n_charts": result.atlas.n_charts,
        "dimension": result.dimension,
        "planar": problem.object_joint_model.planar,
        "translations": problem.object_joint_model.translations,
        "length_scale": problem.length_scale,
        "indices": index_tables(result, list(charts.indices)),
        "requirements": [{"name": name, "label": requirement_label(name)} for name in requirements],
        "best": int(result.best.chart) if result.accepted.any() else None,
        "worst": int(result.worst.chart) if result.accepted.any() else None,
        "maxima": _maxima(result, charts.n_maxima),
        "joints": [
            {
                "name": joint.name,
                "parent": joint.parent,
                "placement": joint.T_parent_joint.ravel().tolist(),
                "axis": joint.axis.tolist(),
                "prismatic": joint.prismatic,
            }
            for joint in charts.joints
        ],
        "contacts": [
            {"frame": contact.frame, "joint": int(joint)}
            for contact, joint in zip(problem.contacts, charts.contact_joints(), strict=True)
        ],
        "friction": friction,
        "torsional": torsional,
        "shapes": write_shapes(problem, shapes, numbers, clash),
        "rejected": {
            "chart": opens_at,
            "lines": rejected_by(rejected),
            "stripes": write_clash(clash, shapes, numbers, size * WIDTH) if clash else [],
            "point": clash.point.tolist() if clash and np.isfinite(clash.point).all() else None,
        },
        "layout": layout.write(maxima, numbers),
        "view": _view(
            shapes, shown, size, None if clash is None or opens_at is None else (result.grasp(opens_at), clash)
        ),
        "colours": {name: list(colour) for name, colour in COLOURS.items()},
        "legend": [{"colour": list(colour), "text": text} for colour, text in legend()],
        "file": identity(result),
    }


def _maxima(result: GraspAtlas, count: int) -> list[PlainTable]:
    """What is said of the refined maxima."""
    refinement = result.refinement
    if refinement is None:
        return []
    return [
        {
            "chart": int(refinement.starts[i]),
            "status": str(refinement.statuses[i]),
            "all_motions": refinement.all_motions,
        }
        for i in range(count)
    ]


def _view(shapes: BodyShapes, grasps: list[Grasp], size: float, clashing: tuple[Grasp, Clash] | None) -> PlainTable:
    """From where hand and object are seen, what must be in sight, and how large marks are.

    Args:
        shapes: Meshes of the problem.
        grasps: What must be in sight.
        size: Scale of the marks.
        clashing: A grasp that is looked at for its shapes that collide.
    """
    parts = [upright_parts(shapes, grasp, size)[0] for grasp in grasps]
    subjects = [subject_of(some, size) for some in parts]
    if clashing is not None:
        grasp, clash = clashing
        parts.append(upright_parts(shapes, grasp, size, clash)[0])
        subjects = [subject_of(parts[-1], size, clash)]
    points: Array = np.concatenate([vertices_of(some, ("hand", "object", "normal")) for some in parts])
    up = up_of_object(shapes.problem)
    return {
        "up": None if up is None else up.tolist(),
        "direction": direction_to(subjects, shapes.problem.object_joint_model).tolist(),
        "points": outermost(points).round(4).ravel().tolist(),
        "contact_radius": size * CONTACT_RADIUS,
        "normal": [size * NORMAL_LENGTH, size * NORMAL_RADIUS],
        "ellipsoid": [size * ELLIPSOID_LENGTH, size * ELLIPSOID_THICKNESS],
    }
