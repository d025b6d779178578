"""Rotations that turn a mesh into itself, and what they do to its regions."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import graspatlas as ga
from graspatlas.proposals.assignments.symmetry import region_symmetries

#: The box (a, b, c) has the half turns about its axes; a square one the quarter turns about one too; a cube all 24. The
#: can may be turned upside down. None of these keep all regions but that of no turn.
SHAPES = {
    "box": (lambda: trimesh.creation.box((0.05, 0.07, 0.1)), 4),
    "square": (lambda: trimesh.creation.box((0.05, 0.05, 0.1)), 8),
    "cube": (lambda: trimesh.creation.box((0.05, 0.05, 0.05)), 24),
    "can": (lambda: trimesh.creation.cylinder(0.03, 0.1), 2),
    "cone": (lambda: trimesh.creation.cone(radius=0.03, height=0.1, sections=48), 1),
    "wedge": (lambda: _wedge(), 1),
}


def _wedge() -> trimesh.Trimesh:
    """A box with one corner cut off: no rotation turns it into itself."""
    corners = np.array(np.meshgrid([0.0, 0.05], [0.0, 0.08], [0.0, 0.11])).reshape(3, -1).T
    cut = np.array([[0.02, 0.08, 0.11], [0.05, 0.05, 0.11], [0.05, 0.08, 0.06]])
    return trimesh.convex.convex_hull(np.vstack([corners[:-1], cut]))


@pytest.mark.parametrize("name", SHAPES)
def test_symmetries_are_those_of_the_shape(name: str) -> None:
    make, count = SHAPES[name]
    found = region_symmetries(ga.find_regions(make()))
    assert len(found) == count
    assert found[0] == tuple(range(len(found[0])))
    assert all(sorted(each) == list(found[0]) for each in found), "each is a permutation"


@pytest.mark.parametrize("name", ["box", "square", "can"])
def test_they_do_not_depend_on_where_the_mesh_lies(name: str) -> None:
    make, count = SHAPES[name]
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.2, 0.7, 0.4]))
    turn[:3, 3] = 0.1, -0.3, 0.2
    assert len(region_symmetries(ga.find_regions(make().apply_transform(turn)))) == count


def test_two_symmetries_in_turn_are_a_symmetry() -> None:
    found = set(region_symmetries(ga.find_regions(SHAPES["cube"][0]())))
    assert {tuple(a[i] for i in b) for a in found for b in found} == found
