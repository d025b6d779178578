"""What parallel rays meet: simple shapes against their meshes, and against what is known of them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from graspatlas.collision.shapes import Shape
from graspatlas.pads.surface import bounding_points, frame_along, look
from graspatlas.viewer.scene.meshes import from_shape

SHAPES = {
    "sphere": (0.012, 0.0, 0.0),
    "cylinder": (0.01, 0.03, 0.0),
    "capsule": (0.008, 0.03, 0.0),
    "box": (0.02, 0.03, 0.01),
}
TICKS = np.linspace(-0.03, 0.03, 121)


def tilted(kind: str, angle: float) -> Shape:
    placement = np.eye(4)
    placement[:3, :3] = Rotation.from_rotvec([angle, 0.3 * angle, -0.7 * angle]).as_matrix()
    placement[:3, 3] = 0.002, -0.001, 0.004
    return Shape(kind, SHAPES[kind], link="a", placement=placement)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.4])
@pytest.mark.parametrize("kind", SHAPES)
def test_simple_shapes_are_met_where_their_meshes_are(kind, angle):
    shape = tilted(kind, angle)
    mesh = from_shape(kind, shape.sizes, shape.points, shape.triangles)
    as_mesh = Shape("mesh", points=mesh.vertices, triangles=mesh.faces.astype(np.int32), placement=shape.placement)
    T = frame_along(np.array([0.1, -0.2, 1.0]) / np.linalg.norm([0.1, -0.2, 1.0]), np.array([0.0, 0.001, 0.0]))
    heights, others = (look([one], T, TICKS, TICKS).heights for one in (shape, as_mesh))
    both = np.isfinite(heights) & np.isfinite(others)
    assert both.sum() > 500
    # Meshes of 40 sides are 0.3 % smaller, more where they are steep; at an edge pixels are met by one of the two.
    gaps = np.abs(heights - others)[both]
    assert np.quantile(gaps, 0.9) < 2e-4
    assert (np.isfinite(heights) ^ np.isfinite(others)).sum() < 0.06 * both.sum()
    if kind == "box":
        assert np.quantile(gaps, 0.99) < 1e-6


def test_heights_are_exact_and_the_nearest_shape_is_named():
    low, high = Shape("box", (0.02, 0.02, 0.01), link="low"), Shape("sphere", (0.006, 0.0, 0.0), link="high")
    high.placement[:3, 3] = 0.0, 0.0, 0.004
    view = look([low, high], np.eye(4), TICKS, TICKS)
    i = int(np.searchsorted(TICKS, 0.003 - 1e-9))
    expected = 0.004 + np.sqrt(0.006**2 - TICKS[i] ** 2 - TICKS[60] ** 2)
    assert view.heights[i, 60] == pytest.approx(expected, abs=1e-12)
    assert view.shapes[i, 60] == 1
    assert view.heights[78, 60] == pytest.approx(0.005)
    assert view.shapes[78, 60] == 0
    assert np.isnan(view.heights[0, 0])


def test_a_mesh_is_met_where_it_is_not_a_pixel_beside():
    """A slope tells the place: heights are those of the plane at the rays themselves."""
    corners = np.array([[-1.0, -1.0, -0.3], [1.0, -1.0, 0.7], [1.0, 1.0, 0.3], [-1.0, 1.0, -0.7]]) * 0.05
    slope = Shape("mesh", points=corners, triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    view = look([slope], np.eye(4), TICKS, TICKS[:61])
    x, y = np.meshgrid(TICKS, TICKS[:61], indexing="ij")
    assert_allclose(view.heights, 0.5 * x - 0.2 * y, atol=1e-7)


def test_bounds_hold_the_shapes():
    for kind in SHAPES:
        shape = tilted(kind, 0.9)
        mesh = from_shape(kind, shape.sizes, shape.points, shape.triangles).moved(shape.placement)
        ends = bounding_points(shape)
        assert (mesh.vertices.min(axis=0) > ends.min(axis=0) - 1e-9).all()
        assert (mesh.vertices.max(axis=0) < ends.max(axis=0) + 1e-9).all()
