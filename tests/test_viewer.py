"""The viewer: meshes, velocity ellipsoid, scene and picture."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from screens import pixels, share

import graspatlas as ga
from graspatlas.viewer import export_html, save_picture
from graspatlas.viewer.render.picture import WINDOW
from graspatlas.viewer.render.raster import nearest
from graspatlas.viewer.render.shading import to_linear, to_screen
from graspatlas.viewer.scene import bodies, meshes, stick_figure, velocity_ellipsoid
from graspatlas.viewer.scene.scene import CONTACT_RADIUS, Scene, vertices_of

Array = NDArray[np.float64]


@pytest.fixture(params=["can_result", "bottle_result"])
def result(request: pytest.FixtureRequest) -> ga.Result:
    found: ga.Result = request.getfixturevalue(request.param)
    return found


@pytest.fixture(scope="module")
def picture(bottle_result: ga.Result, tmp_path_factory: pytest.TempPathFactory) -> Array:
    path = tmp_path_factory.mktemp("picture") / "bottle.png"
    save_picture(bottle_result, path, width=800, height=450)
    return pixels(path)


def volume(mesh: meshes.Mesh) -> float:
    """Volume that a closed mesh encloses; negative when it is inside out."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c))) / 6.0


# Meshes


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (meshes.box([0.1, 0.2, 0.3]), 0.006),
        (meshes.ellipsoid([0.1, 0.2, 0.3]), 4.0 / 3.0 * np.pi * 0.006),
        (meshes.lathe([[0, -0.5], [0.2, -0.5], [0.2, 0.5], [0, 0.5]]), np.pi * 0.04),
        (meshes.capsule(0.1, 0.2), np.pi * 0.01 * (0.4 + 4.0 / 30.0)),
        (meshes.arrow(np.zeros(3), np.array([0.0, 0.6, 0.8]), 0.04, 0.001), None),
    ],
    ids=["box", "ellipsoid", "cylinder", "capsule", "arrow"],
)
def test_shapes_are_closed_and_face_outwards(mesh: meshes.Mesh, expected: float | None) -> None:
    assert volume(mesh) > 0.0
    if expected is not None:
        assert volume(mesh) == pytest.approx(expected, rel=0.02)
    assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-9)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    assert (np.sum(flat[:, None] * mesh.normals[mesh.faces], axis=2) > 0.0).all()


def test_smooth_keeps_edges_sharp_and_rounds_the_rest() -> None:
    assert len(meshes.box([1.0, 1.0, 1.0]).vertices) == 24
    ball = meshes.ellipsoid([1.0, 1.0, 1.0])
    rounded = meshes.smooth(ball.vertices, ball.faces)
    assert_allclose(rounded.normals, rounded.vertices, atol=0.02)


def test_arrow_starts_and_ends_where_it_should() -> None:
    start, direction = np.array([0.1, 0.2, 0.3]), np.array([0.0, -1.0, 0.0])
    along = (meshes.arrow(start, direction, 0.04, 0.001).vertices - start) @ direction
    assert along.min() == pytest.approx(0.0, abs=1e-12)
    assert along.max() == pytest.approx(0.04)


URDF = """<robot name="r"><link name="base">{visual}</link></robot>"""
VISUAL = '<visual><geometry><{shape}/></geometry><material name="m"><color rgba="1 0 0 1"/></material></visual>'


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ('box size="0.1 0.2 0.3"', 0.006),
        ('sphere radius="0.1"', 4.0 / 3.0 * np.pi * 0.001),
        ('cylinder radius="0.1" length="0.3"', np.pi * 0.003),
        ('mesh filename="tetrahedron.stl" scale="2 2 2"', 8.0 / 6.0),
    ],
)
def test_any_urdf_geometry_is_shown(can_result: ga.Result, tmp_path: Path, shape: str, expected: float) -> None:
    corners = np.vstack([np.zeros(3), np.eye(3)])
    facets = [
        "facet normal 0 0 0 outer loop "
        + " ".join(f"vertex {x} {y} {z}" for x, y, z in corners[list(face)])
        + " endloop endfacet"
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    ]
    (tmp_path / "tetrahedron.stl").write_text("solid t\n" + "\n".join(facets) + "\nendsolid t\n")
    urdf = URDF.format(visual=VISUAL.format(shape=shape)).replace("tetra", f"{tmp_path}/tetra")
    problem = replace(can_result.problem, object=ga.Body("thing", urdf))
    ((mesh, T, colour),) = bodies.BodyShapes(problem).object()
    assert volume(mesh) == pytest.approx(expected, rel=0.02)
    assert_allclose(T, np.eye(4))
    assert colour == (1.0, 0.0, 0.0, 1.0)


def test_a_body_without_visuals_shows_its_collision_shapes(can_result: ga.Result) -> None:
    collision = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    problem = replace(can_result.problem, object=ga.Body("thing", URDF.format(visual=collision)))
    assert len(list(bodies.BodyShapes(problem).object())) == 1


