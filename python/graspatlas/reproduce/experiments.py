"""The experiments of the paper's Section V, and its Fig. 7."""

from __future__ import annotations

import sys
from collections.abc import Callable

from graspatlas.atlas.build import build_atlas
from graspatlas.atlas.status import Status
from graspatlas.reproduce.climbing import MAX_STEPS, Study, study
from graspatlas.reproduce.findings import (
    add_box_starts,
    add_components,
    add_holding_of_best,
    holding,
    more_dimensions_claim,
    variance_claim,
)
from graspatlas.reproduce.holds import holds
from graspatlas.reproduce.report import Claim, Number, Plate, Section
from graspatlas.reproduce.runs import Setting, numbers_of, run
from graspatlas.result.result import Result
from graspatlas.systems.system import Sphere
from graspatlas.viewer.figures import (
    plot_atlas,
    plot_best_and_worst,
    plot_climbs,
    plot_growth,
    plot_local_maxima,
    plot_planar_indices,
)
from graspatlas.viewer.figures.indices import SINGULAR_BELOW, with_index

__all__ = ["EXPERIMENTS"]

PRINCIPAL = (
    "p1 to p3 are the principal coordinates of the chart centres in the metric of the atlas, with their share of the "
    "variance. Stars, circles and triangles show through what hides them."
)
NO_REQUIREMENTS = (
    " As in the paper no grasp is ruled out: what the bundled problem requires of a grasp is left aside, so the best "
    "by the index need not be one that can be executed."
)
ELLIPSE = (
    "Below the grasps: the manipulability ellipsoid on the plane of its longest and its shortest semi-axis, each "
    "direction to its own scale."
)
#: Stages of Fig. 7: number of charts.
STAGES = (40, 130, 100000)


def sphere(progress: bool) -> Section:
    """Fig. 7: the growth of an atlas over a sphere."""
    x0 = [0.0, -0.6, 0.8]
    stages = [build_atlas(Sphere(3), x0, radius=0.2, epsilon=0.2, max_charts=n, progress=False) for n in STAGES]
    if any(stage.status is Status.INTERRUPTED for stage in stages):
        raise KeyboardInterrupt
    last = stages[-1]
    section = Section(
        "sphere", "Fig. 7: an atlas over a sphere", "One equation in three variables, r 0.2, epsilon 0.2."
    )
    section.numbers = [
        Number("", "charts of the complete atlas", None, last.n_charts),
        Number("", "time for the atlas", None, last.seconds, "s"),
        Number("", "area of all polygons; the sphere has 12.566", None, float(last.volumes.sum())),
        Number("", "Euler characteristic; the sphere has 2", None, last.euler_characteristic()),
        Number("", "atlas", None, str(last.status)),
    ]
    section.plates.append(
        Plate(
            "figure_7_sphere.png",
            plot_growth(stages),
            "The paper's Fig. 7: three stages of an atlas over a sphere. Red charts are under expansion, blue ones are "
            "bounded.",
            f"Polygons that cover more and more of a sphere: {', '.join(str(s.n_charts) for s in stages)} charts.",
        )
    )
    return section


def planar_hand(progress: bool) -> Section:
    """Figs. 8 and 9: three fingers in the plane, three indices."""
    setting = Setting("planar_hand", 2, 0.125, 0.4, "inverse_condition_number")
    result = run(setting)
    section = Section(
        setting.problem,
        "Fig. 9: the planar hand",
        "Three fingers with two phalanges each hold an object of three arcs. All three indices are read on one atlas; "
        "lengths are in units of the problem's length scale, 100 mm. The paper does not print the hand's geometry; "
        "ours was chosen so that the paper's r gives about as many charts.",
    )
    section.numbers = numbers_of(result, setting)
    section.plates.append(
        Plate(
            "figure_9_planar_hand.png",
            plot_planar_indices(result),
            "The paper's Fig. 9: the atlas with (a) the inverse condition number, (b) the volume and (c) the smallest "
            "semi-axis, from red (low) to green (high); singular charts are black. Left: the best, the worst and a "
            "local maximum by (a), with their ellipsoids. A singular grasp has a finger stretched, as in the paper. "
            + PRINCIPAL,
            "A curved surface of polygons, six times: three indices, each from above and from below; beside it three "
            "planar grasps with their ellipses.",
        )
    )
    for name in SINGULAR_BELOW:
        scaled = with_index(result, name)
        section.numbers += _index_numbers(scaled, name)
        _add_local_search(section, scaled, name, progress, with_maxima=name == setting.quality)
    add_components(section, setting, result)
    return section


