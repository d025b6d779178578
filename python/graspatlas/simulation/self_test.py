"""Whether trials on this machine show what is known: one grasp that holds, and the same one on ice."""

from __future__ import annotations

from dataclasses import replace

from graspatlas.grasps.grasps import Grasps
from graspatlas.problems import load_problem
from graspatlas.simulation.outcome import Simulation
from graspatlas.simulation.protocols import PROTOCOLS
from graspatlas.simulation.runs import simulate_grasps

__all__ = ["KNOWN_PROBLEM", "self_test"]

#: The first grasp of this bundled problem survives all pushes of ``dexgraspbench``.
KNOWN_PROBLEM = "allegro_sphere_4"
#: And none of them with hardly any friction.
ICE = 0.02


def self_test() -> tuple[Simulation, Simulation, bool]:
    """Try a grasp whose outcome is known, under ``dexgraspbench`` and with hardly any friction.

    Returns:
        Both trials, and whether they show what is known: all pushes survived, and the object lost.

    Raises:
        GraspAtlasError: If MuJoCo is not installed.
    """
    problem = load_problem(KNOWN_PROBLEM)
    grasps = Grasps(problem, problem.x1_array)
    usual = PROTOCOLS["dexgraspbench"]
    held = simulate_grasps(grasps, protocol=usual)
    lost = simulate_grasps(grasps, protocol=replace(usual, name="on ice", friction=ICE, torsional=0.0))
    return held, lost, bool(held.held[0]) and not lost.survived[0].any()
