# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Hold an egg with a BarrettHand, a hand whose joints are coupled: four motors turn eight joints.

Hand, egg and problem are the files in ``examples/barrett``: a URDF without ``<mimic>``, whose couplings stand in
``egg.yaml`` instead, a mesh that is seen and collides, and its outline as the surface that is touched. The first grasp
is found near a guess of where the egg is.

Run it with ``python examples/barrett.py``; it writes a picture and a page to ``out/barrett_egg``. With ``--spread`` the
spread may change too: three dimensions instead of two, and a minute instead of seconds.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import graspatlas as ga

FILE = Path(__file__).parent / "barrett" / "egg.yaml"


def motors(best: ga.Grasp) -> dict[str, float]:
    """What the four motors are told in a grasp [rad]; all other joints follow."""
    names = ("f1_spread", "f1_inner", "f2_inner", "f3_inner")
    return {name: round(best.joint_positions[name], 3) for name in names}


def best_grasp(problem: ga.Problem, **options: float) -> ga.Result:
    """Trace all grasps, climb to the best that holds, and say what it cost."""
    start = time.perf_counter()
    result = ga.optimize(problem, **options, refine=True)
    seconds = time.perf_counter() - start
    print(
        f"t = {problem.full_dimension}, k = {result.dimension}: {result.atlas.n_charts} grasps, {result.status}; ",
        end="",
    )
    print(f"{result.accepted.sum()} hold; {seconds:.1f} s; best {result.refined_best.quality:.4g}")
    return result


def main() -> None:
    """Find the best grasp with a fixed spread or a free one, print what the motors do, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spread", action="store_true", help="let the spread change: k = 3")
    options = parser.parse_args()

    problem = ga.load_problem(FILE)
    if options.spread:
        free = replace(problem.motions, couplings=problem.motions.couplings[:-1])
        result = best_grasp(replace(problem, motions=free), dimension=3, radius=0.4)
    else:
        result = best_grasp(problem)
    best = result.refined_best
    print("motors [rad]:", motors(best))
    leans = np.degrees(np.arccos(best.T_palm_object[2, 2]))
    print(f"the egg is at {best.object_xyz.round(4)} m in the palm's frame, and leans by {leans:.1f} degrees")

    folder = Path("out/barrett_egg")
    folder.mkdir(parents=True, exist_ok=True)
    ga.save_picture(result, folder / "best.png", width=640, height=480, worst=False)
    ga.export_html(result, folder / "grasps.html")
    print(f"written to {folder}: best.png, and grasps.html to rotate in a browser")


if __name__ == "__main__":
    main()
