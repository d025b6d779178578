"""What the paper's figures and counts leave out, measured: variance kept, components, whether the best grasps hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspatlas.collision.checker import CollisionChecker
from graspatlas.grasps.grasps import Grasps
from graspatlas.optimizer.components import find_components
from graspatlas.reproduce.box_starts import REACHED, multistart
from graspatlas.reproduce.climbing import SEED
from graspatlas.reproduce.published import RELEASED_RATIO
from graspatlas.reproduce.report import Claim, Number, Section
from graspatlas.reproduce.runs import Setting
from graspatlas.requirements.collision_free import CollisionFree
from graspatlas.requirements.force_closure import ForceClosure
from graspatlas.requirements.screening import screen
from graspatlas.result.result import Result

__all__ = [
    "add_box_starts",
    "add_components",
    "add_holding_of_best",
    "holding",
    "more_dimensions_claim",
    "variance_claim",
]

#: The search for components ends after so many grasps in a row that were covered, or after so much time [s].
COVERED = 60
COMPONENT_SECONDS = 30.0
#: Atlases of components are as coarse as this, in radii of the experiment: their number does not depend on it.
COARSER = 2.0
#: Processor time of the starts in the box [s].
BOX_SECONDS = 10.0
#: What the paper says of the hand motions that are kept, and of k = 3 against k = 2 [%].
KEPT = 99.0
ALMOST_THE_SAME = 5.0
FRICTION = 0.5
#: Share of starts that reach the best grasp from which on a local method is likely to find it.
LIKELY = 0.5


def variance_claim(result: Result) -> Claim:
    """The paper's "more than 99 % of the motion capability", by the variance of the recorded postures."""
    problem = result.problem
    assert problem.motions is not None
    frozen = (problem.frozen_motions(result.dimension), problem.frozen_motions(result.dimension) + 1)
    s, more = frozen
    kept, less = (100.0 * problem.motions.variance_kept(number) for number in frozen)
    verdict = "It does" if kept > KEPT else "It does not"
    deviation = 100.0 * float(np.sqrt(problem.motions.variance_kept(s)))
    return Claim(
        f"Freezing {s} of 13 hand motions keeps more than 99 % of the motion capability.",
        f"{verdict}, when motion is the variance of the recorded postures: {kept:.2f} % is kept, and {less:.2f} % with "
        f"{more} motions frozen ({deviation:.2f} % of the standard deviation with {s}). It says how the recorded "
        "people moved, not how large the set of grasps is that the frozen motions cut away: that set has dimension "
        f"{problem.full_dimension}, the one that is covered {result.dimension}.",
    )


def add_components(section: Section, setting: Setting, result: Result) -> None:
    """How many connected components are found, and whether another one than that of x1 is better."""
    found = find_components(
        result.problem,
        dimension=setting.dimension,
        radius=COARSER * setting.radius,
        epsilon=setting.epsilon,
        quality=result.quality,
        require=[],
        covered=COVERED,
        max_seconds=COMPONENT_SECONDS,
        seed=SEED,
        progress=False,
    )
    home = min(found.results, key=lambda r: r.atlas.locate(result.atlas.centers[0])[1])
    others = [r for r in found.results if r is not home]
    section.numbers += [
        Number("components", "connected components found", None, len(found)),
        Number("components", "random grasps found", None, found.found),
        Number("components", "the last of them, all in these components", None, found.covered),
        Number("components", "best chart of the component of the first grasp", None, home.best.quality),
        *(Number("components", "best chart of another component", None, r.best.quality) for r in others),
    ]
    words = (
        f"{len(found)} connected components were found by {found.found} random grasps, of which the last "
        f"{found.covered} lie in these ({found.status}). The atlas on this page covers that of the first grasp."
    )
    if others:
        ratio = max(r.best.quality for r in others) / home.best.quality
        words += (
            f" The best chart of the others has {ratio:.3g} times its best index, on charts {COARSER:g} times as large."
        )
    section.claims.append(Claim("The grid spans all relevant grasps that are attainable from a given one.", words))


