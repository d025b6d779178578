"""Test the models in ``robots/``: kinematics, meshes, collision shapes, fingertips."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from helpers import ROOT, load_script, read_json
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, cKDTree

from graspatlas.collision.hulls import FEW_CORNERS

Array = NDArray[np.float64]

ROBOTS = ROOT / "robots"
URDFS = {
    "schunk_sah": ROBOTS / "schunk_sah" / "schunk_sah.urdf",
    "can": ROBOTS / "objects" / "can.urdf",
    "oil_bottle": ROBOTS / "objects" / "oil_bottle.urdf",
}
JOINTS = [f"{f}_{j}" for f in ("middle", "index") for j in ("abduction", "mcp", "pip", "dip")]
JOINTS += [f"thumb_{j}" for j in ("opposition", "abduction", "mcp", "pip", "dip")]
WIDENING = np.deg2rad(20.0)
#: Largest distance between collision shapes and visual surface [m].
COLLISION_TOLERANCE = 2e-3
#: Largest distance of a contact point from the fingertip [m] and angle between the normals [rad].
TIP_DISTANCE, TIP_ANGLE = 1e-5, np.deg2rad(8.0)


@cache
def model(name: str) -> pin.Model:
    """Return the kinematic model."""
    return pin.buildModelFromUrdf(str(URDFS[name]))


@cache
def geometry(name: str, kind: pin.GeometryType) -> pin.GeometryModel:
    """Return the visual or the collision geometry."""
    return pin.buildGeomFromUrdf(model(name), str(URDFS[name]), kind, package_dirs=[str(ROBOTS)])


def configuration(q: list[float]) -> Array:
    """Return the angles in the order of the model, given those in the order of the hand."""
    hand = model("schunk_sah")
    result = np.zeros(hand.nq)
    for name, angle in zip(JOINTS, q, strict=True):
        result[hand.joints[hand.getJointId(name)].idx_q] = angle
    return result


def read_obj(path: str) -> tuple[Array, NDArray[np.int64], Array | None]:
    """Return vertices, faces and the normal at each face corner (if there are any)."""
    rows = [line.split() for line in Path(path).read_text(encoding="ascii").splitlines()]
    vertices = np.array([row[1:] for row in rows if row[0] == "v"], float)
    normals = np.array([row[1:] for row in rows if row[0] == "vn"], float)
    corners = [[c.split("//") for c in row[1:]] for row in rows if row[0] == "f"]
    faces = np.array([[int(c[0]) - 1 for c in face] for face in corners])
    if not len(normals):
        return vertices, faces, None
    return vertices, faces, normals[np.array([[int(c[1]) - 1 for c in face] for face in corners])]


def sample(triangles: Array, spacing: float) -> Array:
    """Return points spread over triangles (m, 3, 3), about `spacing` apart."""
    rng = np.random.default_rng(0)
    edges = triangles[:, 1:] - triangles[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    counts = np.ceil(area / spacing**2).astype(int)
    weights = rng.random((counts.sum(), 2))
    weights = np.where(weights.sum(axis=1, keepdims=True) > 1.0, 1.0 - weights, weights)
    index = np.repeat(np.arange(len(triangles)), counts)
    inside = triangles[index, 0] + np.einsum("ij,ijk->ik", weights, edges[index])
    return np.vstack([triangles.reshape(-1, 3), inside])


def in_link(name: str, item: pin.GeometryObject) -> pin.SE3:
    """Return the pose of a geometry in the frame of its link."""
    return model(name).frames[item.parentFrame].placement.actInv(item.placement)


def visual_triangles(name: str, link: str) -> Iterator[Array]:
    """Yield the triangles of each visual of a link, in its frame."""
    for item in geometry(name, pin.VISUAL).geometryObjects:
        if model(name).frames[item.parentFrame].name == link:
            vertices, faces, _ = read_obj(item.meshPath)
            pose = in_link(name, item)
            yield (vertices @ pose.rotation.T + pose.translation)[faces]


def sphere_points(count: int) -> Array:
    """Return points spread over the unit sphere."""
    k = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - height**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])


def collision_hulls(name: str, link: str) -> Iterator[ConvexHull]:
    """Yield each collision shape of a link as a convex hull, in its frame."""
    for item in geometry(name, pin.COLLISION).geometryObjects:
        if model(name).frames[item.parentFrame].name == link:
            shape, pose = item.geometry, in_link(name, item)
            if isinstance(shape, coal.Cylinder):
                angle = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
                circle = shape.radius * np.column_stack([np.cos(angle), np.sin(angle)])
                ends = [np.column_stack([circle, np.full(90, s * shape.halfLength)]) for s in (-1, 1)]
                points = np.vstack(ends)
            elif isinstance(shape, coal.Sphere):
                points = shape.radius * sphere_points(2000)
            else:
                points = read_obj(item.meshPath)[0]
            yield ConvexHull(points @ pose.rotation.T + pose.translation)


def depth(hull: ConvexHull, points: Array) -> Array:
    """Return how far the points lie above the highest facet plane; negative inside [m]."""
    result: Array = (points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    return result


def collision_gaps(name: str, link: str) -> tuple[float, float]:
    """Return the largest distances collision to visual and visual to collision [m]."""
    visual = np.vstack([sample(t, 1e-3) for t in visual_triangles(name, link)])
    hulls = list(collision_hulls(name, link))
    union = []
    for hull in hulls:
        points = sample(hull.points[hull.simplices], 9e-4)
        buried = [depth(other, points) < -1e-6 for other in hulls if other is not hull]
        union.append(points[~np.any(buried, axis=0)] if buried else points)
    surface = np.vstack(union)
    outside = visual[np.min([depth(hull, visual) for hull in hulls], axis=0) > 0.0]
    to_visual = cKDTree(visual).query(surface)[0].max()
    to_collision = cKDTree(surface).query(outside)[0].max() if len(outside) else 0.0
    return float(to_visual), float(to_collision)


def body_links(name: str) -> list[str]:
    """Return the links that have a shape, one finger standing for all (the knuckles differ)."""
    links = {model(name).frames[g.parentFrame].name for g in geometry(name, pin.COLLISION).geometryObjects}
    if name != "schunk_sah":
        return sorted(links)
    return sorted(k for k in links if not k.startswith(("middle", "ring")) or k.endswith("knuckle"))


def closest_on_surface(point: Array, triangles: Array, normals: Array) -> tuple[float, Array]:
    """Return the distance of a point from triangles and the smooth normal at the closest place."""
    count = 12
    i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
    weights = np.column_stack([i.ravel(), j.ravel(), count - i.ravel() - j.ravel()]) / count
    weights = weights[weights.min(axis=1) >= 0.0]
    near = np.argsort(np.linalg.norm(triangles.mean(axis=1) - point, axis=1))[:60]
    places = np.einsum("wk,tkx->twx", weights, triangles[near]).reshape(-1, 3)
    smooth = np.einsum("wk,tkx->twx", weights, normals[near]).reshape(-1, 3)
    distance = np.linalg.norm(places - point, axis=1)
    best = int(np.argmin(distance))
    return float(distance[best]), smooth[best] / np.linalg.norm(smooth[best])


def collision_model() -> pin.GeometryModel:
    """Return the collision geometry of the hand with the pairs that the SRDF leaves."""
    shapes = geometry("schunk_sah", pin.COLLISION).copy()
    shapes.addAllCollisionPairs()
    srdf = URDFS["schunk_sah"].with_suffix(".srdf")
    pin.removeCollisionPairs(model("schunk_sah"), shapes, str(srdf))
    return shapes


@pytest.mark.parametrize("grasp", ["can", "oil_bottle"])
def test_link_poses(grasp: str) -> None:
    """The distal links stand where the released grasps put them."""
    hand, expected = model("schunk_sah"), read_json("link_poses.json")
    assert expected["joints"] == JOINTS
    data = hand.createData()
    pin.framesForwardKinematics(hand, data, configuration(expected["grasps"][grasp]["q"]))
    for link, pose in expected["grasps"][grasp]["T_palm_link"].items():
        T_palm_link = data.oMf[hand.getFrameId(link)].homogeneous
        np.testing.assert_allclose(T_palm_link, np.array(pose), rtol=0.0, atol=1e-11)


def test_joint_names_and_limits() -> None:
    """The URDF lists the 13 joints in order, with limits 20 degrees beyond the nominal ones."""
    hand = model("schunk_sah")
    assert hand.name == "schunk_sah"
    assert hand.nq == hand.nv == len(JOINTS) == 13
    text = URDFS["schunk_sah"].read_text(encoding="utf-8")
    position = [text.index(f'<joint name="{name}" type="revolute">') for name in JOINTS]
    assert position == sorted(position)
    for name in JOINTS:
        k = hand.joints[hand.getJointId(name)].idx_q
        abduction = name.endswith("abduction")
        nominal = np.array([-np.pi / 8, np.pi / 8] if abduction else [0.0, np.pi / 2])
        limits = [hand.lowerPositionLimit[k], hand.upperPositionLimit[k]]
        np.testing.assert_allclose(limits, nominal + np.array([-WIDENING, WIDENING]), atol=1e-13)


def test_ring_finger_is_fixed() -> None:
    """The ring finger is bent by 75 degrees at each of its three flexion joints."""
    hand = model("schunk_sah")
    data = hand.createData()
    pin.framesForwardKinematics(hand, data, pin.neutral(hand))
    axis = np.array([0.0, -0.034301, 0.999412])
    for count, part in enumerate(["proximal", "medial", "distal"], start=1):
        rotation = data.oMf[hand.getFrameId(f"ring_{part}")].rotation
        angle = np.deg2rad(75.0 * count)
        expected = np.cos(angle) * axis + np.sin(angle) * np.array([1.0, 0.0, 0.0])
        np.testing.assert_allclose(rotation[:, 0], expected, atol=1e-6)


@pytest.mark.parametrize("finger", ["middle", "index", "thumb", "ring"])
def test_tip_frames(finger: str) -> None:
    """Each tip frame lies on the fingertip pad with z outward."""
    hand = model("schunk_sah")
    tip, distal = (hand.frames[hand.getFrameId(f"{finger}_{part}")] for part in ("tip", "distal"))
    pose = distal.placement.actInv(tip.placement)
    distance, normal = closest_on_surface(pose.translation, *fingertip(f"{finger}_distal"))
    assert distance < 5e-4
    assert normal @ pose.rotation[:, 2] > np.cos(np.deg2rad(10.0))


def fingertip(link: str) -> tuple[Array, Array]:
    """Return the triangles of a distal link's visuals and the normals at their corners."""
    triangles, normals = [], []
    for item in geometry("schunk_sah", pin.VISUAL).geometryObjects:
        if model("schunk_sah").frames[item.parentFrame].name == link:
            assert in_link("schunk_sah", item).isIdentity(1e-9)
            vertices, faces, corner_normals = read_obj(item.meshPath)
            assert corner_normals is not None
            triangles.append(vertices[faces])
            normals.append(corner_normals)
    return np.vstack(triangles), np.vstack(normals)


