# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Hold a ball, a box or a cylinder with three or four fingers of the Allegro hand, as well as it can be held.

Run it with ``python examples/allegro.py``, or name object and fingers: ``python examples/allegro.py box 3``. It writes
a picture and a page to a folder in ``out``. The problems are YAML files in ``python/graspatlas/problems``; copy one to
begin with an object or a hand of your own.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import graspatlas as ga

#: What a grasp must do to count: resist any push with friction 0.5, and touch nothing but with the fingertips.
HOLDS = (ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree())
FINGERS = {"link_3.0_tip": "index", "link_7.0_tip": "middle", "link_11.0_tip": "ring", "link_15.0_tip": "thumb"}


def main() -> None:
    """Trace all grasps, climb to the best that holds, say how it looks, and write pictures of it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("object", nargs="?", choices=("sphere", "box", "cylinder"), default="sphere")
    parser.add_argument("fingers", nargs="?", type=int, choices=(3, 4), default=4)
    options = parser.parse_args()

    problem = ga.load_problem(f"allegro_{options.object}_{options.fingers}")
    print_freedoms(problem)
    start = time.perf_counter()
    result = ga.optimize(problem, require=HOLDS, refine=True)
    seconds = time.perf_counter() - start
    print_result(result, seconds)

    folder = Path("out") / problem.name
    folder.mkdir(parents=True, exist_ok=True)
    ga.save_picture(result, folder / "best.png", width=640, height=480, worst=False)
    ga.export_html(result, folder / "grasps.html")
    print(f"written to {folder}: best.png, and grasps.html to rotate in a browser")


def print_freedoms(problem: ga.Problem) -> None:
    """Say how many freedoms there are, and where they go."""
    joints, contacts = len(problem.hand.joints), len(problem.contacts)
    free = sum(len(contact.free()) for contact in problem.contacts)
    t, couplings = problem.full_dimension, len(problem.motions.couplings)
    print(f"{problem.name}: {joints} joints, 6 freedoms of the object and {free} of the places where it is touched,")
    print(f"less 5 for each of {contacts} contacts: t = {t}; {couplings} couplings of joints leave k = {t - couplings}")


def print_result(result: ga.Result, seconds: float) -> None:
    """Say how many grasps there are and what the best one is, in the palm's frame."""
    atlas, best = result.atlas, result.refined_best
    print(f"{atlas.n_charts} grasps, {result.status}, {result.accepted.sum()} hold; {seconds:.1f} s in all")
    print(f"worst that holds {result.worst.quality:.3g}, best chart {result.best.quality:.3g}, best {best.quality:.4g}")
    grasps = ga.Grasps(result.problem, best.x)
    margin = float(ga.quality.force_closure_margin(grasps, friction=0.5)[0])
    x, y, z = 1000.0 * best.object_xyz
    print(f"in the best grasp the object is at ({x:.0f}, {y:.0f}, {z:.0f}) mm; force-closure margin {margin:.3f}")
    for contact, point in zip(result.problem.contacts, best.contact_points, strict=True):
        x, y, z = 1000.0 * point
        print(f"  {FINGERS[contact.frame]:6} touches it at ({x:5.1f}, {y:5.1f}, {z:5.1f}) mm")


if __name__ == "__main__":
    main()
