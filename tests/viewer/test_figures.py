"""Figures: polygons, colours, and that every function draws something of the user's own result."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from PIL import Image

import graspatlas as ga
from graspatlas.analysis.climb import climb
from graspatlas.viewer import figures
from graspatlas.viewer.figures.ellipse import extreme_semi_axes
from graspatlas.viewer.figures.indices import SINGULAR_BELOW, with_index
from graspatlas.viewer.figures.portrait import portrait
from graspatlas.viewer.figures.style import QUALITY, readable
from graspatlas.viewer.scene.polygons import chart_polygons, default_coordinates, object_pose, open_charts, principal

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def stages() -> list[ga.Atlas]:
    sphere = ga.systems.Sphere(3)
    return [ga.build_atlas(sphere, [0, 0, 1], radius=0.3, epsilon=0.2, max_charts=n) for n in (20, 60, 10000)]


def pixels(figure: Figure) -> Array:
    stream = io.BytesIO()
    figure.savefig(stream, dpi=60)
    with Image.open(stream) as image:
        return np.asarray(image.convert("RGB"), float) / 255.0


def assert_drawn(figure: Figure) -> None:
    """There is ink, in more than a few colours, and not everywhere."""
    picture = pixels(figure)
    ink = (picture.min(axis=2) < 0.9).mean()
    assert 0.01 < ink < 0.9
    assert len(np.unique(np.round(picture.reshape(-1, 3), 1), axis=0)) > 5


DRAWN: dict[str, Callable[[ga.Result], Figure]] = {
    "atlas": figures.plot_atlas,
    "best and worst": figures.plot_best_and_worst,
    "ellipsoid": lambda result: figures.plot_ellipsoid(result.problem, {"best": result.best, "worst": result.worst}),
    "one ellipsoid": lambda result: figures.plot_ellipsoid(result.problem, result.best),
    "local maxima": figures.plot_local_maxima,
    "climbs": lambda result: figures.plot_climbs(result, [climb(result, chart) for chart in (0, 9)]),
    "planar grasp": lambda result: figures.plot_planar_grasp(result.problem, result.best),
    "planar indices": figures.plot_planar_indices,
    "pose": lambda result: figures.plot_atlas(result, coordinates=object_pose(result.problem)),
    "values": lambda result: figures.plot_atlas(result, values=result.atlas.volumes, label="area"),
}


@pytest.mark.parametrize("name", DRAWN)
def test_figures_of_a_planar_result_are_drawn(planar_result: ga.Result, name: str) -> None:
    assert_drawn(DRAWN[name](planar_result))


@pytest.mark.slow
def test_figures_of_a_hand_in_space_are_drawn(small_result: ga.Result) -> None:
    assert_drawn(figures.plot_best_and_worst(small_result, label="volume"))
    assert_drawn(figures.plot_local_maxima(small_result))


def test_an_atlas_that_is_no_surface_is_drawn_by_its_centres(bottle: ga.Problem) -> None:
    result = ga.optimize(bottle, dimension=3, radius=0.5, epsilon=0.5)
    assert result.dimension == 3
    assert_drawn(figures.plot_atlas(result))
    with pytest.raises(ga.GraspAtlasError, match="polygons when k = 2"):
        figures.plot_growth([result.atlas])


def test_growth_tells_open_charts_from_bounded_ones(stages: list[ga.Atlas]) -> None:
    counts = [int(open_charts(atlas).sum()) for atlas in stages]
    assert counts[0] > 0
    assert counts[1] > 0
    assert counts[2] == 0
    assert stages[2].complete
    picture = pixels(figures.plot_growth(stages))
    red = (picture[..., 0] > 0.6) & (picture[..., 2] < 0.35)
    blue = (picture[..., 2] > 0.6) & (picture[..., 0] < 0.4)
    third = picture.shape[1] // 3
    assert red[:, :third].sum() > 50
    assert blue[:, 2 * third :].sum() > 200
    assert red[: int(0.85 * len(red)), 2 * third :].sum() == 0


def test_polygons_lie_in_the_tangent_planes(stages: list[ga.Atlas]) -> None:
    atlas = stages[2]
    polygons = chart_polygons(atlas, default_coordinates(atlas))
    assert len(polygons) == atlas.n_charts
    for center, corners in zip(atlas.centers, polygons, strict=True):
        assert_allclose((corners - center) @ center, 0.0, atol=1e-9)
    areas = [0.5 * np.linalg.norm(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)) for p in polygons]
    assert_allclose(areas, atlas.volumes, rtol=1e-6)


def test_principal_coordinates_keep_distances_where_they_hold_all_variance(stages: list[ga.Atlas]) -> None:
    atlas = stages[2]
    p = principal(atlas).of(atlas.centers)
    assert_allclose(np.linalg.norm(p - p[0], axis=1), np.linalg.norm(atlas.centers - atlas.centers[0], axis=1))


def test_object_pose_is_the_pose_of_the_grasp(planar_result: ga.Result) -> None:
    coordinates = object_pose(planar_result.problem)
    x, y, angle = coordinates.of(planar_result.atlas.centers[:1])[0]
    at_x1 = planar_result.at_x1
    assert_allclose([x, y], 1e3 * at_x1.object_xyz[:2], atol=1e-9)
    assert angle == pytest.approx(0.0, abs=1e-6)


def test_lightness_of_the_colour_scale_grows() -> None:
    red, green, blue, _ = QUALITY(np.linspace(0.0, 1.0, 64)).T
    grey = 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2
    assert (np.diff(grey) > 0.0).all()
    assert red[0] > 2.0 * green[0]
    assert green[-1] > red[-1]


def test_requirements_are_seen(planar_result: ga.Result) -> None:
    some = planar_result.qualities > np.median(planar_result.qualities)
    result = replace(planar_result, accepted=~some)
    picture = pixels(figures.plot_atlas(result))
    grey = (np.ptp(picture, axis=2) < 0.02) & (np.abs(picture[..., 0] - 0.81) < 0.03)
    assert grey.mean() > 0.01
    none = replace(planar_result, accepted=np.zeros(planar_result.atlas.n_charts, bool))
    with pytest.raises(ga.GraspAtlasError, match="meets the requirements"):
        figures.plot_atlas(none)


def test_thresholds_of_the_paper_find_the_singular_charts(planar_result: ga.Result) -> None:
    for name, limit in SINGULAR_BELOW.items():
        scaled = with_index(planar_result, name)
        assert 1 <= (scaled.qualities < limit).sum() < 20
        assert scaled.worst.quality < limit


def test_extreme_semi_axes_make_the_inverse_condition_number(planar_result: ga.Result) -> None:
    scaled = with_index(planar_result, "inverse_condition_number")
    for grasp in (scaled.best, scaled.worst, scaled.at_x1):
        longest, shortest = extreme_semi_axes(scaled.problem, grasp)
        assert shortest / longest == pytest.approx(grasp.quality)


@pytest.mark.slow
def test_portrait_shows_hand_and_object_on_white(can_result: ga.Result) -> None:
    picture = portrait(can_result.problem, can_result.best, width=160, height=160) / 255.0
    assert picture.shape == (160, 160, 3)
    corners = picture[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert_allclose(corners, 1.0)
    blue = (picture[..., 2] > 0.3) & (picture[..., 2] > 1.6 * picture[..., 0])
    assert blue.mean() > 0.002
    assert 0.2 < (picture.min(axis=2) < 0.99).mean() < 0.9


def test_figures_leave_the_users_style_alone(planar_result: ga.Result) -> None:
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    assert_drawn(figures.plot_planar_grasp(planar_result.problem, planar_result.best))
    assert dict(mpl.rcParams) == before


def test_a_notebook_shows_the_figure(planar_result: ga.Result) -> None:
    figure = figures.plot_planar_grasp(planar_result.problem, planar_result.best)
    assert figure._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.0, "0"),
        (0.36, "0.36"),
        (12182.8, "12183"),
        (1.32e8, r"$1.32 \times 10^{8}$"),
        (5e-4, r"$5.00 \times 10^{-4}$"),
    ],
)
def test_numbers_are_readable(value: float, expected: str) -> None:
    assert readable(value) == expected


def test_wrong_input_is_named(planar_result: ga.Result, small_result: ga.Result) -> None:
    with pytest.raises(ga.GraspAtlasError, match=r"Result or an Atlas, got str"):
        figures.plot_atlas("atlas")  # type: ignore[arg-type]
    with pytest.raises(ga.GraspAtlasError, match="one for each chart"):
        figures.plot_atlas(planar_result, values=[1.0, 2.0])
    with pytest.raises(ga.GraspAtlasError, match="at least one atlas"):
        figures.plot_growth([])
    with pytest.raises(ga.GraspAtlasError, match="at least one grasp"):
        figures.plot_ellipsoid(planar_result.problem, {})
    with pytest.raises(ga.GraspAtlasError, match="at least one climb"):
        figures.plot_climbs(planar_result, [])
    with pytest.raises(ga.GraspAtlasError, match="is not planar"):
        figures.plot_planar_grasp(small_result.problem, small_result.best)
    with pytest.raises(ga.GraspAtlasError, match="is not planar"):
        figures.plot_planar_indices(small_result)