@pytest.mark.parametrize("contact", read_json("contact_points.json")["contacts"], ids=str)
def test_fingertips_pass_through_the_contact_points(contact: dict[str, Any]) -> None:
    """The visual fingertip runs through the released contact points, at the released slope."""
    point, outward = np.array(contact["point"]), np.array(contact["normal"])
    distance, normal = closest_on_surface(point, *fingertip(contact["link"]))
    assert distance < TIP_DISTANCE
    assert normal @ outward / np.linalg.norm(outward) > np.cos(TIP_ANGLE)


@pytest.mark.parametrize("name", URDFS)
def test_collision_shapes_are_convex(name: str) -> None:
    """Pinocchio loads every collision mesh as a convex shape, not as a BVH, and none is thinned."""
    for item in geometry(name, pin.COLLISION).geometryObjects:
        assert isinstance(item.geometry, coal.ConvexBase | coal.Cylinder | coal.Sphere), item.name
        if isinstance(item.geometry, coal.ConvexBase):
            assert item.geometry.num_points <= FEW_CORNERS


@pytest.mark.slow
@pytest.mark.parametrize(("name", "link"), [(n, link) for n in URDFS for link in body_links(n)])
def test_collision_follows_visual(name: str, link: str) -> None:
    """Collision shapes and visual surface stay within 2 mm of each other."""
    to_visual, to_collision = collision_gaps(name, link)
    assert to_visual < COLLISION_TOLERANCE
    assert to_collision < COLLISION_TOLERANCE


