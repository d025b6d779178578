"""What the page of an atlas is made of: packed numbers, the tree of joints, the unrolled surface."""

from __future__ import annotations

import base64
import zlib
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import slow_but

import graspatlas as ga
from graspatlas.viewer.explorer.charts import Charts
from graspatlas.viewer.explorer.numbers import MISSING, Numbers
from graspatlas.viewer.explorer.tree import joint_tree, world_placements
from graspatlas.viewer.explorer.unrolled import unrolled
from graspatlas.viewer.scene.velocity_ellipsoid import velocity_ellipsoid, velocity_ellipsoids


def unpacked(numbers: Numbers, name: str) -> np.ndarray:
    """An array read again, as the page does."""
    entry, packed = numbers.entries[name], zlib.decompress(base64.b64decode(numbers.text()))
    kind = np.dtype(entry["type"].removesuffix("Array").lower())
    rows, columns = entry["shape"]
    step = np.array(entry.get("step", [1.0] * columns))
    count = rows * int((step > 0.0).sum())
    planes = np.frombuffer(packed, np.uint8, count * kind.itemsize, entry["at"]).reshape(kind.itemsize, count)
    values = np.ascontiguousarray(planes.T).view(kind).ravel()
    if "step" not in entry:
        return values.reshape(rows, columns)
    codes = np.full((columns, rows), float(entry["log"]))
    codes[step > 0.0] = values.reshape(-1, rows)
    low = np.array(entry["low"])[:, None]
    read = low + step[:, None] * (codes - entry["log"])
    read = np.where(codes == 0, 0.0, np.exp(read)) if entry["log"] else read
    return np.where(codes == MISSING, np.nan, read).T


def test_numbers_are_read_as_they_were_written() -> None:
    random = np.random.default_rng(0)
    exact = {"small": np.arange(7, dtype=np.uint8), "wide": random.integers(0, 2**32, (5, 3)).astype(np.uint32)}
    rounded = random.normal(size=(50, 4))
    rounded[:, 1], rounded[3, 2] = 0.25, np.nan
    lengths = np.exp(random.normal(scale=8.0, size=(40, 2)))
    lengths[::7, 0] = 0.0
    numbers = Numbers()
    for name, values in exact.items():
        numbers.add(name, values)
    numbers.add_rounded("rounded", rounded)
    numbers.add_rounded("lengths", lengths, log=True)
    for name, values in exact.items():
        assert (unpacked(numbers, name) == values.reshape(len(values), -1)).all()
    np.testing.assert_allclose(unpacked(numbers, "rounded"), rounded, atol=1e-4)
    assert (unpacked(numbers, "rounded")[:, 1] == 0.25).all()
    np.testing.assert_allclose(unpacked(numbers, "lengths"), lengths, rtol=1e-3)
    assert ((unpacked(numbers, "lengths") == 0.0) == (lengths == 0.0)).all()


@pytest.mark.parametrize("name", ["planar_hand", "gripper_skittle", "three_finger_cup", "schunk_can", "allegro_box_4"])
def test_the_tree_places_all_links(name: str) -> None:
    hand = ga.load_problem(name).hand
    lower, upper = np.array(list(hand.limits_by_name.values())).T
    inside = np.clip([lower, upper], -np.pi, np.pi)
    positions = np.random.default_rng(0).uniform(*inside, (5, len(hand.joints)))
    placements = world_placements(joint_tree(hand), positions)
    for i, row in enumerate(positions):
        links = hand.link_placements(hand.configuration(dict(zip(hand.joints, row, strict=True))))
        for link, T in links.items():
            joint, T_joint_link = hand.frame(link)
            np.testing.assert_allclose(placements[joint, i] @ T_joint_link, T, atol=1e-12)


@pytest.mark.parametrize(
    "name", slow_but(["can_result", "bottle_result", "planar_result", "gripper"], "planar_result", "gripper")
)
def test_ellipsoids_of_a_batch_are_those_of_its_grasps(name: str, request: pytest.FixtureRequest) -> None:
    result = request.getfixturevalue(name)
    grasps = ga.Grasps(result.problem, result.atlas.centers[::97], result.system)
    axes, semi_axes = velocity_ellipsoids(grasps)
    for i, grasp in enumerate(grasps):
        R, lengths = velocity_ellipsoid(grasp)
        np.testing.assert_allclose(semi_axes[i], lengths, atol=1e-9 * max(lengths.max(), 1e-9))
        A, B = (r * s**2 @ r.T for r, s in ((R, lengths), (axes[i], semi_axes[i])))
        np.testing.assert_allclose(A, B, atol=1e-9 * max(A.max(), 1e-12))
        assert np.linalg.det(axes[i]) == pytest.approx(1.0)


