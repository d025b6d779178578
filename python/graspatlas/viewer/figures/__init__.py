"""Figures of a result for a paper or a notebook; each function returns a matplotlib figure.

They need neither window nor display: ``figure.savefig("atlas.png")`` writes one, and a notebook shows it.
"""

from graspatlas.viewer.figures.atlas import plot_atlas, plot_growth
from graspatlas.viewer.figures.ellipse import plot_ellipsoid
from graspatlas.viewer.figures.extremes import plot_best_and_worst
from graspatlas.viewer.figures.holding import plot_holding
from graspatlas.viewer.figures.indices import plot_planar_indices
from graspatlas.viewer.figures.ladder import plot_ladder
from graspatlas.viewer.figures.maxima import plot_climbs, plot_local_maxima
from graspatlas.viewer.figures.pareto import plot_pareto
from graspatlas.viewer.figures.planar import plot_planar_grasp
from graspatlas.viewer.scene.polygons import Coordinates, object_pose, principal

__all__ = [
    "Coordinates",
    "object_pose",
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
    "principal",
]