@pytest.mark.parametrize("posture", ["zero", "can", "oil_bottle"])
def test_no_self_collision(posture: str) -> None:
    """The hand does not touch itself when straight, nor in the released grasps."""
    hand, shapes = model("schunk_sah"), collision_model()
    q = [0.0] * 13 if posture == "zero" else read_json("link_poses.json")["grasps"][posture]["q"]
    data, shape_data = hand.createData(), shapes.createData()
    assert not pin.computeCollisions(hand, data, shapes, shape_data, configuration(q), False)


def test_some_random_postures_are_free_and_some_collide() -> None:
    """The collision pairs neither block every posture nor allow every one."""
    hand, shapes = model("schunk_sah"), collision_model()
    data, shape_data = hand.createData(), shapes.createData()
    rng = np.random.default_rng(0)
    postures = rng.uniform(hand.lowerPositionLimit, hand.upperPositionLimit, (200, hand.nq))
    hits = [pin.computeCollisions(hand, data, shapes, shape_data, q, True) for q in postures]
    assert 0.05 < np.mean(hits) < 0.95


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["schunk_sah", "objects"])
def test_meshes_can_be_made_again(folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Running the script again gives the same files."""
    script = load_script(folder)
    monkeypatch.setattr(script, "FOLDER", tmp_path)
    script.main()
    kept = ROBOTS / folder / "meshes"
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in kept.iterdir())
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (kept / path.name).read_bytes(), path.name