def test_unrolled_charts_keep_their_distances(planar_result: ga.Result) -> None:
    atlas = planar_result.atlas
    centers, R = unrolled(atlas)
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.tile(np.eye(2), (len(R), 1, 1)), atol=1e-9)
    i, j = atlas.neighbour_pairs.T
    apart = np.linalg.norm(centers[i] - centers[j], axis=1)
    true = [
        np.linalg.norm(atlas.system.difference(atlas.centers[a], atlas.centers[b])) for a, b in zip(i, j, strict=True)
    ]
    ratios = apart / true
    assert np.percentile(ratios, 5) > 0.85
    assert np.percentile(ratios, 95) < 1.15


def test_a_closed_surface_is_torn_and_not_crushed(sphere: ga.Atlas) -> None:
    centers, _ = unrolled(sphere)
    i, j = sphere.neighbour_pairs.T
    apart = np.linalg.norm(centers[i] - centers[j], axis=1)
    assert np.ptp(centers, axis=0).min() > 3.0  # half way round is pi
    true = np.linalg.norm(sphere.centers[i] - sphere.centers[j], axis=1)
    assert np.median(apart / true) == pytest.approx(1.0, rel=0.15)


def changed(atlas: ga.Atlas, **others: object) -> SimpleNamespace:
    """An atlas with other arrays."""
    names = ("system", "radius", "n_charts", "centers", "bases", "neighbour_pairs")
    return SimpleNamespace(**{name: getattr(atlas, name) for name in names} | others)


def test_mirrored_tangent_bases_change_no_picture(planar_result: ga.Result) -> None:
    atlas = planar_result.atlas
    mirrored = np.random.default_rng(0).random(atlas.n_charts) < 0.5
    bases = atlas.bases.copy()
    bases[mirrored, 1] *= -1.0
    centers, R = unrolled(atlas)
    others, others_R = unrolled(changed(atlas, bases=bases))
    i, j = np.random.default_rng(1).integers(0, atlas.n_charts, (2, 200))
    apart, others_apart = (np.linalg.norm(y[i] - y[j], axis=1) for y in (centers, others))
    np.testing.assert_allclose(others_apart, apart, atol=1e-6 * apart.max())
    flipped = np.linalg.det(others_R) * np.linalg.det(R) < 0.0
    assert (flipped == mirrored).all() or (flipped == ~mirrored).all()


def test_parts_lie_beside_each_other(sphere: ga.Atlas) -> None:
    """Two caps of a sphere, and the charts between them alone, as many parts."""
    height, pairs = sphere.centers[:, 2], sphere.neighbour_pairs
    caps = np.where(height > 0.6, 1, np.where(height < -0.8, -1, 0))
    within = (caps[pairs[:, 0]] == caps[pairs[:, 1]]) & (caps[pairs[:, 0]] != 0)
    centers, _ = unrolled(changed(sphere, neighbour_pairs=pairs[within]))
    assert np.isfinite(centers).all()
    for cap in (1, -1):
        inside, outside = centers[caps == cap], centers[caps != cap]
        nearest = np.linalg.norm(inside[:, None] - outside[None], axis=2).min()
        assert nearest > sphere.radius
        assert np.ptp(inside, axis=0).min() > 10.0 * sphere.radius
    alone = centers[caps == 0]
    assert np.linalg.norm(alone[1:] - alone[:-1], axis=1).min() > sphere.radius


def test_functions_are_not_asked_again(small_result: ga.Result) -> None:
    """What a function has rejected is known from the result, as it is of files, which keep no functions."""
    asked = []

    def left(grasp: ga.Grasp) -> bool:
        asked.append(grasp)
        return bool(grasp.object_xyz[0] < 0.0)

    result = ga.optimize(small_result.problem, dimension=2, radius=0.2, epsilon=0.5, require=[ga.CollisionFree(), left])
    before = len(asked)
    names, bits = Charts(result).rejections
    assert len(asked) == before
    assert ((bits == 0) == result.accepted).all()
    assert names[0].startswith("collision_free")
    assert before > 0


def test_a_single_chart_is_laid_out(can: ga.Problem) -> None:
    alone = ga.optimize(can, dimension=2, require=[], max_charts=1).atlas
    centers, R = unrolled(alone)
    np.testing.assert_allclose(centers, np.zeros((1, 2)))
    np.testing.assert_allclose(R[0] @ R[0].T, np.eye(2), atol=1e-12)