@pytest.mark.parametrize("name", ["missing.obj", "notes.txt"])
def test_a_mesh_that_cannot_be_read_is_named(can_result: ga.Result, tmp_path: Path, name: str) -> None:
    (tmp_path / "notes.txt").write_text("this is no mesh")
    urdf = URDF.format(visual=VISUAL.format(shape=f'mesh filename="{tmp_path}/{name}"'))
    problem = replace(can_result.problem, object=ga.Body("thing", urdf))
    with pytest.raises(ga.GraspAtlasError, match=f"'thing'.*{name}"):
        Scene(replace(can_result, problem=problem))


# Bodies without shapes


@pytest.fixture(scope="module")
def planar() -> ga.Result:
    return ga.optimize(ga.load_problem("planar_hand"))


def without_shapes(urdf: str) -> str:
    return re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf, flags=re.DOTALL)


def test_a_body_without_shapes_is_sketched(planar: ga.Result, tmp_path: Path) -> None:
    hand, body = (replace(b, urdf=without_shapes(b.urdf)) for b in (planar.problem.hand, planar.problem.object))
    planar = replace(planar, problem=replace(planar.problem, hand=hand, object=body))
    for exhibit in Scene(planar).exhibits:
        contacts = np.array([part.T[:3, 3] for part in exhibit.parts if part.group == "contact"])
        for group in ("hand", "object"):
            points = np.concatenate([dense(p.mesh.moved(p.T)) for p in exhibit.parts if p.group == group])
            assert cKDTree(points).query(contacts)[0].max() < 0.01
    save_picture(planar, tmp_path / "planar.png", width=480, height=270)
    assert share(pixels(tmp_path / "planar.png"), "red") > 0.0001


def test_a_planar_ellipsoid_is_flat(planar: ga.Result) -> None:
    axes, semi_axes = velocity_ellipsoid.velocity_ellipsoid(planar.best)
    assert_allclose(np.abs(axes[:, 2]), [0.0, 0.0, 1.0], atol=1e-12)
    assert semi_axes[1] > 0.0
    assert semi_axes[2] == 0.0


def test_sheets_and_curves_are_sketched(planar: ga.Result) -> None:
    """The patches of a spatial contact: free both ways, along a curve, not at all."""
    contact = planar.problem.contacts[0]
    radius = contact.object.radius  # type: ignore[attr-defined]
    sheet = replace(contact.object, v_interval=(0.0, 0.1))  # type: ignore[call-arg]
    for frozen, expected in (({}, 1), ({"v": 0.0}, 1), ({"u": 1.6, "v": 0.0}, 0)):
        contacts = (replace(contact, object=sheet, frozen=frozen),)
        shapes = list(stick_figure.outlines(replace_contacts(planar.problem, contacts)))
        assert len(shapes) == expected
        for mesh, _, _ in shapes:
            across = np.linalg.norm(mesh.vertices[:, :2] - contact.object.origin[:2], axis=1)  # type: ignore[attr-defined]
            assert_allclose(across, radius, atol=0.01)


def replace_contacts(problem: ga.Problem, contacts: tuple[ga.Contact, ...]) -> SimpleNamespace:
    """What the sketch reads of a problem, with other contacts; such a problem need not have a grasp."""
    return SimpleNamespace(hand=problem.hand, x1_array=problem.x1_array, contacts=contacts)


# Scene


def test_scene_shows_every_mesh_of_hand_and_object(result: ga.Result) -> None:
    scene = Scene(result)
    assert [exhibit.name for exhibit in scene.exhibits] == ["best", "worst"]
    for exhibit in scene.exhibits:
        count = {group: sum(part.group == group for part in exhibit.parts) for group in ("hand", "object")}
        assert count["hand"] == result.problem.hand.urdf.count("<visual")
        assert count["object"] == result.problem.object.urdf.count("<visual")
        assert sum(part.group == "contact" for part in exhibit.parts) == len(result.problem.contacts)
        assert sum(part.group == "normal" for part in exhibit.parts) == len(result.problem.contacts)
        assert sum(part.group == "ellipsoid" for part in exhibit.parts) == 1


def test_contacts_lie_on_hand_and_object(result: ga.Result) -> None:
    for exhibit in Scene(result).exhibits:
        surface = {
            group: np.concatenate([dense(p.mesh.moved(p.T)) for p in exhibit.parts if p.group == group])
            for group in ("hand", "object")
        }
        contacts = np.array([part.T[:3, 3] for part in exhibit.parts if part.group == "contact"])
        assert cKDTree(surface["object"]).query(contacts)[0].max() < 0.002
        assert cKDTree(surface["hand"]).query(contacts)[0].max() < CONTACT_RADIUS