def _index_numbers(result: Result, name: str) -> list[Number]:
    q, limit = result.qualities, SINGULAR_BELOW[name]
    run_name = name.replace("_", " ")
    return [
        Number(run_name, "best", None, float(q.max())),
        Number(run_name, "worst", None, float(q.min())),
        Number(run_name, "a chart is singular below", None, limit),
        Number(run_name, "singular charts", None, int((q < limit).sum())),
    ]


def schunk_can(progress: bool) -> Section:
    """Fig. 10a: the Schunk hand holds a can."""
    setting = Setting("schunk_can", 2, 0.17, 0.5, "manipulability_volume")
    result = run(setting)
    section = Section(
        setting.problem,
        "Fig. 10a: the Schunk hand holds a can",
        "Three fingers, 13 joints; the can is fixed to one finger, the other two touch anywhere on its side."
        + NO_REQUIREMENTS,
    )
    section.numbers = numbers_of(result, setting)
    section.plates.append(
        Plate(
            "figure_10a_schunk_can.png",
            plot_best_and_worst(result, label="volume [lengths in mm]"),
            "The paper's Fig. 10a: the worst grasp, the atlas coloured by the volume of the manipulability ellipsoid, "
            "and the best grasp. " + ELLIPSE + " " + PRINCIPAL,
            "A hand that holds a can badly, the atlas of all grasps, and the hand that holds the can best by volume.",
        )
    )
    volume = _add_local_search(section, result, setting.quality, progress)
    section.claims.append(
        Claim(
            "The best grasp is the one of the largest volume.",
            "On the can the volume has no maximum: it grows without bound where the three contact points come to lie "
            "on one line, because the object can then turn about that line while the joints stand still. The best "
            f"chart lies on that ridge, and {volume.unbounded} of {len(volume.climbs)} climbs ran up it until they "
            f"were stopped, after {MAX_STEPS} steps at most. So there is no best grasp by volume, only the best chart. "
            "The inverse condition number has no such ridge and is shown as well.",
        )
    )
    other = result.by("inverse_condition_number")
    add_box_starts(section, other, "inverse condition number")
    _add_local_search(section, other, "inverse_condition_number", progress)
    section.claims.append(variance_claim(result))
    add_components(section, setting, other)
    add_holding_of_best(section, result)
    _add_holding(section, result, progress)
    return section


def _add_holding(section: Section, result: Result, progress: bool) -> None:
    """The best of the grasps that hold: force closure, and no collision; and local searches among them."""
    held = holding(result)
    n = int(held.accepted.sum())
    run_name = "force closure at friction 0.5, no collision"
    section.numbers.append(Number(run_name, "charts that meet both", None, n))
    if n == 0:
        return
    section.numbers.append(Number(run_name, "best manipulability volume, lengths in mm", None, held.best.quality))
    section.numbers.append(Number(run_name, "worst manipulability volume, lengths in mm", None, held.worst.quality))
    section.plates.append(
        Plate(
            "schunk_can_that_holds.png",
            plot_best_and_worst(held, label="volume [lengths in mm]"),
            "Beyond the paper: the same atlas when a grasp must be force-closed at friction 0.5 and free of collision. "
            f"{n} charts are; the others are grey. " + ELLIPSE,
            "The worst and the best of the grasps that hold the can, and where they lie on the atlas.",
        )
    )
    _add_local_search(section, held, "volume_of_grasps_that_hold", progress, with_maxima=False)


