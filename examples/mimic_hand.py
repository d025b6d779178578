# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Hold a cup with an underactuated hand: eight joints, four motors, and a coupling of your own on top.

Run it with ``python examples/mimic_hand.py``; it writes a picture, a page and the result to ``out/mimic_hand``.
"""

from pathlib import Path

import numpy as np

import graspatlas as ga


def main() -> None:
    """Trace the grasps that four motors and a coupling allow, and verify that the mimics hold."""
    problem = ga.load_problem("three_finger_cup")
    mechanism = problem.hand.mechanism
    print(f"{len(problem.hand.joints)} joints, actuated are {', '.join(mechanism.actuated)}; the others mimic:")
    for mimic in mechanism.mimics:
        print(f"  {mimic}")
    print(
        f"all grasps form a manifold of dimension t = {problem.full_dimension}; s = {problem.frozen_motions(2)} frozen"
    )

    result = ga.optimize(problem, refine=True)
    print(
        f"{result.atlas.n_charts} grasps in {result.atlas.seconds:.2f} s, {result.status}; {result.accepted.sum()} hold"
    )
    values = result.qualities[0], result.best.quality, result.refined_best.quality
    print(f"{result.quality}: first grasp {values[0]:.3f}, best {values[1]:.3f}, refined {values[2]:.3f}")
    off = np.abs(problem.mimic_residual(result.atlas.centers)).max()
    print(f"the mimics are off by {off:.0e} rad at most; verified: {'passed' if result.check() else 'FAILED'}")

    # A posture may leave out what mimics: the hand knows it.
    best = result.refined_best
    motors = {name: best.joint_positions[name] for name in mechanism.actuated}
    posture = mechanism.completed(motors, "the motors' posture")
    assert all(np.isclose(posture[name], angle) for name, angle in best.joint_positions.items())
    print("motors [rad]:", {name: round(angle, 3) for name, angle in motors.items()})

    folder = Path("out/mimic_hand")
    folder.mkdir(parents=True, exist_ok=True)
    result.save(folder / "result.npz")
    ga.save_picture(result, folder / "grasps.png", width=960, height=540)
    ga.export_html(result, folder / "grasps.html")
    print(f"written to {folder}; look at it with: graspatlas view {folder}")


if __name__ == "__main__":
    main()
