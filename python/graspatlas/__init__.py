"""Globally best grasps: an atlas of all feasible grasps, and any quality index read on it.

Names are imported when they are first used (PEP 562): nobody waits for what a program leaves alone.
"""

from graspatlas import start_up as start_up  # first: what follows takes a moment  # isort: skip

import importlib
import typing

from graspatlas import libraries as _libraries
from graspatlas.version import __version__ as __version__

try:
    _libraries.load()
except ImportError as _error:  # the doctor comes all the same
    if not start_up.is_command("doctor"):
        raise
    from graspatlas import doctor as _doctor

    raise SystemExit(_doctor.main(_error)) from None

if typing.TYPE_CHECKING:
    from graspatlas import patches, quality, systems
    from graspatlas.analysis.climb import Climb, climb
    from graspatlas.analysis.densify import Samples, densify
    from graspatlas.analysis.pareto import pareto_front
    from graspatlas.analysis.peaks import Peak, local_maxima, peaks_of
    from graspatlas.analysis.refine import refine
    from graspatlas.atlas.atlas import Atlas
    from graspatlas.atlas.build import build_atlas
    from graspatlas.atlas.status import Closed, Status
    from graspatlas.atlas.upper_bounds import estimate_upper_bounds
    from graspatlas.errors import GraspAtlasError
    from graspatlas.execution.approach import Approach
    from graspatlas.execution.contact_forces import ContactForces
    from graspatlas.execution.pregrasp import Pregrasp
    from graspatlas.formats.export import export_grasps
    from graspatlas.grasps.grasp import Grasp
    from graspatlas.grasps.grasps import Grasps
    from graspatlas.hand import motions
    from graspatlas.hand.body import Body
    from graspatlas.hand.hand import Hand
    from graspatlas.hand.motions import HandMotions
    from graspatlas.meshes.repair import Repair, repaired
    from graspatlas.optimizer.components import Components, SearchStatus, find_components
    from graspatlas.optimizer.ladder import ladder
    from graspatlas.optimizer.ladder_outcome import Ladder
    from graspatlas.optimizer.optimize import optimize
    from graspatlas.optimizer.rungs import Rung
    from graspatlas.pads.find import find_pads
    from graspatlas.pads.pad import Pad
    from graspatlas.paths.path import GraspPath, Path
    from graspatlas.paths.shortest_path import shortest_path
    from graspatlas.problem.contacts import Contact
    from graspatlas.problem.first_grasp import FirstGrasp
    from graspatlas.problem.pose_guess import PoseGuess
    from graspatlas.problem.problem import Problem
    from graspatlas.problems import bundled_problems, load_problem
    from graspatlas.proposals.outcome import Proposal, Proposals, ProposalsEnd
    from graspatlas.proposals.propose import propose
    from graspatlas.quality.batched import batched
    from graspatlas.reach.reach import Reach, ReachStatus
    from graspatlas.regions.find import find_regions
    from graspatlas.regions.region import Region
    from graspatlas.requirements.collision_free import CollisionFree
    from graspatlas.requirements.force_closure import ForceClosure
    from graspatlas.requirements.holding_force import HoldingForce
    from graspatlas.requirements.joint_margin import JointMargin
    from graspatlas.requirements.reachable import Reachable
    from graspatlas.requirements.rejections import Rejection
    from graspatlas.result.gap import Gap
    from graspatlas.result.refinement import Refinement, SearchReport
    from graspatlas.result.result import Result, load_result
    from graspatlas.search.grasp_search import find_grasps
    from graspatlas.simulation.outcome import Simulation, load_simulation
    from graspatlas.simulation.recording import Recording, record
    from graspatlas.simulation.runs import simulate
    from graspatlas.systems.projection import project
    from graspatlas.systems.system import System
    from graspatlas.viewer import export_html, save_picture, view
    from graspatlas.viewer.figures import (
        plot_atlas,
        plot_best_and_worst,
        plot_climbs,
        plot_ellipsoid,
        plot_growth,
        plot_holding,
        plot_ladder,
        plot_local_maxima,
        plot_pareto,
        plot_planar_grasp,
        plot_planar_indices,
    )
    from graspatlas.world.arm import Arm
    from graspatlas.world.obstacle import Obstacle
    from graspatlas.world.pose import Pose

__all__ = [
    "Approach",
    "Arm",
    "Atlas",
    "Body",
    "Climb",
    "Closed",
    "CollisionFree",
    "Components",
    "Contact",
    "ContactForces",
    "FirstGrasp",
    "ForceClosure",
    "Gap",
    "Grasp",
    "GraspAtlasError",
    "GraspPath",
    "Grasps",
    "Hand",
    "HandMotions",
    "HoldingForce",
    "JointMargin",
    "Ladder",
    "Obstacle",
    "Pad",
    "Path",
    "Peak",
    "Pose",
    "PoseGuess",
    "Pregrasp",
    "Problem",
    "Proposal",
    "Proposals",
    "ProposalsEnd",
    "Reach",
    "ReachStatus",
    "Reachable",
    "Recording",
    "Refinement",
    "Region",
    "Rejection",
    "Repair",
    "Result",
    "Rung",
    "Samples",
    "SearchReport",
    "SearchStatus",
    "Simulation",
    "Status",
    "System",
    "batched",
    "build_atlas",
    "bundled_problems",
    "climb",
    "densify",
    "estimate_upper_bounds",
    "export_grasps",
    "export_html",
    "find_components",
    "find_grasps",
    "find_pads",
    "find_regions",
    "ladder",
    "load_problem",
    "load_result",
    "load_simulation",
    "local_maxima",
    "motions",
    "optimize",
    "pareto_front",
    "patches",
    "peaks_of",
    "plot_atlas",
    "plot_best_and_worst",
    "plot_climbs",
    "plot_ellipsoid",
    "plot_growth",
    "plot_holding",
    "plot_ladder",
    "plot_local_maxima",
    "plot_pareto",
    "plot_planar_grasp",
    "plot_planar_indices",
    "project",
    "propose",
    "quality",
    "record",
    "refine",
    "repaired",
    "save_picture",
    "shortest_path",
    "simulate",
    "systems",
    "view",
]

