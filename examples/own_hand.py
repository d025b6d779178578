# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Hold a jar with a hand that graspatlas does not know, from its URDF to the best grasp; everything stated in Python.

The hand is ``own_hand/three_fingers.urdf``, three fingers of four joints. ``own_hand/jar.yaml`` states the same problem
as a file, and ``docs/from_urdf.md`` explains each step. Here it is put together in Python, step by step, with a look at
what the hand motions cost: each coupling that is let go adds a dimension, and better grasps with it.

Run it with ``python examples/own_hand.py`` (half a minute); it writes a picture and a page to ``out/own_hand``.
"""

from pathlib import Path

import numpy as np

import graspatlas as ga

URDF = Path(__file__).parent / "own_hand" / "three_fingers.urdf"
FINGERS = ("thumb", "left", "right")
BALL = np.array([0.0, 0.0, 0.025])  # centre of the ball at the end of a finger's last link, in that link's frame [m]
BALL_RADIUS = 0.008  # [m]
INWARDS = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)  # from there to the pad
JAR_RADIUS, JAR_HEIGHT = 0.03, 0.1  # [m]
RIM = 0.005  # what the fingers leave free at top and bottom [m]
GUESS = ga.PoseGuess((0.0, 0.0, 0.09), (0.0, 0.0, 0.0, 1.0))  # upright, its middle so far above the palm [m]
HOLDS = (ga.ForceClosure(friction=0.5, margin=0.02), ga.CollisionFree())
LAST_JOINTS = [{f"{finger}_dip": 1.0, f"{finger}_pip": -0.8} for finger in FINGERS]
SPREADS = [{"thumb_spread": 1.0}, {"left_spread": 1.0, "right_spread": 1.0}]


def pad_moves_inwards(hand: ga.Hand, finger: str) -> bool:
    """Whether a pad moves along its normal when the finger bends; if not, the normal is the wrong way round."""
    link, q = f"{finger}_distal", np.zeros(len(hand.joints))
    before = hand.link_placements(q)[link]
    q[hand.joints.index(f"{finger}_pip")] = 0.01
    after = hand.link_placements(q)[link]
    pad = np.append(BALL + BALL_RADIUS * INWARDS, 1.0)
    return bool(((after - before) @ pad)[:3] @ (before[:3, :3] @ INWARDS) > 0.0)


def jar_problem(hand: ga.Hand, couplings: list[dict[str, float]]) -> ga.Problem:
    """The hand and the jar, with a first grasp that is found.

    Args:
        hand: The hand.
        couplings: Sums of joints that keep the value they have in a straight hand.
    """
    pad = ga.patches.Point(tuple(BALL + BALL_RADIUS * INWARDS), tuple(INWARDS))
    height = JAR_HEIGHT / 2.0 - RIM
    wall = ga.patches.Cylinder(radius=JAR_RADIUS, axis=(0.0, 0.0, 1.0), v_interval=(-height, height))
    # The jar is round: where the thumb touches round it is frozen, or it could spin while the hand stays still.
    frozen = {"thumb": {"u": np.pi, "v": 0.0}}
    return ga.Problem(
        name="jar",
        hand=hand,
        object=ga.Body.cylinder("jar", JAR_RADIUS, JAR_HEIGHT),
        contacts=tuple(ga.Contact(f"{finger}_distal", pad, wall, frozen.get(finger, {})) for finger in FINGERS),
        motions=ga.HandMotions.from_couplings(couplings, hand.joints),
        pose_guess=GUESS,
    )


def best_grasps(problem: ga.Problem, radius: float) -> ga.Result:
    """Trace all grasps that the couplings leave, and print what they cost and what they bring."""
    dimension = problem.full_dimension - len(problem.motions.couplings)
    options = {"dimension": dimension, "radius": radius, "epsilon": 0.5, "quality": "manipulability_volume"}
    result = ga.optimize(problem, **options, require=HOLDS, refine=True)
    print(f"k = {dimension}, r = {radius}: {result.atlas.n_charts} grasps in {result.atlas.seconds:.2f} s, ", end="")
    print(f"{result.status}; {result.accepted.sum()} hold; best {result.refined_best.quality:.5g}")
    return result


def main() -> None:
    """Check the pads, search with all couplings and with one less, halve the radius, print and draw the best grasp."""
    hand = ga.Hand.from_urdf(URDF)
    print(f"{len(hand.joints)} joints; pads that move inwards: {[pad_moves_inwards(hand, name) for name in FINGERS]}")

    problem = jar_problem(hand, LAST_JOINTS + SPREADS)
    x1 = problem.at(ga.find_grasps(problem, dimension=2)[0]).x1
    print(f"t = {problem.full_dimension}; a first grasp has the jar at {np.round(x1.object_xyz, 4)} m")

    for radius in (0.4, 0.2, 0.1):
        result = best_grasps(problem, radius)  # the same best each time: the charts are small enough

    # The thumb may spread too: one coupling less, one dimension more. The best grasp is the same, so it costs nothing.
    best_grasps(jar_problem(hand, LAST_JOINTS + SPREADS[1:]), radius=0.3)

    best = result.refined_best
    print("joints [rad]:", {name: round(angle, 3) for name, angle in best.joint_positions.items()})
    print("jar in the palm's frame:", best.object_xyz.round(4), "m, quaternion xyzw", best.object_quat_xyzw.round(4))

    folder = Path("out/own_hand")
    folder.mkdir(parents=True, exist_ok=True)
    result.save(folder / "result.npz")
    ga.save_picture(result, folder / "jar.png", width=960, height=540)
    ga.export_html(result, folder / "jar.html")
    print(f"written to {folder}; look at it with: graspatlas view {folder}")


if __name__ == "__main__":
    main()