def dense(mesh: meshes.Mesh) -> Array:
    """Points all over a surface, about one a square millimetre [n, 3]."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    faces = np.repeat(np.arange(len(areas)), np.ceil(areas / 1e-6).astype(int))
    u, v = np.random.default_rng(0).random((2, len(faces), 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return np.asarray(a[faces] + u * (b - a)[faces] + v * (c - a)[faces])


def test_grasps_stand_apart_and_inside_the_window(result: ga.Result) -> None:
    scene = Scene(result)
    window = (-0.8, 0.7, -0.5, 0.9)
    camera = scene.camera(1.5, window)
    best, worst = (camera.project(exhibit.points, 1.5) for exhibit in scene.exhibits)
    assert best[:, 0].max() < worst[:, 0].min()
    seen = np.concatenate([best, worst])[:, :2]
    assert (seen >= [window[0] - 1e-6, window[2] - 1e-6]).all()
    assert (seen <= [window[1] + 1e-6, window[3] + 1e-6]).all()
    assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)


# Ellipsoid


def test_ellipsoid_holds_all_velocities_and_is_touched(result: ga.Result) -> None:
    random = np.random.default_rng(0)
    for grasp in (result.best, result.worst, result.at_x1):
        axes, semi_axes = velocity_ellipsoid.velocity_ellipsoid(grasp)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        twists, joints = velocity_ellipsoid.coordinated_motions(grasp)
        # Coordinated: the contact points of the fingers move with those of the object.
        assert_allclose(grasp.J @ joints, grasp.G.T @ twists, atol=1e-6 * np.abs(twists).max())
        z = random.normal(size=(twists.shape[1], 20000))
        z /= np.linalg.norm(z, axis=0)
        assert_allclose(np.linalg.norm(joints @ z, axis=0), 1.0)
        reach = np.linalg.norm((axes.T @ (twists @ z)[:3]) / semi_axes[:, None], axis=0)
        assert reach.max() <= 1.0 + 1e-6
        for axis, length in zip(axes.T, semi_axes, strict=True):
            furthest = axis @ twists[:3]
            assert np.linalg.norm(furthest) == pytest.approx(length, rel=1e-6)


def test_ellipsoid_agrees_with_the_formula_of_full_rank(result: ga.Result) -> None:
    grasp = result.at_x1
    M = grasp.G @ np.linalg.inv(grasp.J @ grasp.J.T) @ grasp.G.T
    expected = np.sqrt(np.linalg.eigvalsh(np.linalg.inv(M)[:3, :3]))[::-1]
    assert_allclose(velocity_ellipsoid.velocity_ellipsoid(grasp)[1], expected, rtol=1e-5)


def test_ellipsoid_agrees_with_the_semi_axes_of_the_index(result: ga.Result) -> None:
    grasp = result.at_x1
    twists = velocity_ellipsoid.coordinated_motions(grasp)[0]
    twists[:3] *= 1000.0
    lengths = np.linalg.svd(twists, compute_uv=False)
    assert_allclose(np.sort(lengths), grasp.semi_axes, rtol=1e-5)


@pytest.mark.parametrize("loss", ["no joints", "one contact", "locked finger", "one joint"])
def test_ellipsoid_of_a_deficient_grasp_is_finite(can_result: ga.Result, loss: str) -> None:
    grasp = can_result.best
    J, G = grasp.J.copy(), grasp.G
    if loss == "no joints":
        J[:] = 0.0
    elif loss == "one contact":
        J, G = J[:3], G[:, :3]
    elif loss == "locked finger":
        J[:3] = 0.0
    else:
        J = J[:, :1]
    axes, semi_axes = velocity_ellipsoid.velocity_ellipsoid(replace(grasp, J=J, G=G))
    assert np.isfinite(axes).all()
    assert np.isfinite(semi_axes).all()
    assert (semi_axes >= 0.0).all()
    if loss == "no joints":
        assert not semi_axes.any()


# Rasteriser and picture


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
    dark = np.linspace(0.0, 0.8, 9)
    assert_allclose(to_screen(to_linear(dark)), dark, atol=1e-12)
    assert to_screen(np.array([1e6])) == pytest.approx(1.0)


def test_picture_shows_hand_and_object_on_both_sides(picture: Array) -> None:
    assert picture.shape == (450, 800, 3)
    for half in (picture[:, :400], picture[:, 400:]):
        assert share(half, "yellow") > 0.02
        assert share(half, "grey") > 0.02
        assert share(half, "red") > 0.0001


def test_picture_shows_the_can(can_result: ga.Result, tmp_path: Path) -> None:
    save_picture(can_result, tmp_path / "can.png", width=480, height=270)
    assert share(pixels(tmp_path / "can.png"), "blue") > 0.0001


@pytest.mark.parametrize(("wide", "high"), [(480, 360), (800, 300), (400, 600)])
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


def test_picture_has_the_size_asked_for(can_result: ga.Result, tmp_path: Path) -> None:
    save_picture(can_result, tmp_path / "small.png", width=320, height=213)
    assert pixels(tmp_path / "small.png").shape == (213, 320, 3)
    assert [path.name for path in tmp_path.iterdir()] == ["small.png"]
    with pytest.raises(ga.GraspAtlasError, match="at least 320"):
        save_picture(can_result, tmp_path / "tiny.png", width=20, height=20)


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