#: Where names are defined: modules of the package, and what is taken from each.
_HOMES: dict[str, tuple[str, ...]] = {
    "analysis.climb": ("Climb", "climb"),
    "analysis.densify": ("Samples", "densify"),
    "analysis.pareto": ("pareto_front",),
    "analysis.peaks": ("Peak", "local_maxima", "peaks_of"),
    "analysis.refine": ("refine",),
    "atlas.atlas": ("Atlas",),
    "atlas.build": ("build_atlas",),
    "atlas.status": ("Closed", "Status"),
    "atlas.upper_bounds": ("estimate_upper_bounds",),
    "errors": ("GraspAtlasError",),
    "execution.approach": ("Approach",),
    "execution.contact_forces": ("ContactForces",),
    "execution.pregrasp": ("Pregrasp",),
    "formats.export": ("export_grasps",),
    "grasps.grasp": ("Grasp",),
    "grasps.grasps": ("Grasps",),
    "hand": ("motions",),
    "hand.body": ("Body",),
    "hand.hand": ("Hand",),
    "hand.motions": ("HandMotions",),
    "meshes.repair": ("Repair", "repaired"),
    "optimizer.components": ("Components", "SearchStatus", "find_components"),
    "optimizer.ladder": ("ladder",),
    "optimizer.ladder_outcome": ("Ladder",),
    "optimizer.optimize": ("optimize",),
    "optimizer.rungs": ("Rung",),
    "pads.find": ("find_pads",),
    "pads.pad": ("Pad",),
    "paths.path": ("GraspPath", "Path"),
    "paths.shortest_path": ("shortest_path",),
    "problem.contacts": ("Contact",),
    "problem.first_grasp": ("FirstGrasp",),
    "problem.pose_guess": ("PoseGuess",),
    "problem.problem": ("Problem",),
    "problems": ("bundled_problems", "load_problem"),
    "proposals.outcome": ("Proposal", "Proposals", "ProposalsEnd"),
    "proposals.propose": ("propose",),
    "quality.batched": ("batched",),
    "regions.find": ("find_regions",),
    "regions.region": ("Region",),
    "reach.reach": ("Reach", "ReachStatus"),
    "requirements.collision_free": ("CollisionFree",),
    "requirements.force_closure": ("ForceClosure",),
    "requirements.holding_force": ("HoldingForce",),
    "requirements.joint_margin": ("JointMargin",),
    "requirements.reachable": ("Reachable",),
    "requirements.rejections": ("Rejection",),
    "result.gap": ("Gap",),
    "result.refinement": ("Refinement", "SearchReport"),
    "result.result": ("Result", "load_result"),
    "search.grasp_search": ("find_grasps",),
    "simulation.outcome": ("Simulation", "load_simulation"),
    "simulation.recording": ("Recording", "record"),
    "simulation.runs": ("simulate",),
    "systems.projection": ("project",),
    "systems.system": ("System",),
    "viewer": ("export_html", "save_picture", "view"),
    "viewer.figures": (
        "plot_atlas",
        "plot_best_and_worst",
        "plot_climbs",
        "plot_ellipsoid",
        "plot_growth",
        "plot_holding",
        "plot_ladder",
        "plot_local_maxima",
        "plot_pareto",
        "plot_planar_grasp",
        "plot_planar_indices",
    ),
    "world.arm": ("Arm",),
    "world.obstacle": ("Obstacle",),
    "world.pose": ("Pose",),
}
_MODULE_OF = {name: module for module, names in _HOMES.items() for name in names}
#: Imported with a module: problems state requirements by the names under which these enter themselves.
_WITH = {"problem.problem": "requirements.named"}


def __getattr__(name: str) -> typing.Any:
    """A public name, or a module of the package, imported on first use."""
    module = _MODULE_OF.get(name)
    if module is None:
        return _module(name)
    if module in _WITH:
        importlib.import_module(f"{__name__}.{_WITH[module]}")
    found = getattr(importlib.import_module(f"{__name__}.{module}"), name)
    globals()[name] = found
    return found


def _module(name: str) -> typing.Any:
    """A module of the package by the name that follows the package's."""
    full = f"{__name__}.{name}"
    try:
        if not name.startswith("_"):
            return importlib.import_module(full)
    except ModuleNotFoundError as error:
        if error.name != full:
            raise
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    """What there is, imported or not."""
    return sorted({*globals(), *__all__})
