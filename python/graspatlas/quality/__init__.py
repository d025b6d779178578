"""Quality indices of grasps: larger is better, and a grasp to which an index does not apply has 0.

The first three read the manipulability ellipsoid of the object. The others ask how well contact forces hold the object
(see :mod:`graspatlas.quality.wrenches`), how evenly they act on it, and how free the joints are to move. How to write
one of your own is said in :mod:`graspatlas.quality.batched`.
"""

from graspatlas.quality.batched import Quality, batched, quality_name
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.quality.force_closure import force_closure_margin, force_closure_slack
from graspatlas.quality.holding_force import holding_force, resisted_load
from graspatlas.quality.manipulability import (
    inverse_condition_number,
    joint_centrality,
    manipulability_volume,
    smallest_semi_axis,
)
from graspatlas.quality.wrench_space import (
    ferrari_canny_epsilon,
    ferrari_canny_volume,
    grasp_isotropy,
    min_weight,
    soft_finger_epsilon,
)

__all__ = [
    "INDICES",
    "Quality",
    "batched",
    "evaluate",
    "ferrari_canny_epsilon",
    "ferrari_canny_volume",
    "force_closure_margin",
    "force_closure_slack",
    "grasp_isotropy",
    "holding_force",
    "inverse_condition_number",
    "joint_centrality",
    "manipulability_volume",
    "min_weight",
    "quality_name",
    "resisted_load",
    "smallest_semi_axis",
    "soft_finger_epsilon",
]
