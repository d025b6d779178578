"""Globally best grasps: an atlas of all feasible grasps, and any quality index read on it."""

from graspatlas import motions, patches, quality, systems
from graspatlas.atlas import Atlas, Closed, Status
from graspatlas.contacts import Contact, FirstGrasp
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps import Grasp, Grasps
from graspatlas.hand import Body, Hand
from graspatlas.motions import HandMotions
from graspatlas.optimizer import build_atlas, optimize
from graspatlas.problem import Problem
from graspatlas.problems import bundled_problems, load_problem
from graspatlas.quality import batched
from graspatlas.requirements import CollisionFree, ForceClosure, JointMargin
from graspatlas.result import Result, load_result
from graspatlas.systems import System
from graspatlas.viewer import export_html, save_picture, view

__version__ = "0.1.0"

__all__ = [
    "Atlas",
    "Body",
    "Closed",
    "CollisionFree",
    "Contact",
    "FirstGrasp",
    "ForceClosure",
    "Grasp",
    "GraspAtlasError",
    "Grasps",
    "Hand",
    "HandMotions",
    "JointMargin",
    "Problem",
    "Result",
    "Status",
    "System",
    "batched",
    "build_atlas",
    "bundled_problems",
    "export_html",
    "load_problem",
    "load_result",
    "motions",
    "optimize",
    "patches",
    "quality",
    "save_picture",
    "systems",
    "view",
]
