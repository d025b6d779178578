"""Grasps, charts and trajectories in the form that other programs want, checked against Pinocchio's own kinematics."""

from __future__ import annotations

import csv
import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
from helpers import BENT, Written, tripod_problem
from numpy.testing import assert_allclose
from numpy.typing import NDArray

import graspatlas as ga
from graspatlas.cli import main

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def result() -> ga.Result:
    """Grasps of the bottle, some of which hold; two indices, refined."""
    return ga.optimize(
        ga.load_problem("schunk_oil_bottle"),
        radius=0.1,
        quality=["manipulability_volume", "smallest_semi_axis"],
        require=[ga.ForceClosure(friction=1.0)],
        refine=True,
    )


@pytest.fixture(scope="module")
def planar() -> ga.Result:
    """Grasps of a hand whose joints are continuous."""
    return ga.optimize(ga.load_problem("planar_hand"), max_charts=60)


def rows_of(path: Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def pinocchio_places(problem: ga.Problem, joints: dict[str, float]) -> dict[str, pin.SE3]:
    """Places of all frames of the hand in the palm, by Pinocchio from the URDF and the joints' names."""
    model = pin.buildModelFromXML(problem.hand.urdf)
    q = pin.neutral(model)
    for name, position in joints.items():
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = position if joint.nq == 1 else (np.cos(position), np.sin(position))
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return {frame.name: pin.SE3(data.oMf[i]) for i, frame in enumerate(model.frames)}


def pose(xyz: Any, quat_xyzw: Any) -> pin.SE3:
    return pin.SE3(pin.Quaternion(np.asarray(quat_xyzw, float)), np.asarray(xyz, float))


def assert_touches(problem: ga.Problem, places: dict[str, pin.SE3], palm: pin.SE3, contacts: list[Any]) -> None:
    """The point on the hand, which the URDF and the problem state, is the point in the file; the normals oppose."""
    for contact, (frame, point, normal) in zip(problem.contacts, contacts, strict=True):
        assert frame == contact.frame
        assert isinstance(contact.hand, ga.patches.Point)
        place = palm * places[frame]
        assert_allclose(place.act(np.array(contact.hand.position)), point, atol=1e-10)
        assert_allclose(place.rotation @ contact.hand.normal, -np.asarray(normal), atol=1e-8)


# Poses


@pytest.mark.parametrize("which", ["result", "planar"])
def test_poses_agree_with_pinocchio(which: str, request: pytest.FixtureRequest) -> None:
    found: ga.Result = request.getfixturevalue(which)
    grasp = found.grasp(17)
    places = pinocchio_places(found.problem, dict(grasp.joint_positions))
    in_palm = pose(grasp.object_xyz, grasp.object_quat_xyzw)
    assert grasp.object_pose.isApprox(in_palm, 1e-12)
    assert grasp.palm_pose.isApprox(in_palm.inverse(), 1e-12)
    assert pose(grasp.palm_xyz, grasp.palm_quat_xyzw).isApprox(in_palm.inverse(), 1e-12)
    poses = grasp.poses()
    frames = [contact.frame for contact in found.problem.contacts]
    assert list(poses) == ["object_in_palm", "palm_in_object", *(f"{frame}_in_object" for frame in frames)]
    assert_allclose(poses["object_in_palm"], in_palm.homogeneous, atol=1e-12)
    assert_allclose(poses["palm_in_object"], in_palm.inverse().homogeneous, atol=1e-12)
    for frame in frames:
        assert_allclose(poses[f"{frame}_in_object"], (in_palm.inverse() * places[frame]).homogeneous, atol=1e-12)


def test_poses_of_a_batch_are_those_of_each(result: ga.Result) -> None:
    batch = ga.Grasps(result.problem, result.atlas.centers[[3, 40, 5]])
    poses = batch.poses(["index_tip", "palm"])
    assert {name: T.shape for name, T in poses.items()} == dict.fromkeys(
        ["object_in_palm", "palm_in_object", "index_tip_in_object", "palm_in_object"], (3, 4, 4)
    )
    for i, grasp in enumerate(batch):
        for name, T in grasp.poses(["index_tip"]).items():
            assert_allclose(poses[name][i], T, atol=1e-14)
        names = ("object_xyz", "object_quat_xyzw", "palm_xyz", "palm_quat_xyzw", "T_object_palm")
        for name in (*names, "contact_points_in_object", "contact_normals_in_object"):
            assert_allclose(getattr(batch, name)[i], getattr(grasp, name), atol=1e-14)
        assert {name: float(values[i]) for name, values in batch.joint_positions.items()} == grasp.joint_positions
        assert "urdf" not in repr(grasp)
    with pytest.raises(ga.GraspAtlasError, match="frame 'index_tpi' is not in hand 'schunk_sah'; did you mean"):
        batch.poses(["index_tpi"])


# Files of grasps


def test_json_says_all(result: ga.Result, tmp_path: Path) -> None:
    assert result.save_grasps(tmp_path / "grasps.json") == result.atlas.n_charts
    data = json.loads((tmp_path / "grasps.json").read_text(encoding="utf-8"))
    assert (data["format"], data["version"], data["problem"]) == ("graspatlas grasps", 2, "schunk_oil_bottle")
    assert (data["hand"], data["object"], data["frames"]) == (
        "schunk_sah",
        "oil_bottle",
        {"palm": "palm", "object": "oil_bottle"},
    )
    assert (data["quality"], data["requirements"]) == ("manipulability_volume", ["force_closure:1:0"])
    assert data["units"]["joints"] == dict.fromkeys(result.problem.hand.joints, "rad")
    assert [row["chart"] for row in data["grasps"]] == list(range(result.atlas.n_charts))
    assert data["n_grasps"] == data["n_charts"] == result.atlas.n_charts
    assert not any(row["refined"] for row in data["grasps"])
    for row in data["grasps"][::50]:
        grasp = result.grasp(row["chart"])
        assert row["accepted"] == result.accepted[row["chart"]]
        assert row["indices"] == {
            "manipulability_volume": result.qualities[row["chart"]],
            "smallest_semi_axis": result.others["smallest_semi_axis"][row["chart"]],
        }
        assert list(row["joints"].values()) == grasp.q.tolist()  # every digit
        palm = pose(row["palm_in_object"]["xyz"], row["palm_in_object"]["quat_xyzw"])
        assert (palm * pose(row["object_in_palm"]["xyz"], row["object_in_palm"]["quat_xyzw"])).isIdentity(1e-12)
        places = pinocchio_places(result.problem, row["joints"])
        contacts = [(contact["frame"], contact["point"], contact["normal"]) for contact in row["contacts"]]
        assert_touches(result.problem, places, palm, contacts)


def test_csv_is_flat(result: ga.Result, tmp_path: Path) -> None:
    count = result.save_grasps(tmp_path / "grasps.csv", accepted=True)
    rows = rows_of(tmp_path / "grasps.csv")
    assert count == len(rows) == result.accepted.sum() < result.atlas.n_charts
    axes = ["x", "y", "z", "qx", "qy", "qz", "qw"]
    assert list(rows[0]) == [
        *("chart", "refined", "accepted", "manipulability_volume", "smallest_semi_axis"),
        *result.problem.hand.joints,
        *(f"{body}_{axis}" for body in ("palm", "object") for axis in axes),
        *(f"contact{i}_{part}" for i in range(3) for part in ("frame", "x", "y", "z", "nx", "ny", "nz")),
    ]
    assert [int(row["chart"]) for row in rows] == np.flatnonzero(result.accepted).tolist()
    for row in rows[::50]:
        assert (row["accepted"], row["refined"]) == ("true", "false")
        grasp = result.grasp(int(row["chart"]))
        joints = {name: float(row[name]) for name in result.problem.hand.joints}
        assert joints == grasp.joint_positions
        assert float(row["manipulability_volume"]) == grasp.quality
        palm, held = (
            pose(*np.split(np.array([float(row[f"{body}_{axis}"]) for axis in axes]), [3]))
            for body in ("palm", "object")
        )
        assert held.isApprox(pose(grasp.object_xyz, grasp.object_quat_xyzw), 1e-12)
        contacts = [
            (
                row[f"contact{i}_frame"],
                *np.split(np.array([float(row[f"contact{i}_{a}"]) for a in ("x", "y", "z", "nx", "ny", "nz")]), 2),
            )
            for i in range(3)
        ]
        assert_touches(result.problem, pinocchio_places(result.problem, joints), palm, contacts)
    table = pd.read_csv(tmp_path / "grasps.csv")
    assert table["accepted"].dtype == bool
    assert table["manipulability_volume"].max() == result.best.quality


def test_angles_of_continuous_joints_come_back(planar: ga.Result, tmp_path: Path) -> None:
    planar.save_grasps(tmp_path / "grasps.json")
    data = json.loads((tmp_path / "grasps.json").read_text(encoding="utf-8"))
    angles = np.array([list(row["joints"].values()) for row in data["grasps"]])
    q = np.stack([np.cos(angles), np.sin(angles)], axis=2).reshape(len(angles), -1)
    assert_allclose(q, planar.atlas.centers[:, : q.shape[1]], atol=1e-15, rtol=1e-15)


def test_sliding_joints_are_in_metres(tmp_path: Path) -> None:
    short = {name: value if name[1] != "0" else 0.01 * value for name, value in BENT.items()}
    problem = tripod_problem(short, kinds=["prismatic", "revolute", "revolute"])
    ga.optimize(problem, dimension=6, radius=0.2, epsilon=0.5, quality="smallest_semi_axis", max_charts=3).save_grasps(
        tmp_path / "grasps.json"
    )
    units = json.loads((tmp_path / "grasps.json").read_text(encoding="utf-8"))["units"]["joints"]
    assert units == {name: "m" if name[1] == "0" else "rad" for name in BENT}


def test_which_grasps(result: ga.Result, tmp_path: Path) -> None:
    def charts(**choice: Any) -> list[int]:
        count = result.save_grasps(tmp_path / "some.csv", **choice)
        rows = rows_of(tmp_path / "some.csv")
        assert count == len(rows)
        return [int(row["chart"]) for row in rows]

    assert charts(charts=[7, 3]) == [7, 3]
    assert charts(charts=np.array([5])) == [5]
    best = charts(best=4)
    assert best[0] == result.best.chart
    left = np.where(result.accepted, result.qualities, -np.inf)
    assert best == np.argsort(-left, kind="stable")[:4].tolist()
    assert len(charts(best=10**6)) == result.accepted.sum()
    assert charts(best=1, refined=True) == [result.refined_best.chart, result.best.chart]
    first, second = rows_of(tmp_path / "some.csv")
    assert (first["refined"], first["accepted"], second["refined"]) == ("true", "true", "false")
    top = result.refined_best
    assert float(first["manipulability_volume"]) == top.quality > result.best.quality
    assert float(first["smallest_semi_axis"]) == pytest.approx(top.semi_axes[0], rel=1e-6)
    assert {name: float(first[name]) for name in top.joints} == top.joint_positions
    assert [file.name for file in tmp_path.iterdir()] == ["some.csv"]


def test_what_is_not_a_number(small_result: ga.Result, tmp_path: Path) -> None:
    """An index may be infinite, and a callable that was not stored has no value at the refined best."""
    odd = replace(small_result, qualities=np.full(small_result.atlas.n_charts, np.inf))
    odd.save_grasps(tmp_path / "odd.json", charts=[0])
    text = (tmp_path / "odd.json").read_text(encoding="utf-8")
    assert json.loads(text, parse_constant=pytest.fail)["grasps"][0]["indices"] == {"manipulability_volume": None}
    odd.save_grasps(tmp_path / "odd.csv", charts=[0])
    assert rows_of(tmp_path / "odd.csv")[0]["manipulability_volume"] == "inf"


def test_an_index_that_was_lost(result: ga.Result, tmp_path: Path) -> None:
    lost = replace(result, others={"mine": result.others["smallest_semi_axis"]})
    lost.save_grasps(tmp_path / "lost.csv", best=1, refined=True)
    assert [row["mine"] == "" for row in rows_of(tmp_path / "lost.csv")] == [True, False]


@pytest.mark.parametrize(
    ("name", "choice", "words"),
    [
        ("grasps.xml", {}, r"must end in \.csv or \.json, got '.*grasps\.xml'"),
        ("grasps", {}, "must end in"),
        ("nowhere/grasps.csv", {}, "cannot write '.*nowhere"),
        ("g.csv", {"charts": [10**6]}, "chart 1000000 does not exist"),
        ("g.csv", {"charts": [True]}, "chart True does not exist"),
        ("g.csv", {"charts": []}, "charts names none"),
        ("g.csv", {"charts": [1], "best": 2}, "give either charts, or best and accepted"),
        ("g.csv", {"best": 0}, "best must be a whole number of at least 1, got 0"),
        ("g.csv", {"best": 1.5}, "best must be a whole number"),
        ("g.csv", {"refined": True}, "was not refined: give optimize refine=True"),
    ],
)
def test_wrong_choices(small_result: ga.Result, tmp_path: Path, name: str, choice: Any, words: str) -> None:
    with pytest.raises(ga.GraspAtlasError, match=words):
        small_result.save_grasps(tmp_path / name, **choice)
    assert not list(tmp_path.iterdir())


def test_no_feasible_grasp(small_result: ga.Result, tmp_path: Path) -> None:
    none = replace(small_result, accepted=np.zeros(small_result.atlas.n_charts, bool), rejected={"mine": 9})
    for choice in ({"best": 1}, {"accepted": True}):
        with pytest.raises(ga.GraspAtlasError, match=r"none of \d+ grasps meets the requirements \(mine rejected 9\)"):
            none.save_grasps(tmp_path / "g.csv", **choice)  # type: ignore[arg-type]
    assert none.save_grasps(tmp_path / "g.csv") == none.atlas.n_charts


def test_two_columns_of_one_name(small_result: ga.Result, tmp_path: Path) -> None:
    twice = replace(small_result, others={"thumb_pip": small_result.qualities})
    with pytest.raises(ga.GraspAtlasError, match="two columns of the table would be called 'thumb_pip'"):
        twice.save_grasps(tmp_path / "g.csv")
    with pytest.raises(ga.GraspAtlasError, match="two columns"):
        twice.to_pandas()


# Tables


def test_table_of_charts(result: ga.Result) -> None:
    table = result.to_pandas()
    atlas = result.atlas
    assert table.index.name == "chart"
    assert len(table) == atlas.n_charts
    assert table["manipulability_volume"].idxmax() == result.qualities.argmax()
    assert table[table.accepted]["manipulability_volume"].max() == result.best.quality
    assert_allclose(table["smallest_semi_axis"], result.others["smallest_semi_axis"])
    assert_allclose(table[list(result.problem.hand.joints)], atlas.centers[:, :13])
    assert_allclose(table[["object_x", "object_y", "object_z"]], atlas.centers[:, 13:16], atol=1e-15)
    assert table["n_neighbours"].tolist() == [len(row) for row in atlas.neighbours]
    assert table["n_facets"].tolist() == [len(atlas.facets(i)[1]) for i in range(atlas.n_charts)]
    assert table["n_vertices"].tolist() == [len(atlas.polytope(i)) for i in range(atlas.n_charts)]
    counted = {reason: int(table[f"closed_{reason}"].sum()) for reason in atlas.closed_vertices}
    assert counted == atlas.closed_vertices
    assert table["residual"].max() == atlas.residuals.max()
    assert "volume" not in table


def test_patch_parameters_are_those_of_the_contacts() -> None:
    """The named parameters lead to one point, on the hand's patch by Pinocchio and on the object's patch."""
    rolling = tripod_problem(rolling=True)
    problem = rolling.at(ga.project(rolling.full_system, rolling.x1_array + 1e-3 * np.arange(28)))
    found = ga.optimize(problem, dimension=12, radius=0.3, epsilon=0.5, quality="smallest_semi_axis", max_charts=1)
    table = found.to_pandas()
    named = [name for name in table if re.fullmatch(r"contact\d_(hand|object)_[uv]", name)]
    assert len(named) == problem.full_system.n_parameters == 12
    grasp, row = found.at_x1, table.loc[0]
    places = pinocchio_places(problem, dict(grasp.joint_positions))
    for i, contact in enumerate(problem.contacts):
        on_object = contact.object.point(row[f"contact{i}_object_u"], row[f"contact{i}_object_v"])
        on_hand = contact.hand.point(row[f"contact{i}_hand_u"], row[f"contact{i}_hand_v"])
        assert np.linalg.norm(on_hand) > 1e-4
        assert_allclose(on_object, grasp.contact_points_in_object[i], atol=1e-10)
        assert_allclose((grasp.palm_pose * places[contact.frame]).act(on_hand), on_object, atol=1e-10)


def test_closed_vertices_are_counted_where_they_are() -> None:
    system = Written(3, 1, lambda x: [x @ x - 1.0 if x[2] > 0 else np.nan], lambda x: [2.0 * x])
    atlas = ga.build_atlas(system, [0, 0, 1], radius=0.1, epsilon=0.1)
    table = atlas.to_pandas()
    assert table["closed_not_converged"].sum() == atlas.closed_vertices["not_converged"] > 10
    assert (table["x2"][table["closed_not_converged"] > 0] < 0.2).all()


def test_table_of_any_atlas(sphere: ga.Atlas) -> None:
    table = sphere.to_pandas(volumes=True)
    assert list(table) == [
        *("x0", "x1", "x2", "residual", "n_neighbours", "n_facets", "n_vertices"),
        *("closed_bounds", "closed_curvature", "closed_not_converged", "closed_covered", "volume"),
    ]
    assert_allclose(np.linalg.norm(table[["x0", "x1", "x2"]], axis=1), 1.0, atol=1e-9)
    assert table["volume"].sum() == pytest.approx(4 * np.pi, rel=1e-2)
    pairs = sphere.neighbours_to_pandas()
    assert len(pairs) == len(sphere.neighbour_pairs) == table["n_neighbours"].sum() / 2
    ends = (sphere.centers[pairs["chart"]], sphere.centers[pairs["neighbour"]])
    assert_allclose(pairs["distance"], np.linalg.norm(ends[1] - ends[0], axis=1), rtol=1e-9)


@pytest.mark.parametrize("make", ["to_pandas", "neighbours_to_pandas"])
def test_without_pandas(sphere: ga.Atlas, make: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ga.GraspAtlasError, match=r"needs pandas: pip install 'graspatlas\[tables\]'"):
        getattr(sphere, make)()


# Trajectories with times


def test_no_joint_is_too_fast(small_result: ga.Result, tmp_path: Path) -> None:
    path = ga.shortest_path(small_result, small_result.worst.chart)
    model = pin.buildModelFromXML(small_result.problem.hand.urdf)
    limits = {name: model.velocityLimit[model.joints[model.getJointId(name)].idx_v] for name in path.grasps.joints}
    for joint_speed, largest in (("urdf", limits), (0.5, dict.fromkeys(limits, 0.5)), (1e6, limits)):
        path.save_csv(tmp_path / "path.csv", joint_speed=joint_speed)
        table = pd.read_csv(tmp_path / "path.csv")
        assert list(table)[:2] == ["time", "arc_length"]
        steps = np.diff(table["time"])
        assert table["time"][0] == 0.0
        assert (steps > 0.0).all()
        shares = np.array([np.abs(np.diff(table[name])) / steps / limit for name, limit in largest.items()])
        assert shares.max() <= 1.0 + 1e-9
        assert_allclose(shares.max(axis=0), 1.0, rtol=1e-6)  # and none slower than it need be
    assert_allclose(table["time"], path.times(), rtol=1e-12)
    assert_allclose(table[list(path.grasps.joints)], path.grasps.q, rtol=1e-14)


def test_times_of_a_hand_without_velocity_limits(planar: ga.Result, tmp_path: Path) -> None:
    path = ga.shortest_path(planar, 0, 30)
    with pytest.raises(ga.GraspAtlasError, match="states no velocity limit for joint 'first_base'; give a joint speed"):
        path.times()
    assert path.times(0.1)[-1] == pytest.approx(10 * path.times(1.0)[-1])
    for wrong in (0.0, -1.0, np.inf, np.nan, "fast", True, None):
        with pytest.raises(ga.GraspAtlasError, match="joint_speed must be a positive number"):
            path.times(wrong)  # type: ignore[arg-type]
    assert ga.shortest_path(planar, 3, 3).times(1.0).tolist() == [0.0]


# The command line


@pytest.fixture
def folder(result: ga.Result, tmp_path: Path) -> Path:
    result.save(tmp_path / "result.npz")
    return tmp_path


def run(capfd: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    capfd.readouterr()
    status = main([str(word) for word in words])
    return status, *capfd.readouterr()


def test_export_command(folder: Path, result: ga.Result, capfd: pytest.CaptureFixture[str]) -> None:
    grasps, table = folder / "grasps.json", folder / "charts.parquet"
    status, out, err = run(
        capfd, *("export", folder, "--grasps", grasps, "--best", 3, "--refined", "--table", table, "--json")
    )
    assert (status, err) == (0, "")
    n = result.atlas.n_charts
    expected = {"n_charts": n, "n_grasps": 4, "grasps": str(grasps), "table": str(table)}
    assert json.loads(out) == {"problem": "schunk_oil_bottle", **expected}
    data = json.loads(grasps.read_text(encoding="utf-8"))
    assert [row["refined"] for row in data["grasps"]] == [True, False, False, False]
    assert data["grasps"][1]["chart"] == result.best.chart
    pd.testing.assert_frame_equal(pd.read_parquet(table).set_index("chart"), result.to_pandas())

    status, out, _ = run(capfd, "export", folder, "--grasps", folder / "g.csv", "--chart", "best", "0")
    assert (status, out) == (0, f"schunk_oil_bottle: 2 of {n} grasps written to {folder / 'g.csv'}\n")
    assert [int(row["chart"]) for row in rows_of(folder / "g.csv")] == [result.best.chart, 0]
    status, out, _ = run(capfd, "export", folder, "--table", folder / "charts.csv")
    assert (status, out) == (0, f"schunk_oil_bottle: {n} charts written to {folder / 'charts.csv'}\n")
    read = pd.read_csv(folder / "charts.csv", index_col="chart")
    pd.testing.assert_frame_equal(read, result.to_pandas(), rtol=1e-14)


def test_pregrasps_in_files(folder: Path, result: ga.Result, capfd: pytest.CaptureFixture[str]) -> None:
    files = folder / "grasps.json", folder / "grasps.csv"
    reached = [before.reached for before in ga.Grasps(result.problem, result.atlas.centers).pregrasps(0.005)]
    charts = [reached.index(True), reached.index(False)]
    for file in files:
        status, _, _ = run(capfd, "export", folder, "--grasps", file, "--chart", *charts, "--pregrasp", 0.005)
        assert status == 0
    data = json.loads(files[0].read_text(encoding="utf-8"))
    assert (data["version"], data["units"]["distance"]) == (2, "m")
    for record, row in zip(data["grasps"], rows_of(files[1]), strict=True):
        before = result.grasp(record["chart"]).pregrasp(0.005)
        stated = record["pregrasp"]
        assert list(stated["joints"]) == list(result.problem.hand.joints)
        assert_allclose(list(stated["joints"].values()), list(before.joint_positions.values()), atol=1e-9)
        assert_allclose(stated["distance"], before.distances, atol=1e-9)
        assert (stated["reached"], stated["reason"]) == (before.reached, before.reason)
        for name, position in stated["joints"].items():
            assert float(row[f"pregrasp_{name}"]) == position
        assert [float(row[f"pregrasp_distance{i}"]) for i in range(3)] == stated["distance"]
        assert row["pregrasp_reached"] == str(stated["reached"]).lower()
    assert [record["pregrasp"]["reached"] for record in data["grasps"]] == [True, False]
    result.save_grasps(files[0], best=3)
    assert "pregrasp" not in files[0].read_text(encoding="utf-8")


def test_export_command_refuses(folder: Path, result: ga.Result, capfd: pytest.CaptureFixture[str]) -> None:
    out = folder / "g.csv"
    for words, message in (
        (["export", folder], "nothing to write: give --grasps FILE, --table FILE, or --format NAME --to PATH"),
        (["export", folder / "nowhere", "--grasps", out], r"nowhere' does not exist"),
        (["export", folder, "--grasps", folder / "g.txt"], r"must end in \.csv or \.json"),
        (["export", folder, "--table", folder / "t.xlsx"], r"must end in \.csv or \.parquet"),
        (["export", folder, "--grasps", out, "--chart", "middle"], "'middle' names no grasp"),
        (["export", folder, "--grasps", out, "--chart", "1", "--best", "2"], "give either charts"),
        (["export", folder, "--grasps", out, "--pregrasp", "10"], r"pregrasp must be above 0 and at most 0\.1, got 10"),
        (["export", folder, "--table", folder / "t.csv", "--pregrasp", "0.01"], "give --grasps FILE, or --format NAME"),
        (["path", folder, "--joint-speed", "1"], "--joint-speed is for the table: give --csv FILE too"),
        (["path", folder, "--joint-speed", "slow", "--csv", out], "joint_speed must be .* got 'slow'"),
    ):
        status, printed, err = run(capfd, *words)
        assert (status, printed, err.count("\n")) == (2, "", 1)
        assert re.search(message, err), err
    none = replace(result, accepted=np.zeros(result.atlas.n_charts, bool), refinement=None)
    none.save(folder / "none.npz")
    status, _, err = run(capfd, "export", folder / "none.npz", "--grasps", out, "--best", "1")
    assert (status, err) == (1, "schunk_oil_bottle: no grasp meets the requirements, nothing was written\n")
    assert not out.exists()


def test_parquet_needs_pyarrow(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    status, _, err = run(capfd, "export", folder, "--table", folder / "t.parquet")
    assert status == 2
    assert "needs pyarrow: pip install 'graspatlas[sweep]'" in err
    assert not (folder / "t.parquet").exists()


def test_path_command_writes_times(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ["path", folder, "--to", "5", "--csv", folder / "path.csv", "--joint-speed"]
    totals = []
    for speed in ("urdf", "0.2"):
        assert run(capfd, *words, speed)[0] == 0
        totals.append(float(rows_of(folder / "path.csv")[-1]["time"]))
    assert totals[1] == pytest.approx(10.0 * totals[0])
