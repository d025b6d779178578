# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Let the thumb's domed fingertip roll on the can, and see what it gains over a thumb that touches with a fixed point.

The paper's contacts hold a fixed point of the hand against a region of the object. Here the thumb carries a region too:
the cap of a sphere around that point, so that both sides of the contact have free parameters (region-region contact,
which the paper leaves as future work). Each free parameter of the cap adds one dimension to the feasible grasps.

To compare like with like, both searches freeze the same hand motions, both ask for force closure and for no collision,
and the cap contains the fixed point. So every grasp of the first search is one of the second, whose dimension k is
larger by the number of free parameters.

Run it with ``python examples/rolling_fingertip.py`` (a few seconds); it writes a picture to ``out/rolling_fingertip``.
"""

from dataclasses import replace
from pathlib import Path

import graspatlas as ga
from graspatlas.patches import Sphere

RADIUS = 0.008  # of the fingertip's dome [m]
HALF_ANGLE = 0.4  # that the dome spans on either side of the fixed point [rad]
HOLDS = [ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree()]


def with_dome(problem: ga.Problem, frame: str, frozen: dict[str, float]) -> ga.Problem:
    """The problem with a sphere's cap instead of the fixed point on one fingertip.

    Args:
        problem: A problem with a fixed point on that fingertip.
        frame: The fingertip.
        frozen: Parameters of the cap that do not move; u = v = 0 is the fixed point.
    """
    contacts = []
    for contact in problem.contacts:
        if contact.frame == frame:
            dome = Sphere.cap(contact.hand.position, contact.hand.normal, RADIUS, HALF_ANGLE)
            contact = replace(contact, hand=dome, hand_frozen=frozen)
        contacts.append(contact)
    return replace(problem, contacts=tuple(contacts))


def search(problem: ga.Problem, dimension: int) -> ga.Result:
    """Trace all grasps of dimension k; the index is how fast the hand moves the object in the worst direction."""
    result = ga.optimize(
        problem, dimension=dimension, radius=0.25, epsilon=0.5, quality="smallest_semi_axis", require=HOLDS
    )
    print(f"  k = {dimension}, {problem.frozen_motions(dimension)} hand motions frozen: {result.atlas.n_charts} grasps")
    print(f"  in {result.atlas.seconds:.1f} s, {result.status}; {result.accepted.sum()} hold")
    return result


def main() -> None:
    """Search with the fixed point, then with the thumb rolling one way, and print both best indices."""
    point = ga.load_problem("schunk_can")
    rolls_both_ways = with_dome(point, "thumb_distal", {})
    rolls = with_dome(point, "thumb_distal", {"u": 0.0})
    for name, problem in (("fixed point", point), ("rolling one way", rolls), ("both ways", rolls_both_ways)):
        error = ga.systems.jacobian_error(problem.full_system, problem.x1_array)
        print(f"{name}: t = {problem.full_dimension}, error of the Jacobian {error:.0e}")

    print("thumb touches with one fixed point:")
    fixed = search(point, dimension=2)
    print("thumb rolls one way:")
    rolling = search(rolls, dimension=3)
    best, gain = rolling.best, rolling.best.quality / fixed.best.quality
    print(f"smallest semi-axis: fixed {fixed.best.quality:.3f}, rolling {best.quality:.3f}, {gain:.2f} times as much")
    rolled = best.x[rolling_index(rolls)]
    print(f"the best grasp rolls the thumb by {rolled:.2f} rad, {1000 * RADIUS * abs(rolled):.1f} mm on its dome")

    folder = Path("out/rolling_fingertip")
    folder.mkdir(parents=True, exist_ok=True)
    ga.save_picture(rolling, folder / "grasps.png")
    print(f"written to {folder}")


def rolling_index(problem: ga.Problem) -> int:
    """Place in x of the rolling angle: the free parameters stand last, contact by contact, hand before object."""
    free = [patch for contact in problem.contacts for patch, _ in contact.free()]
    return len(problem.x1_array) - len(free) + [isinstance(patch, Sphere) for patch in free].index(True)


if __name__ == "__main__":
    main()
