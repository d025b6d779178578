"""Quality indices: those that have a name, and callables of the user."""

from __future__ import annotations

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.quality import INDICES, evaluate


@pytest.fixture(scope="module")
def few(bottle) -> ga.Grasps:
    atlas = ga.build_atlas(bottle.system(2), bottle.x1_array, radius=0.3, epsilon=0.5)
    return ga.Grasps(bottle, atlas.centers, atlas.system)


def height(grasp: ga.Grasp) -> float:
    """Height of the object above the palm."""
    return float(grasp.T_palm_object[2, 3])


@ga.batched
def heights(grasps: ga.Grasps) -> np.ndarray:
    return grasps.T_palm_object[:, 2, 3]


def test_indices_follow_from_the_semi_axes(few):
    axes = few.semi_axes
    assert axes.shape == (len(few), 6)
    assert (np.diff(axes, axis=1) >= 0.0).all()
    assert (axes > 0.0).all()
    np.testing.assert_allclose(ga.quality.manipulability_volume(few), axes.prod(axis=1), rtol=1e-12)
    np.testing.assert_allclose(ga.quality.inverse_condition_number(few), axes[:, 0] / axes[:, -1], rtol=1e-12)
    np.testing.assert_allclose(ga.quality.smallest_semi_axis(few), axes[:, 0], rtol=1e-12)
    for name, index in INDICES.items():
        np.testing.assert_array_equal(evaluate(name, few), index(few))


def test_a_callable_for_each_grasp_or_for_all_at_once(few, bottle):
    np.testing.assert_array_equal(evaluate(height, few), few.x[:, 15])
    np.testing.assert_array_equal(evaluate(heights, few), few.x[:, 15])
    one = ga.optimize(bottle, radius=0.3, quality=height, require=[])
    two = ga.optimize(bottle, radius=0.3, quality=heights, require=[])
    np.testing.assert_array_equal(one.qualities, two.qualities)
    assert one.best.object_xyz[2] == one.qualities.max() == one.best.quality
    assert one.summary()["quality"]["name"] == "height"
    assert one.check().passed


def test_classes_with_a_call_and_lambdas_are_indices(few):
    class Reach:
        def __call__(self, grasp: ga.Grasp) -> float:
            return float(np.linalg.norm(grasp.object_xyz))

    np.testing.assert_allclose(evaluate(Reach(), few), np.linalg.norm(few.x[:, 13:16], axis=1), rtol=1e-12)
    assert (evaluate(lambda grasp: 7, few) == 7.0).all()
    assert (evaluate(lambda grasp: np.float32(2.0), few) == 2.0).all()
    assert (evaluate(lambda grasp: True, few) == 1.0).all()


def test_grasps_hold_what_an_index_needs(few):
    for i in (0, len(few) - 1):
        grasp = few[i]
        np.testing.assert_array_equal(grasp.x, few.x[i])
        np.testing.assert_array_equal(grasp.q, few.q[i])
        for name in ("T_palm_object", "contact_points", "contact_normals", "J", "G", "semi_axes"):
            np.testing.assert_allclose(getattr(grasp, name), getattr(few, name)[i], rtol=1e-12, atol=1e-12)
        assert grasp.joints == few.joints
        assert np.isnan(grasp.quality)
        assert "object at" in str(grasp)
    assert len(list(few)) == len(few)
    assert (few.J.shape, few.G.shape) == ((len(few), 9, 13), (len(few), 6, 9))


WRONG = {
    "raises": (lambda grasp: 1 / 0, "ZeroDivisionError"),
    "two numbers": (lambda grasp: [1.0, 2.0], "one number"),
    "nothing": (lambda grasp: None, "NaN|None|number"),
    "text": (lambda grasp: "good", "good"),
    "NaN": (lambda grasp: float("nan"), "NaN"),
    "one NaN": (lambda grasp: np.sqrt(-1.0 + 0.0j).real * np.nan, "NaN"),
    "batch raises": (ga.batched(lambda grasps: grasps.colour), "AttributeError"),
    "batch of another length": (ga.batched(lambda grasps: np.zeros(3)), "numbers"),
    "batch of columns": (ga.batched(lambda grasps: grasps.contact_points), "shape"),
    "batch of one number": (ga.batched(lambda grasps: 1.0), "shape"),
    "batch with NaN": (ga.batched(lambda grasps: np.where(np.arange(len(grasps)) == 2, np.nan, 1.0)), "grasp 2"),
    "no argument": (lambda: 1.0, "TypeError"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_indices_are_reported(few, name):
    index, words = WRONG[name]
    with pytest.raises(ga.GraspAtlasError, match=words):
        evaluate(index, few)


def test_a_broken_index_names_itself_and_its_cause(few):
    def broken(grasp):
        raise KeyError("friction")

    with pytest.raises(ga.GraspAtlasError, match=r"'broken' raised KeyError.*friction") as caught:
        evaluate(broken, few)
    assert isinstance(caught.value.__cause__, KeyError)


def test_unknown_names_are_refused_before_the_work(bottle):
    with pytest.raises(ga.GraspAtlasError, match="did you mean 'manipulability_volume'"):
        ga.optimize(bottle, radius=1e-4, quality="manipulability_volum")
    with pytest.raises(ga.GraspAtlasError, match="quality index 'zzz' is unknown; known: "):
        ga.optimize(bottle, radius=1e-4, quality="zzz")


@pytest.mark.parametrize("quality", [3, ["a"], 1.5, {"a": 1}])
def test_what_is_neither_name_nor_callable_is_refused(bottle, quality):
    with pytest.raises(ga.GraspAtlasError, match="quality"):
        ga.optimize(bottle, radius=1e-4, quality=quality)


def test_every_named_index_is_described():
    assert {"inverse_condition_number", "manipulability_volume", "smallest_semi_axis"} <= set(INDICES)
    assert all((index.__doc__ or "").strip() for index in INDICES.values())
