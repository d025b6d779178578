"""Make the pictures of gallery.md, and print the figures that it states.

Run it with ``python docs/make_gallery.py`` for all bundled problems, or with the names of some.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import graspatlas as ga

IMAGES = Path(__file__).parent / "images"
SIZE = {"width": 640, "height": 480}
#: Requirements for the paper's planar problem, whose file names none.
REQUIRE = {"planar_hand": (ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree())}


def main() -> None:
    """One picture and one line of figures for each problem."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("problem", nargs="*", help="bundled problems; all by default")
    parser.add_argument("--output", type=Path, default=IMAGES, metavar="FOLDER", help="where the pictures go")
    options = parser.parse_args()
    for name in options.problem or ga.bundled_problems():
        problem = ga.load_problem(name)
        start = time.perf_counter()
        result = ga.optimize(problem, require=REQUIRE.get(name, problem.requirements), refine=True)
        seconds = time.perf_counter() - start
        ga.save_picture(result, options.output / f"gallery_{name}.png", **SIZE, worst=False)
        quality = ga.quality.quality_name(result.quality).replace("_", " ")
        print(
            f"{name}: t = {problem.full_dimension}, k = {result.dimension}; {result.atlas.n_charts:,} charts, "
            f"{result.status}; {result.accepted.sum():,} meet the requirements; {seconds:.1f} s; "
            f"{quality} {result.refined_best.quality:.3g}"
        )


if __name__ == "__main__":
    main()
