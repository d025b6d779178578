"""What a notebook shows of a problem, a result, an atlas, a grasp, a path and components, and the page of a result."""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from graspatlas.atlas.atlas import Atlas
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.optimizer.components import Components
from graspatlas.paths.path import GraspPath, Path
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import requirement_name
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.notebooks import EmbeddedPage
from graspatlas.support.validation import whole
from graspatlas.viewer.explorer.page import explorer_page
from graspatlas.viewer.notebook.card import card, curve, folded, shown_number, table
from graspatlas.viewer.notebook.pictures import picture_of_atlas, picture_of_grasp, picture_of_problem

__all__ = ["explorer", "html_of"]

#: Smallest and largest height of a page in a notebook [pixels].
LOWEST, HIGHEST = 200, 4000


@singledispatch
def html_of(thing: object) -> str:
    """The card of an object."""
    raise TypeError(f"no card shows a {type(thing).__name__}")


def explorer(result: GraspAtlas, chart: int | None, height: int) -> EmbeddedPage:
    """The page of a result within a notebook; see :meth:`graspatlas.Result.explore`."""
    height = whole(height, "height", LOWEST, HIGHEST)
    return EmbeddedPage(explorer_page(result, chart), f"the atlas of {result.problem.name}", height)


@html_of.register
def _problem(problem: Problem) -> str:
    stated = ("dimension", "radius", "epsilon", "quality")
    start = "x1, stated" if problem.x1 else "to be found near the pose guess" if problem.pose_guess else "to be found"
    rows = {
        "hand": f"{problem.hand.name}, {len(problem.hand.joints)} joints",
        "object": problem.object.name,
        "contacts": ", ".join(contact.frame for contact in problem.contacts),
        "first grasp": start,
        "freedom of all feasible grasps": _freedom(problem),
        "requirements": ", ".join(map(requirement_name, problem.requirements)) or "none",
        "by default": ", ".join(f"{name} {problem.defaults[name]}" for name in stated if name in problem.defaults),
    }
    return card(f"Problem {problem.name}", [table(rows)], picture_of_problem(problem))


def _freedom(problem: Problem) -> str:
    """The dimension t, where a first grasp tells."""
    try:
        return f"t = {problem.full_dimension}"
    except GraspAtlasError as error:
        return str(error)


@html_of.register
def _result(result: GraspAtlas) -> str:
    atlas = result.atlas
    rows: dict[str, object] = {
        "atlas": f"{atlas.n_charts} charts, k = {result.dimension}, r = {atlas.radius:g}; {result.status}",
        "index": quality_name(result.quality),
    }
    grasp = None
    if result.accepted.any():
        grasp = result.best
        rows |= {"best": grasp.quality, "worst": result.worst.quality}
    if result.refinement and result.refinement.n_peaks:
        grasp, found = result.refined_best, result.refinement
        rows["refined best"] = f"{shown_number(grasp.quality)}, {found.statuses[0]}; {found.n_peaks} local maxima"
    rows["accepted"] = (
        f"{int(result.accepted.sum())} of {atlas.n_charts}" if result.requirements else "all: no requirement"
    )
    rows |= {f"rejected by {name}": count for name, count in result.rejected.items()}
    rows["time"] = f"{atlas.seconds + result.quality_seconds:.2f} s"
    beside = picture_of_grasp(grasp) if grasp else picture_of_atlas(atlas)
    return card(f"Result of {result.problem.name}", [table(rows), _joints(grasp) if grasp else ""], beside)


@html_of.register
def _atlas(atlas: Atlas) -> str:
    rows: dict[str, object] = {
        "charts": atlas.n_charts,
        "status": str(atlas.status),
        "dimension, radius, epsilon": f"{atlas.dimension}, {atlas.radius:g}, {atlas.epsilon:g}",
        "largest residual": float(atlas.residuals.max(initial=0.0)),
        "audit": f"{atlas.audit.points} points, {atlas.audit.holes} holes filled",
        "time": f"{atlas.seconds:.2f} s",
    }
    rows |= {f"vertices closed by {name}": count for name, count in atlas.closed_vertices.items() if count}
    rows |= {f"doubt {i + 1}": text for i, text in enumerate(atlas.doubts)}
    return card(f"Atlas of {atlas.n_charts} charts", [table(rows)], picture_of_atlas(atlas))


@html_of.register
def _grasp(grasp: Grasp) -> str:
    rows: dict[str, object] = {} if np.isnan(grasp.quality) else {"index": grasp.quality}
    rows |= {"chart": grasp.chart} if grasp.chart >= 0 else {}
    rows |= {
        "contacts": ", ".join(grasp.contact_frames),
        "palm in the object's frame [m]": _numbers(grasp.palm_xyz),
        "its quaternion x y z w": _numbers(grasp.palm_quat_xyzw),
    }
    return card(f"Grasp of {grasp.problem.name}", [table(rows), _joints(grasp)], picture_of_grasp(grasp))


def _joints(grasp: Grasp) -> str:
    """Joint positions, to be folded out."""
    rows = {name: f"{position:.4f}" for name, position in grasp.joint_positions.items()}
    return folded(f"{len(rows)} joint positions [rad or m]", table(rows))


def _numbers(values: object) -> str:
    return ", ".join(f"{value:.4f}" for value in np.asarray(values))


@html_of.register
def _path(path: Path) -> str:
    rows: dict[str, object] = {
        "points": len(path),
        "length": path.length,
        "shortened": "as far as its neighbours allow" if path.tight else "no: interrupted or given up",
        "largest residual": float(path.residuals.max(initial=0.0)),
    }
    beside = ""
    if isinstance(path, GraspPath):
        if path.result.requirements and path.knows_requirements:
            rows["accepted"] = f"{int(path.accepted.sum())} of {len(path)}"
        if path.knows_quality:
            name = quality_name(path.result.quality)
            rows |= {f"smallest {name}": float(path.qualities.min()), f"largest {name}": float(path.qualities.max())}
            beside = curve(path.arc_length, path.qualities, f"{name} along the path")
    of = f" of {path.result.problem.name}" if isinstance(path, GraspPath) else ""
    return card(f"Path{of}", [table(rows)], beside)


@html_of.register
def _components(components: Components) -> str:
    rows = [
        (i, result.atlas.n_charts, str(result.status), hits, int(result.accepted.sum()), _best(result))
        for i, (result, hits) in enumerate(zip(components.results, components.hits, strict=True))
    ]
    head = ("component", "charts", "status", "grasps found in it", "accepted", "best")
    facts = {"status": str(components.status), "grasps found": components.found, "random starts": components.tries}
    held = bool(rows) and components.best_result.accepted.any()
    beside = picture_of_grasp(components.best) if held else ""
    name = f" of {components.best_result.problem.name}" if rows else ""
    return card(f"{len(components)} components{name}", [table(rows, head), table(facts)], beside)


def _best(result: GraspAtlas) -> str:
    if not result.accepted.any():
        return "none"
    return shown_number(result.refined_best.quality if result.refinement else result.best.quality)
