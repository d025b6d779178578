"""Write grasps of a result in the formats of simulators and controllers."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from graspatlas.errors import unknown_name
from graspatlas.formats.dexgraspbench import write_dexgraspbench
from graspatlas.formats.hand_over import HandOver, hand_over
from graspatlas.formats.isaac_grasp import write_isaac_grasp
from graspatlas.formats.mjcf_scene import write_mjcf
from graspatlas.formats.moveit import write_moveit
from graspatlas.requirements.force_closure import stated_friction
from graspatlas.result.exports import select
from graspatlas.result.grasp_atlas import GraspAtlas, check_is_result

__all__ = ["FORMATS", "export_grasps"]

#: Coefficient of friction where no requirement states one.
FRICTION = 0.5
#: The formats of ``export_grasps`` by name, with the functions that write them.
FORMATS: dict[str, Callable[[HandOver, Path], None]] = {
    "isaac_grasp": write_isaac_grasp,
    "dexgraspbench": write_dexgraspbench,
    "mjcf": write_mjcf,
    "moveit": write_moveit,
}


def export_grasps(
    result: GraspAtlas,
    path: str | os.PathLike[str],
    format: str,
    *,
    charts: Sequence[int] | None = None,
    best: int | None = None,
    refined: bool = False,
    distance: float = 0.01,
    normal_force: float | None = None,
    friction: float | None = None,
    torsional: float | None = None,
    stiffness: float = 5.0,
) -> int:
    """Write grasps with pregrasp, grasp and squeeze for another program.

    Args:
        result: The result.
        path: The file; of ``dexgraspbench`` a folder, which gets one file a grasp.
        format: ``"isaac_grasp"`` (YAML), ``"dexgraspbench"`` (NumPy), ``"mjcf"`` (a scene of MuJoCo) or ``"moveit"``
            (YAML of ``moveit_msgs/Grasp``).
        charts: Only these charts, in this order.
        best: Only so many, the best that meet the requirements; by default the best alone.
        refined: Put the refined best before the others.
        distance: From the object at which the fingertips begin [m].
        normal_force: Sum of the normal forces of the squeeze [N]; by default 5 N a contact.
        friction: Coefficient of friction for the contact forces; by default that of the result's requirement
            force_closure, or else 0.5.
        torsional: Torsional friction [m]; by default that of the same requirement, or else 0.
        stiffness: Of the position actuators [N m/rad].

    Returns:
        How many grasps were written.

    Raises:
        GraspAtlasError: If there is no such format or chart, friction does not close a grasp, or the path cannot be
            written.
    """
    check_is_result(result)
    if format not in FORMATS:
        raise unknown_name("format", format, FORMATS)
    chosen = select(result, charts=charts, best=1 if charts is None and best is None else best, refined=refined)
    stated = stated_friction(result.requirements) or (FRICTION, 0.0)
    grasps = hand_over(
        chosen,
        distance=distance,
        normal_force=normal_force,
        friction=stated[0] if friction is None else friction,
        torsional=stated[1] if torsional is None else torsional,
        stiffness=stiffness,
    )
    FORMATS[format](grasps, Path(path))
    return len(grasps)
