"""The second route for collisions: Pinocchio's and coal's Python, shape by shape, and hands and objects to try.

Every geometry is held by this module's own lists, and no reference is kept into a vector that grows.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import coal
import numpy as np
import pinocchio as pin

import graspatlas as ga
from graspatlas.problem.object_joint import FREE_FLYER

DEPTH, CLEARANCE = 0.002, 0.001
#: Flags are compared where distances are not this near to what decides [m].
DOUBT = 5e-6

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
FACES += [(1, 5, 7), (1, 7, 3)]


def write_box(path: Any, size: Any, hollow: bool) -> str:
    """A mesh of a box [m]; a hollow one has a cavity, so it is no convex solid."""
    corners, faces = CORNERS * size, list(FACES)
    if hollow:
        corners = np.concatenate([corners, 0.3 * corners])
        faces += [(a + 8, c + 8, b + 8) for a, b, c in FACES]
    rows = ["v {} {} {}\n".format(*corner) for corner in corners]
    path.write_text("".join(rows + ["f {} {} {}\n".format(*(i + 1 for i in face)) for face in faces]))
    return str(path)


def geometries(folder: Any, rng: Any, kinds: str) -> list[str]:
    """URDF elements of random shapes: s(phere), c(ylinder), b(ox), m(esh of a box), h(ollow mesh of a box)."""
    out = []
    for i, kind in enumerate(kinds):
        size = rng.uniform(0.008, 0.02, 3)
        if kind in "mh":
            name = write_box(folder / f"{kind}{i}_{rng.integers(1 << 30)}.obj", size, kind == "h")
            out.append(f'<mesh filename="{name}"/>')
        else:
            out.append(
                {
                    "s": f'<sphere radius="{0.5 * size[0]}"/>',
                    "c": f'<cylinder radius="{0.5 * size[0]}" length="{size[1]}"/>',
                    "b": '<box size="{} {} {}"/>'.format(*size),
                }[kind]
            )
    return out


def collisions(shapes: list[str], rng: Any, spread: float) -> str:
    """Collision elements at random places."""
    return "".join(
        '<collision><origin xyz="{} {} {}" rpy="{} {} {}"/><geometry>{}</geometry></collision>'.format(
            *rng.uniform(-spread, spread, 3), *rng.uniform(-1.5, 1.5, 3), shape
        )
        for shape in shapes
    )


def made_problem(folder: Any, hand_kinds: str, object_kinds: str, tip: str = "s", seed: int = 0) -> Any:
    """Two fingers of three joints, each last one a mimic, with shapes dealt to their links, and an object."""
    rng = np.random.default_rng(seed)
    shapes = geometries(folder, rng, hand_kinds)
    links: dict[str, list[str]] = {"palm": [], **{f"{f}{i}": [] for f in "ab" for i in range(3)}}
    order = ["a0", "b1", "palm", "a1", "b0"]
    for i, shape in enumerate(shapes[1:]):
        links[order[i % len(order)]].append(shape)
    links["a2"] = [geometries(folder, rng, tip)[0] if tip else shapes[0]]
    urdf = '<robot name="made">' + "".join(
        f'<link name="{name}">{collisions(held, rng, 0.0 if name == "a2" else 0.012)}</link>'
        for name, held in links.items()
    )
    for side, finger in zip((-1, 1), "ab", strict=True):
        for i in range(3):
            parent, xyz = (f"{finger}{i - 1}", "0 0 0.035") if i else ("palm", f"{side * 0.03} 0 0.02")
            mimic = f'<mimic joint="j{finger}1" multiplier="0.7" offset="0.1"/>' if i == 2 else ""
            urdf += (
                f'<joint name="j{finger}{i}" type="revolute"><parent link="{parent}"/><child link="{finger}{i}"/>'
                f'<origin xyz="{xyz}"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/>'
                f"{mimic}</joint>"
            )
    body = (
        f'<robot name="thing"><link name="thing">{collisions(geometries(folder, rng, object_kinds), rng, 0.01)}</link>'
    )
    return SimpleNamespace(
        hand=ga.Hand("made", urdf + "</robot>"),
        object=ga.Body("thing", body + "</robot>"),
        contacts=[SimpleNamespace(frame="a2")],
        object_joint_model=FREE_FLYER,
        obstacles=(),
    )


def made_grasps(count: int, seed: int = 1) -> Any:
    """Random configurations [count, 13]."""
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(count, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    return np.hstack([rng.uniform(-1.2, 1.2, (count, 6)), rng.uniform(-0.07, 0.09, (count, 3)), quaternions])


@dataclass
class Held:
    """One shape: coal's geometry, in our hands, and where it is on its joint."""

    name: str
    geometry: Any
    joint: int
    placement: Any

    @property
    def mesh(self) -> bool:
        return isinstance(self.geometry, coal.BVHModelBase)


