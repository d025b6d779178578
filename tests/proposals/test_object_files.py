"""A mesh as a body to collide with: convex pieces, mass and inertia, and what is missing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from shapes import mug

from graspatlas.proposals.object_files import DENSITY, write_object


def contains(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Whether points lie inside a closed mesh, by its winding number around them (n,)."""
    a, b, c = (mesh.triangles[None, :, k] - points[:, None] for k in range(3))
    x, y, z = (np.linalg.norm(each, axis=2) for each in (a, b, c))
    volume = np.einsum("pfc,pfc->pf", a, np.cross(b, c))
    dots = [np.einsum("pfc,pfc->pf", *pair) for pair in ((a, b), (b, c), (c, a))]
    solid_angles = 2.0 * np.arctan2(volume, x * y * z + dots[0] * z + dots[1] * x + dots[2] * y)
    return solid_angles.sum(axis=1) > 2.0 * np.pi


def test_a_convex_mesh_stays_one_piece_with_the_mass_of_water(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.04, 0.06, 0.1)).apply_translation((0.01, 0.02, 0.03))
    body, note = write_object(box, "box", tmp_path)
    assert note == "the mesh is convex"
    assert list((tmp_path / "meshes").iterdir()) == [tmp_path / "meshes" / "object.obj"]
    np.testing.assert_allclose(body.center_of_mass, (0.01, 0.02, 0.03), atol=1e-9)
    text = (tmp_path / "object.urdf").read_text()
    assert f'mass value="{DENSITY * 0.04 * 0.06 * 0.1:.6g}"' in text


@pytest.mark.slow
def test_a_mug_is_cut_into_convex_pieces_that_leave_its_inside_free(tmp_path: Path) -> None:
    pytest.importorskip("coacd")
    mesh = mug()
    body, note = write_object(mesh, "mug", tmp_path)
    files = sorted((tmp_path / "meshes").glob("piece_*.obj"))
    assert f"cut into {len(files)} convex pieces" in note
    pieces = [trimesh.load(file) for file in files]
    assert all(piece.is_convex for piece in pieces)
    rng = np.random.default_rng(0)
    points = rng.uniform(*mesh.bounds, (4000, 3))
    solid = np.any([contains(part, points) for part in mesh.split()], axis=0)
    covered = np.any([contains(piece, points) for piece in pieces], axis=0)
    assert covered[solid].mean() > 0.97, "the wall is there"
    assert covered[~solid].mean() < 0.06, "and what is poured in has room"
    assert body.name == "mug"


def test_without_the_library_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "coacd", None)
    _, note = write_object(mug(), "mug", tmp_path)
    assert "pip install 'graspatlas[mesh]'" in note


def test_an_open_surface_has_the_mass_of_its_hull(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "coacd", None)  # whose cut takes seconds
    sheet = trimesh.creation.box((0.04, 0.06, 0.1))
    sheet.update_faces(np.arange(len(sheet.faces)) > 1)
    write_object(sheet, "sheet", tmp_path)
    assert f'mass value="{DENSITY * 0.04 * 0.06 * 0.1:.6g}"' in (tmp_path / "object.urdf").read_text()


def test_a_name_with_markup_is_a_name(tmp_path: Path) -> None:
    body, _ = write_object(trimesh.creation.box((0.05, 0.05, 0.05)), '<b>"&', tmp_path)
    assert body.name == '<b>"&'
