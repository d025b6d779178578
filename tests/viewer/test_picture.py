"""The rasteriser and the picture of the best and the worst grasp."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from screens import pixels, share

import graspatlas as ga
from graspatlas import _core
from graspatlas.viewer import export_html, save_picture
from graspatlas.viewer.render.picture import WINDOW
from graspatlas.viewer.render.raster import in_front_of, nearest
from graspatlas.viewer.render.shading import to_linear
from graspatlas.viewer.scene.scene import Scene, vertices_of

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def picture(bottle_result: ga.Result, tmp_path_factory: pytest.TempPathFactory) -> Array:
    path = tmp_path_factory.mktemp("picture") / "bottle.png"
    save_picture(bottle_result, path, width=800, height=450)
    return pixels(path)


def test_rasteriser_fills_each_pixel_once_and_keeps_the_nearest() -> None:
    square = np.array([[2.0, 3.0, 0.0], [12.0, 3.0, 0.0], [12.0, 9.0, 0.0], [2.0, 9.0, 0.0]])
    nearer = np.array([0.0, 0.0, 1.0])
    far = square[[[0, 1, 2], [0, 2, 3]]]
    near = far[:1] + nearer
    found = nearest(np.concatenate([far, near]), 20, 15)
    assert len(found.pixels) == 60
    assert set(found.pixels // 20) == set(range(3, 9))
    assert set(found.pixels % 20) == set(range(2, 12))
    above = found.pixels[found.triangles == 2]
    assert 25 <= len(above) <= 35
    assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-6)


def test_rasteriser_agrees_with_a_slow_one() -> None:
    random = np.random.default_rng(3)
    corners = random.uniform(-10.0, 70.0, (60, 3, 3))
    found = nearest(corners, 64, 48)
    image = np.full(64 * 48, -1)
    image[found.pixels] = found.triangles
    y, x = np.divmod(np.arange(64 * 48), 64)
    best = np.full(64 * 48, -np.inf)
    slow = np.full(64 * 48, -1)
    for i, triangle in enumerate(corners):
        system = np.vstack([triangle[:, :2].T, np.ones(3)])
        weights = np.linalg.solve(system, np.vstack([x + 0.5, y + 0.5, np.ones(len(x))]))
        closer = (weights >= 0.0).all(axis=0) & (triangle[:, 2] @ weights > best)
        best[closer], slow[closer] = (triangle[:, 2] @ weights)[closer], i
    assert (image == slow).mean() > 0.999


def test_rasteriser_takes_nothing() -> None:
    assert len(nearest(np.zeros((0, 3, 3)), 8, 8).pixels) == 0


def test_colours_survive_light() -> None:
    dark = np.arange(200)
    light = np.repeat(to_linear(dark / 255.0), 3).reshape(-1, 3)
    assert (_core.developed(light, 200, 1, 1)[0] == dark[:, None]).all()
    assert (_core.developed(np.full((1, 3), 1e6), 1, 1, 1) == 255).all()


def test_a_pixel_is_the_mean_of_its_samples() -> None:
    light = np.random.default_rng(5).uniform(0.0, 0.6, (6, 8, 3))
    means = light.reshape(3, 2, 4, 2, 3).mean(axis=(1, 3))
    alone = _core.developed(means.reshape(-1, 3), 4, 3, 1)
    assert np.abs(_core.developed(light.reshape(-1, 3), 4, 3, 2).astype(int) - alone).max() <= 1


def test_fragments_in_front_come_from_back_to_front() -> None:
    random = np.random.default_rng(7)
    corners = random.uniform(-10.0, 70.0, (40, 3, 3))
    all_of_them = in_front_of(np.full(64 * 48, -np.inf, np.float32), corners, 64, 48)
    order = np.lexsort((all_of_them.nearness, all_of_them.pixels))
    assert (order == np.arange(len(order))).all()
    last = np.flatnonzero(np.diff(all_of_them.pixels, append=-1))
    seen = nearest(corners, 64, 48)
    assert (all_of_them.pixels[last] == seen.pixels).all()
    assert (all_of_them.triangles[last] == seen.triangles).mean() > 0.999
    depth = np.full(64 * 48, -np.inf, np.float32)
    depth[seen.pixels] = seen.nearness + 0.5
    assert len(in_front_of(depth, corners, 64, 48).pixels) == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_corners_far_away_cover_nothing_wrong(bad: float) -> None:
    corners = np.array([[[bad, 1.0, 1.0], [9.0, 1.0, 1.0], [5.0, 9.0, 1.0]]])
    found = nearest(corners, 10, 10)
    assert ((found.pixels >= 0) & (found.pixels < 100)).all()


def test_blur_is_that_of_scipy() -> None:
    image = np.random.default_rng(2).uniform(size=(31, 17)).astype(np.float32)
    for sigma in (0.4, 1.5, 20.0):
        assert_allclose(_core.blurred(image, sigma), gaussian_filter(image, sigma), atol=2e-6)


def test_enlarging_keeps_planes() -> None:
    """Bilinear between the middles of pixels; beyond those at the edge it is constant."""
    x = (np.arange(8) + 0.5) / 8.0
    image = np.stack([x + 2.0 * x[:, None], 0.0 * x + x[:, None]], axis=-1)
    large = _core.enlarged(image, 32, 16)
    u, v = (np.clip((np.arange(n) + 0.5) / n, x[0], x[-1]) for n in (32, 16))
    assert_allclose(large[..., 0], u + 2.0 * v[:, None], atol=1e-6)
    assert_allclose(large[..., 1], np.repeat(v[:, None], 32, axis=1), atol=1e-6)


def test_normals_are_averaged_within_the_crease() -> None:
    points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    faces = [[0, 2, 1], [0, 1, 3]]  # at right angles
    flat = np.repeat([[[0.0, 0.0, -1.0]], [[0.0, -1.0, 0.0]]], 3, axis=1)
    assert_allclose(_core.corner_normals(points, faces, 1.0), flat, atol=1e-15)
    half = np.array([0.0, -1.0, -1.0]) / np.sqrt(2.0)
    assert_allclose(_core.corner_normals(points, faces, 2.0)[:, 0], [half, half], atol=1e-15)
    with pytest.raises(ga.GraspAtlasError, match="triangles must be below 4"):
        _core.corner_normals(points, [[0, 1, 4]], 1.0)


def test_picture_shows_hand_and_object_on_both_sides(picture: Array) -> None:
    assert picture.shape == (450, 800, 3)
    for half in (picture[:, :400], picture[:, 400:]):
        assert share(half, "yellow") > 0.02
        assert share(half, "grey") > 0.02
        assert share(half, "red") > 0.0001


@pytest.mark.slow
def test_picture_shows_the_can(can_result: ga.Result, tmp_path: Path) -> None:
    save_picture(can_result, tmp_path / "can.png", width=480, height=270)
    assert share(pixels(tmp_path / "can.png"), "blue") > 0.0001


@pytest.mark.parametrize(
    ("wide", "high"), [(480, 360), *(pytest.param(*size, marks=pytest.mark.slow) for size in ((800, 300), (400, 600)))]
)
def test_picture_of_the_best_grasp_alone(bottle_result: ga.Result, tmp_path: Path, wide: int, high: int) -> None:
    save_picture(bottle_result, tmp_path / "best.png", width=wide, height=high, worst=False)
    seen = pixels(tmp_path / "best.png")
    assert seen.shape == (high, wide, 3)
    middle = seen[:, wide // 4 : -wide // 4]
    assert share(middle, "yellow") > 0.01
    assert share(middle, "grey") > 0.01


@pytest.mark.parametrize("worst", [False, True])
def test_normals_are_in_the_picture(worst: bool) -> None:
    """Those of a box's faces stick out beyond hand and object."""
    scene = Scene(ga.optimize(ga.load_problem("allegro_box_4"), radius=0.3), worst=worst)
    assert [exhibit.name for exhibit in scene.exhibits] == ["best", "worst"][: 1 + worst]
    camera = scene.camera(4.0 / 3.0, WINDOW)
    low, high = np.array([WINDOW[0], WINDOW[2]]), np.array([WINDOW[1], WINDOW[3]])
    for exhibit in scene.exhibits:
        seen = camera.project(vertices_of(list(exhibit.parts), ("normal",)), 4.0 / 3.0)[:, :2]
        assert ((seen > low - 1e-6) & (seen < high + 1e-6)).all()


def test_picture_has_the_size_asked_for(planar_result: ga.Result, tmp_path: Path) -> None:
    save_picture(planar_result, tmp_path / "small.png", width=320, height=213)
    assert pixels(tmp_path / "small.png").shape == (213, 320, 3)
    assert [path.name for path in tmp_path.iterdir()] == ["small.png"]
    with pytest.raises(ga.GraspAtlasError, match="at least 320"):
        save_picture(planar_result, tmp_path / "tiny.png", width=20, height=20)


@pytest.mark.parametrize("write", [export_html, save_picture])
def test_a_path_that_cannot_be_written_is_named(can_result: ga.Result, tmp_path: Path, write: object) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"cannot write.*nowhere"):
        write(can_result, tmp_path / "nowhere" / "file.png")  # type: ignore[operator]
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(ga.GraspAtlasError, match=r"cannot write.*folder"):
        write(can_result, tmp_path / "folder.png")  # type: ignore[operator]
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_a_picture_is_a_png(can_result: ga.Result, tmp_path: Path) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"must end in \.png"):
        save_picture(can_result, tmp_path / "can.jpg")
    assert not list(tmp_path.iterdir())
