"""Patches that problem files state by a mesh: regions, and B-splines fitted around a point."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapes
import yaml
from problem_texts import BUNDLED, ROBOTS

import graspatlas as ga
from graspatlas.patches import BSpline, Cylinder
from graspatlas.problem_files import ProblemFileError, json_schema, read_problem
from graspatlas.problem_files.outline import read_outline

REGION = {"type": "region", "name": "cylinder_1"}
AROUND = {"type": "mesh_patch", "center": [0.033, 0.0, 0.0], "size": [0.006, 0.02], "u_axis": [0.0, 1.0, 0.0]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a can in metres, the same in millimetres, and a plate."""
    place = tmp_path_factory.mktemp("meshes")
    mesh = shapes.can(128)
    mesh.export(place / "can.ply")
    mesh.apply_scale(1000.0)
    mesh.export(place / "can_mm.stl")
    shapes.box((0.1, 0.1, 0.01)).export(place / "plate.ply")
    return place


def text_of(folder, body, on_object, on_hand=None):
    data = yaml.safe_load(BUNDLED)
    data["hand"]["urdf"] = str(ROBOTS / data["hand"]["urdf"])
    data["hand"].pop("srdf", None)
    data["object"] = body
    data.pop("x1", None)
    data["contacts"] = data["contacts"][:1]
    data["contacts"][0]["object"] = on_object
    data["contacts"][0].pop("frozen", None)
    if on_hand is not None:
        data["contacts"][0]["hand"] = on_hand
    return json.dumps(data)


def patch_of(folder, body, on_object):
    return read_problem(text_of(folder, body, on_object), "p.yaml", folder).contacts[0].object


def fault(folder, body, on_object, on_hand=None):
    with pytest.raises(ProblemFileError) as caught:
        read_problem(text_of(folder, body, on_object, on_hand), "p.yaml", folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("body", [{"mesh": "can.ply"}, {"mesh": "can_mm.stl", "scale": 0.001}], ids=["m", "mm"])
def test_a_region_of_the_objects_own_mesh(body, folder):
    patch = patch_of(folder, body, REGION)
    assert isinstance(patch, Cylinder)
    assert patch.radius == pytest.approx(0.033, abs=1e-4)


def test_a_region_of_a_mesh_that_is_named(folder):
    patch = patch_of(folder, {"sphere": {"radius": 0.05}}, {**REGION, "mesh": "can_mm.stl", "scale": 0.001})
    assert patch.radius == pytest.approx(0.033, abs=1e-4)


def test_a_region_is_the_inner_patch_or_the_whole_one(folder):
    inner, whole = (
        patch_of(folder, {"mesh": "can.ply"}, {**REGION, "name": "plane_1", "whole": w}) for w in (False, True)
    )
    assert np.ptp(inner.u_interval) < np.ptp(whole.u_interval) == pytest.approx(0.066, abs=1e-3)


def test_a_patch_around_a_point_has_two_sizes(folder):
    patch = patch_of(folder, {"mesh": "can.ply"}, AROUND)
    assert isinstance(patch, BSpline)
    assert (np.ptp(patch.interval("u")), np.ptp(patch.interval("v"))) == pytest.approx((0.012, 0.04))
    for u, v in ((0.0, 0.0), (0.005, 0.019), (-0.005, -0.01)):
        assert np.hypot(*patch.point(u, v)[:2]) == pytest.approx(0.033, abs=2e-5)


def test_a_problem_keeps_the_patch_and_needs_the_mesh_no_more(folder):
    problem = read_problem(text_of(folder, {"mesh": "can.ply"}, REGION), "p.yaml", folder)
    stored = problem.to_dict()["contacts"][0]
    assert stored["object"]["type"] == "cylinder"
    assert ga.Contact.from_dict(stored).object == problem.contacts[0].object


def test_an_outline_counts_their_parameters(folder):
    on_mesh = read_outline(text_of(folder, {"mesh": "can.ply"}, REGION), folder)
    ordinary = read_outline(text_of(folder, {"mesh": "can.ply"}, {"type": "cylinder", "radius": 0.03}), folder)
    assert on_mesh.freedoms == ordinary.freedoms


def test_the_schema_knows_them():
    tables = json_schema()["$defs"]
    assert set(tables["RegionTable"]["properties"]) == {"type", "mesh", "scale", "name", "tolerance", "whole"}
    assert {"center", "size", "u_axis", "control_points"} < set(tables["MeshPatchTable"]["properties"])


CAN = {"mesh": "can.ply"}
FAULTS = {
    "unknown region": (
        CAN,
        {**REGION, "name": "lid"},
        "region 'lid' is not one of the mesh's; known: cylinder_1, plane_1",
    ),
    "no name": (CAN, {"type": "region"}, "name: is missing"),
    "no mesh": ({"box": {"size": [0.1, 0.1, 0.1]}}, REGION, "has no mesh, or more than one"),
    "no such mesh": (CAN, {**REGION, "mesh": "lid.ply"}, "lid.ply' does not exist"),
    "millimetres": (CAN, {**REGION, "mesh": "can_mm.stl"}, "seems to be in millimetres: say scale 0.001"),
    "a scale twice": (CAN, {**REGION, "scale": 0.001}, "that of the object's mesh stands under object"),
    "a tolerance of zero": (CAN, {**REGION, "tolerance": 0.0}, "must be positive"),
    "whole in words": (CAN, {**REGION, "whole": "yes"}, "must be true or false"),
    "off the mesh": (CAN, {**AROUND, "center": [0.5, 0.0, 0.0]}, "away from the centre"),
    "too bent": (CAN, {**AROUND, "size": 0.033}, "the mesh turns by"),
    "over an edge": (CAN, {**AROUND, "center": [0.033, 0.0, 0.055]}, "the mesh turns by"),
    "no size": (CAN, {"type": "mesh_patch", "center": [0.033, 0.0, 0.0]}, "size: is missing"),
    "two coordinates": (CAN, {**AROUND, "center": [0.0, 0.0]}, "must hold 3 items"),
    "three control points": (CAN, {**AROUND, "control_points": 3}, "must be at least 4"),
    "an unknown field": (CAN, {**AROUND, "centre": [0, 0, 0]}, "did you mean 'center'"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_named(name, folder):
    body, stated, words = FAULTS[name]
    message = fault(folder, body, stated)
    assert words in message
    assert message.startswith("p.yaml:1: contacts[0].object")


def test_a_region_of_the_hand_names_its_mesh(folder):
    assert "a region of the hand must name its mesh" in fault(folder, CAN, REGION, REGION)
