"""Quality indices of grasps."""

from graspatlas.quality.evaluation import (
    INDICES,
    Quality,
    batched,
    evaluate,
    ferrari_canny_epsilon,
    ferrari_canny_volume,
    force_closure_margin,
    force_closure_slack,
    grasp_isotropy,
    inverse_condition_number,
    joint_centrality,
    manipulability_volume,
    min_weight,
    quality_name,
    smallest_semi_axis,
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
    "inverse_condition_number",
    "joint_centrality",
    "manipulability_volume",
    "min_weight",
    "quality_name",
    "smallest_semi_axis",
    "soft_finger_epsilon",
]
