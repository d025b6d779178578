# /// script
# requires-python = ">=3.10"
# dependencies = ["graspatlas"]
#
# [tool.uv.sources]
# graspatlas = { path = ".." }
# ///
"""Hand grasps on to a robot: where the palm must go, which joint angles close the hand, and the way between two grasps.

Run it with ``python examples/export_grasps.py``; it writes CSV and JSON files to ``out/export_grasps``.
"""

import csv
import json
from itertools import pairwise
from pathlib import Path

import numpy as np

import graspatlas as ga


def main() -> None:
    """Write the best grasps of a cylinder, read them back as a planner would, and write a joint trajectory."""
    problem = ga.load_problem("allegro_cylinder_3")
    result = ga.optimize(problem)
    folder = Path("out/export_grasps")
    folder.mkdir(parents=True, exist_ok=True)

    count = result.save_grasps(folder / "grasps.json", best=10)
    result.save_grasps(folder / "grasps.csv", accepted=True)
    print(
        f"{result.accepted.sum()} of {result.atlas.n_charts} grasps hold, the best {count} in {folder / 'grasps.json'}"
    )

    # A planner knows where the object is, and asks where to bring the palm. Every grasp has another place for it, and
    # the arm takes the first that it can reach; here the first with the palm above the table.
    T_world_object = np.eye(4)
    T_world_object[:3, 3] = [0.5, 0.0, 0.06]
    with open(folder / "grasps.json", encoding="utf-8") as stream:
        file = json.load(stream)
    assert (file["format"], file["version"]) == ("graspatlas grasps", 2)
    for row in file["grasps"]:
        T_world_palm = T_world_object @ result.grasp(row["chart"]).T_object_palm
        same = T_world_object[:3, :3] @ row["palm_in_object"]["xyz"] + T_world_object[:3, 3]
        assert np.allclose(T_world_palm[:3, 3], same)
        if T_world_palm[2, 3] > 0.0:
            x, y, z = T_world_palm[:3, 3]
            print(f"chart {row['chart']}: palm '{file['frames']['palm']}' to ({x:.3f}, {y:.3f}, {z:.3f}) m")
            print("  joints [rad]: " + ", ".join(f"{name} {angle:.3f}" for name, angle in row["joints"].items()))
            break

    # Poses are named, and Pinocchio's type is there for those who compute on.
    poses = result.best.poses()
    print("poses of the best grasp: " + ", ".join(poses))
    assert np.allclose(result.best.palm_pose.homogeneous, poses["palm_in_object"])

    # From the best grasp with one index to the best with another, without letting go and no joint too fast.
    other = result.by("force_closure_margin").best
    path = ga.shortest_path(result, other, accepted=True)
    path.save_csv(folder / "path.csv", joint_speed=0.5)
    with open(folder / "path.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    print(f"{len(rows)} points from the firmest grasp to the best, {float(rows[-1]['time']):.2f} s at 0.5 rad/s")
    fastest = max(
        abs(float(b[joint]) - float(a[joint])) / (float(b["time"]) - float(a["time"]))
        for a, b in pairwise(rows)
        for joint in problem.hand.joints
    )
    print(f"fastest joint {fastest:.3f} rad/s; written to {folder}")


if __name__ == "__main__":
    main()
