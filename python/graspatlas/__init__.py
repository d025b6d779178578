"""Globally best grasps: an atlas of all feasible grasps, and any quality index read on it."""

from graspatlas import start_up as start_up  # first: the others take a second  # isort: skip

import importlib
import typing

from graspatlas import libraries, patches, quality, systems  # noqa: F401  (libraries first: it loads the compiled core)
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
from graspatlas.optimizer.components import Components, SearchStatus, find_components
from graspatlas.optimizer.ladder import ladder
from graspatlas.optimizer.ladder_outcome import Ladder
from graspatlas.optimizer.optimize import optimize
from graspatlas.optimizer.rungs import Rung
from graspatlas.paths.path import GraspPath, Path
from graspatlas.paths.shortest_path import shortest_path
from graspatlas.problem.contacts import Contact
from graspatlas.problem.first_grasp import FirstGrasp
from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.problem.problem import Problem
from graspatlas.problems import bundled_problems, load_problem
from graspatlas.quality.batched import batched
from graspatlas.requirements.collision_free import CollisionFree
from graspatlas.requirements.force_closure import ForceClosure
from graspatlas.requirements.holding_force import HoldingForce
from graspatlas.requirements.joint_margin import JointMargin
from graspatlas.result.gap import Gap
from graspatlas.result.refinement import Refinement, SearchReport
from graspatlas.result.result import Result, load_result
from graspatlas.search.grasp_search import find_grasps
from graspatlas.simulation.outcome import Simulation, load_simulation
from graspatlas.simulation.recording import Recording, record
from graspatlas.simulation.runs import simulate
from graspatlas.systems.projection import project
from graspatlas.systems.system import System
from graspatlas.version import __version__ as __version__
from graspatlas.viewer import export_html, save_picture, view

if typing.TYPE_CHECKING:
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

__all__ = [
    "Approach",
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
    "Path",
    "Peak",
    "PoseGuess",
    "Pregrasp",
    "Problem",
    "Recording",
    "Refinement",
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
    "quality",
    "record",
    "refine",
    "save_picture",
    "shortest_path",
    "simulate",
    "systems",
    "view",
]


def __getattr__(name: str) -> typing.Any:
    """Figures, imported on first use: matplotlib takes longer to import than an atlas to build."""
    if name.startswith("plot_") and name in __all__:
        return getattr(importlib.import_module("graspatlas.viewer.figures"), name)
    raise AttributeError(f"module 'graspatlas' has no attribute '{name}'")