def schunk_oil_bottle(progress: bool) -> Section:
    """Fig. 10b: the Schunk hand holds an oil bottle, k = 2 and k = 3."""
    two = Setting("schunk_oil_bottle", 2, 0.04, 0.5, "manipulability_volume")
    three = Setting("schunk_oil_bottle", 3, 0.0575, 0.5, "manipulability_volume")
    results = {setting: run(setting) for setting in (two, three)}
    section = Section(
        two.problem,
        "Fig. 10b: the Schunk hand holds an oil bottle",
        "The index finger touches the bottle's top along a curve, the others its middle and bottom sections. The same "
        "problem is solved with seven hand motions frozen (k = 2) and with six (k = 3)." + NO_REQUIREMENTS,
    )
    for setting, result in results.items():
        section.numbers += numbers_of(result, setting, f"k = {setting.dimension}")
    section.plates += _bottle_plates(results[two], results[three])
    add_box_starts(section, results[two], "manipulability volume")
    _add_local_search(section, results[two], two.quality, progress)
    a, b = results[two].best.quality, results[three].best.quality
    section.numbers.append(Number("", "best at k = 3 over best at k = 2", None, b / a))
    section.claims.append(more_dimensions_claim(a, b))
    section.claims.append(variance_claim(results[three]))
    add_components(section, two, results[two])
    add_holding_of_best(section, results[two])
    return section


def _bottle_plates(two: Result, three: Result) -> list[Plate]:
    return [
        Plate(
            "figure_10b_schunk_oil_bottle.png",
            plot_best_and_worst(two, label="volume [lengths in mm]"),
            "The paper's Fig. 10b: the worst grasp, the atlas at k = 2 coloured by volume, and the best grasp. "
            + ELLIPSE
            + " "
            + PRINCIPAL,
            "A hand that holds an oil bottle badly, the atlas of all grasps, and the hand that holds the bottle best.",
        ),
        Plate(
            "oil_bottle_k3.png",
            plot_atlas(three, label="volume [lengths in mm]"),
            f"The atlas at k = 3: the centres of its {three.atlas.n_charts} charts, coloured by volume. " + PRINCIPAL,
            "A solid cloud of chart centres from above and from below.",
        ),
    ]


def _add_local_search(
    section: Section, result: Result, name: str, progress: bool, *, with_maxima: bool = True
) -> Study:
    """Climb from random charts, and report what came of it."""
    words = name.replace("_", " ")
    print(f"{section.name}: local searches on the {words}", file=sys.stderr) if progress else None
    outcome = study(result, section.name, progress=progress)
    section.numbers += outcome.numbers(words)
    stem = f"{section.name}_{name}"
    if with_maxima:
        section.plates.append(
            Plate(
                f"local_maxima_{stem}.png",
                plot_local_maxima(result),
                f"Local maxima of the {words}: charts that no neighbour beats. " + PRINCIPAL,
                "An atlas with its local maxima marked, and their values as bars.",
            )
        )
    section.plates.append(
        Plate(
            f"local_search_{stem}.png",
            plot_climbs(result, outcome.climbs, from_best=outcome.from_best),
            f"The local optimiser on the {words}. Left: the index at the start and at the end of each climb; the line "
            "is the best chart. Right: how many climbs ended at each peak.",
            outcome.sentence,
        )
    )
    section.claims.append(Claim(f"A local method is trapped in local extrema: the {words}.", outcome.sentence))
    return outcome


#: Experiments by name, in the order of the paper.
EXPERIMENTS: dict[str, Callable[[bool], Section]] = {
    function.__name__: function for function in (sphere, planar_hand, schunk_can, schunk_oil_bottle, holds)
}
