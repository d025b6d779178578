# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Find the best grasp of a can by the 13-joint Schunk hand, with an index of the paper and with one of your own.

Run it with ``python examples/schunk_can.py``; it writes a picture, a page and the result to ``out/schunk_can``.
"""

from pathlib import Path

import numpy as np

import graspatlas as ga


@ga.batched
def spread(grasps: ga.Grasps) -> np.ndarray:
    """Smallest distance between two contact points [n], metres: an index of our own, for all grasps at once."""
    points = grasps.contact_points
    pairs = [(0, 1), (0, 2), (1, 2)]
    return np.min([np.linalg.norm(points[:, i] - points[:, j], axis=1) for i, j in pairs], axis=0)


def main() -> None:
    """Trace all relevant grasps once for each index, verify the first result, and write pictures of it."""
    problem = ga.load_problem("schunk_can")
    print(f"{problem.name}: all grasps form a manifold of dimension t = {problem.full_dimension}")
    kept = problem.motions.variance_kept(problem.frozen_motions(2))
    print(f"freezing {problem.frozen_motions(2)} of 13 hand motions keeps {100 * kept:.2f} % of the variance")

    options = {"dimension": 2, "radius": 0.17, "epsilon": 0.5, "quality": "manipulability_volume"}
    result = ga.optimize(problem, **options, require=[])  # as in the paper
    print(f"{result.atlas.n_charts} grasps in {result.atlas.seconds:.3f} s, {result.status}")
    print(f"best  {result.best}")
    print(f"worst {result.worst}")
    report = result.check()
    print(f"verified again from the problem alone: {'passed' if report else 'FAILED'}")

    # The index alone likes grasps with all fingers on one side of the can. Ask for one that holds, as the file does.
    result = ga.optimize(problem, require=[ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree()])
    print(f"{result.accepted.sum()} grasps hold; {result.rejected}")
    print(f"best  {result.best}")

    apart = ga.optimize(problem, quality=spread, require=[ga.CollisionFree()])
    print(f"contacts farthest apart: {1000 * apart.best.quality:.1f} mm at chart {apart.best.chart}")

    folder = Path("out/schunk_can")
    folder.mkdir(parents=True, exist_ok=True)
    result.save(folder / "result.npz")
    ga.save_picture(result, folder / "grasps.png")
    ga.export_html(result, folder / "grasps.html")
    print(f"written to {folder}; look at it with: graspatlas view {folder}")


if __name__ == "__main__":
    main()