def add_holding_of_best(section: Section, result: Result) -> None:
    """Whether the best grasp collides, and how many grasps are force-closed."""
    grasps = Grasps(result.problem, result.atlas.centers, result.system)
    closed = int(ForceClosure(FRICTION).met(grasps).sum())
    free = CollisionFree().met(grasps)
    depth = -1e3 * float(CollisionChecker(result.problem).clearances(result.best.x[None]).min())
    n = result.atlas.n_charts
    run = "does it hold?"
    section.numbers += [
        Number(run, f"charts that are force-closed at friction {FRICTION:g}, hard fingertips", None, closed),
        Number(run, "charts free of collision", None, int(free.sum())),
        Number(run, "deepest overlap of two bodies in the best grasp", None, max(depth, 0.0), "mm"),
    ]
    collides = f"collides: two bodies overlap by {depth:.1f} mm" if depth > 0.0 else "is free of collision"
    closes = f"{closed} of {n} charts are" if closed else f"none of {n} charts is"
    words = (
        f"Only by the index. The experiment asks for no more, but the best grasp here {collides}, and at friction "
        f"{FRICTION:g} {closes} force-closed with hard fingertips. {free.sum()} charts are free of collision."
    )
    stated = screen(result.problem.requirements, grasps)[0]
    if stated.any():
        names = ", ".join(map(str, result.problem.requirements))
        best = replace(result, requirements=tuple(result.problem.requirements), accepted=stated).best.quality
        words += (
            f" {stated.sum()} charts meet what the bundled problem asks for outside this page ({names}), the best of "
            f"them with an index of {best:.4g}."
        )
    section.claims.append(Claim("The best grasp is a good grasp.", words))


def holding(result: Result) -> Result:
    """The same result when a grasp must be force-closed and free of collision."""
    requirements = (ForceClosure(FRICTION), CollisionFree())
    grasps = Grasps(result.problem, result.atlas.centers, result.system)
    accepted, rejected = screen(requirements, grasps)
    return replace(result, requirements=requirements, accepted=accepted, rejected=rejected)


def add_box_starts(section: Section, result: Result, words: str) -> None:
    """SLSQP on the contact equations, from starts that are no grasps; the climbs on the manifold start from grasps."""
    ends = multistart(result, BOX_SECONDS, SEED, until_reached=False)
    run = f"SLSQP from a box, {words}"
    section.numbers += [
        Number(run, "starts", None, ends.starts),
        Number(run, "starts that ended off the contacts or outside the bounds", None, ends.infeasible),
        Number(run, "starts that ended at a worse grasp than the best chart", None, ends.local),
        Number(run, "starts that reached the best chart", None, ends.reached),
        Number(run, "best index found over that of the best chart", None, ends.best / result.best.quality),
    ]
    share = ends.reached / max(ends.starts, 1)
    verdict = "It is so here" if share < LIKELY else "It is not so here"
    section.claims.append(
        Claim(
            f"Local methods from a given configuration are not likely to find the best grasp: {words}, from a box.",
            f"{verdict} for SLSQP on the contact equations themselves, from random points in the box that the grasps "
            f"of the atlas fill, which a user would not know: of {ends.starts} starts in {BOX_SECONDS:.0f} s of "
            f"processor time {ends.infeasible} ended off the contacts or outside the bounds, {ends.local} at a worse "
            f"grasp, and {ends.reached} ({100.0 * share:.0f} %) came within {100.0 * (1.0 - REACHED):.1f} % of the "
            "best chart or above. For climbs that start from grasps and stay on the manifold see the next.",
        )
    )


def more_dimensions_claim(two: float, three: float) -> Claim:
    """The paper's k = 3 against k = 2 on the bottle, and why ours differs."""
    more = 100.0 * (three / two - 1.0)
    alike = more < ALMOST_THE_SAME
    verdict = "So it is here" if alike else "It is not so here"
    return Claim(
        "The best grasp at k = 3 is almost the same as at k = 2, so that six hand motions are enough.",
        f"{verdict}: the best volume is {two:.0f} at k = 2 and {three:.0f} at k = 3, {more:.0f} % more, a ratio of "
        f"{three / two:.3g} (lengths in mm). What is frozen decides. The paper's text, with 13 motions and s = 6, and "
        "this project freeze motions of joint angles; the implementation that the authors released freezes motions of "
        "dependent link coordinates. That is another set of relevant grasps R, and so another best: on the released "
        f"data its ratio is {RELEASED_RATIO:g} (reported for that implementation, not measured by this program)."
        + ("" if alike else " Neither reproduces the claim."),
    )