class Oracle:
    """Distances and flags of a made problem by Pinocchio's and coal's Python."""

    def __init__(self, problem: Any) -> None:
        self.model = pin.buildModelFromXML(problem.hand.urdf)
        hand = self.held(problem.hand, self.model)
        tip = self.model.frames[self.model.getFrameId(problem.contacts[0].frame)].parentJoint
        body = self.held(problem.object, pin.buildModelFromXML(problem.object.urdf))
        joint = self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "object")
        self.data = self.model.createData()
        self.pairs = []
        for i, a in enumerate(hand):
            for b in hand[i + 1 :]:
                parents = self.model.parents[a.joint], self.model.parents[b.joint]
                if a.joint != b.joint and a.joint != parents[1] and b.joint != parents[0]:
                    self.pairs.append((a, b, CLEARANCE))
        for shape in body:
            shape.name, shape.joint = "object/" + shape.name, joint
            for other in hand:
                if other.joint != tip:
                    self.pairs.append((other, shape, CLEARANCE))
                elif shape.mesh:  # a ball is thinner by the depth
                    ball = coal.Sphere(other.geometry.radius - DEPTH)
                    self.pairs.append((Held(other.name, ball, tip, other.placement), shape, 0.0))
                else:
                    solid = Held(
                        other.name, hull(other.geometry) if other.mesh else other.geometry, tip, other.placement
                    )
                    self.pairs.append((solid, shape, -DEPTH))

    @staticmethod
    def held(body: Any, model: Any) -> list[Held]:
        geometry = pin.buildGeomFromUrdfString(model, body.urdf, pin.COLLISION)
        out = []
        for item in geometry.geometryObjects.tolist():
            shape = item.geometry
            if isinstance(shape, coal.BVHModelBase) and shape.num_vertices == len(CORNERS):
                shape = hull(shape)
            at = pin.SE3(item.placement.rotation.copy(), item.placement.translation.copy())
            out.append(Held(item.name, shape.clone(), int(item.parentJoint), at))
        return out

    def look(self, q: Any) -> tuple[Any, Any]:
        """Distance of each pair, and whether it is too near."""
        pin.forwardKinematics(self.model, self.data, q)
        distances, flags = [], []
        for a, b, required in self.pairs:
            places = []
            for shape in (a, b):
                T = self.data.oMi[shape.joint] * shape.placement
                places.append(coal.Transform3s(T.rotation.copy(), T.translation.copy()))
            ask, request = coal.DistanceRequest(), coal.CollisionRequest()
            ask.gjk_tolerance = 1e-10
            request.security_margin = required
            args = a.geometry, places[0], b.geometry, places[1]
            distances.append(coal.distance(*args, ask, coal.DistanceResult()))
            flags.append(coal.collide(*args, request, coal.CollisionResult()) > 0)
        return np.array(distances), np.array(flags, bool)


def hull(mesh: Any) -> Any:
    points = coal.StdVec_Vec3s()
    for corner in np.unique(mesh.vertices(), axis=0):
        points.append(corner)
    return coal.Convex.convexHull(points, True, "Qt")


def touching_grasps(problem: Any, count: int, seed: int = 2) -> Any:
    """Configurations with the object about where the fingertip is, so that they touch or nearly [count, 13]."""
    rng = np.random.default_rng(seed)
    X = made_grasps(count, seed)
    frame = problem.contacts[0].frame
    for x in X:
        away = rng.normal(size=3)
        tip = problem.hand.link_placements(x[:6])[frame][:3, 3]
        x[6:9] = tip + rng.uniform(0.008, 0.016) * away / np.linalg.norm(away)
    return X
