# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Two figures of a result of your own: an atlas with its local maxima, and what a local optimiser makes of it.

Run it with ``python examples/figures.py``; it writes three pictures to ``out/figures``. In a notebook a figure at the
end of a cell is shown.
"""

from pathlib import Path

import numpy as np

import graspatlas as ga

STARTS = 40


def reach(grasp: ga.Grasp) -> float:
    """How far from the palm's middle the object is held, metres: an index of our own."""
    return float(np.linalg.norm(grasp.object_xyz[:2]))


def main() -> None:
    """Trace a planar hand's grasps, draw them, and climb from random charts."""
    problem = ga.load_problem("planar_hand")
    result = ga.optimize(problem, quality="manipulability_volume")
    folder = Path("out/figures")
    folder.mkdir(parents=True, exist_ok=True)

    maxima = ga.local_maxima(result)
    print(f"{result.atlas.n_charts} charts, {len(maxima)} local maxima: {np.round(result.qualities[maxima], 1)}")
    ga.plot_local_maxima(result).savefig(folder / "local_maxima.png")

    # Where does a local optimiser end? The atlas knows the best grasp; a climb from a random chart may not find it.
    starts = np.random.default_rng(0).choice(result.atlas.n_charts, STARTS, replace=False)
    climbs = [ga.climb(result, int(chart)) for chart in starts]
    for peak in ga.peaks_of(result, climbs):
        print(f"  {len(peak.climbs):3} of {STARTS} climbs end at {peak.quality:.1f}")
    ga.plot_climbs(result, climbs).savefig(folder / "climbs.png")

    # The figures take any index; here the atlas is coloured by one of our own, and its axes are left to the figure.
    own = ga.optimize(problem, quality=reach)
    figure = ga.plot_atlas(own, label="distance from the palm's middle [m]")
    figure.savefig(folder / "reach.png", dpi=300)  # also .pdf or .svg, for a paper
    print(f"written to {folder}")


if __name__ == "__main__":
    main()
