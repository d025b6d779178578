# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Hold a skittle with a parallel gripper: joints that mimic others, flat pads, soft fingers, and components.

Run it with ``python examples/gripper.py``; it writes a picture, a page and the result to ``out/gripper``.
"""

from pathlib import Path

import numpy as np

import graspatlas as ga

FRICTION = 0.5
#: The largest torque about a pad's normal, for a normal force of one newton: 2/3 mu a for a patch of radius a = 15 mm.
TORSIONAL = 0.005


@ga.batched
def askew(grasps: ga.Grasps) -> np.ndarray:
    """Angle between the pads' normal and the line through the contacts [n], degrees: what friction has to bear."""
    across = grasps.contact_points[:, 0] - grasps.contact_points[:, 1]
    cosines = np.einsum("nc,nc->n", across, grasps.contact_normals[:, 0]) / np.linalg.norm(across, axis=1)
    return np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))


def main() -> None:
    """Trace all grasps between the pads, choose among them, and look for others that no path leads to."""
    problem = ga.load_problem("gripper_skittle")
    print(f"the hand couples: {'; '.join(map(str, problem.hand.mechanism.mimics))}")
    print(f"all grasps form a manifold of dimension t = {problem.full_dimension}")

    result = ga.optimize(problem, refine=True)
    print(
        f"{result.atlas.n_charts} grasps in {result.atlas.seconds:.2f} s, {result.status}; {result.accepted.sum()} hold"
    )
    best, worst = result.refined_best, result.worst
    for name, grasp in (("best", best), ("worst", worst)):
        (angle,) = askew(ga.Grasps(problem, grasp.x))
        print(f"{name:5} {result.quality} {grasp.quality:.3f}, {angle:4.1f} degrees askew")
    print(f"verified again from the problem alone: {'passed' if result.check() else 'FAILED'}")

    # Two hard fingers never close a grasp: nothing resists a torque about the line through them.
    grasps = ga.Grasps(problem, best.x)
    for name, torsional in (("hard", 0.0), ("soft", TORSIONAL)):
        margin = ga.quality.force_closure_margin(grasps, FRICTION, torsional)[0]
        print(f"force-closure margin of the best grasp with {name} fingers: {margin:.3f}")

    # Where else could the jaws close? Each component is a set of grasps that no path joins to the others.
    found = ga.find_components(problem, max_seconds=20, require=list(result.requirements))
    for component in found.results:
        gap = 2000.0 * component.atlas.centers[:, 0]
        holds = f"best {component.best.quality:.3f}" if component.accepted.any() else "none holds"
        charts = component.atlas.n_charts
        print(f"component of {charts} grasps, jaws {gap.min():.1f} to {gap.max():.1f} mm apart: {holds}")

    folder = Path("out/gripper")
    folder.mkdir(parents=True, exist_ok=True)
    result.save(folder / "result.npz")
    ga.save_picture(result, folder / "grasps.png", width=960, height=540)
    ga.export_html(result, folder / "grasps.html")
    print(f"written to {folder}; look at it with: graspatlas view {folder}")


if __name__ == "__main__":
    main()
