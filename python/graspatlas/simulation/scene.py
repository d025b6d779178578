"""The scene of a problem for MuJoCo: the hand fixed at its palm, the object free, a servo at each actuated joint.

Shapes are those that ``collision_free`` looks at; joints and inertias those that Pinocchio reads. The world is the
palm, lengths are metres. Joints that mimic others are equality constraints, soft fingers torsional friction.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from graspatlas.collision.problem_shapes import collision_shapes
from graspatlas.collision.shapes import Shape, convex_hull
from graspatlas.errors import GraspAtlasError
from graspatlas.numerics.rotations import quaternions_from_matrices
from graspatlas.problem.problem import Problem
from graspatlas.simulation.inertia import unit_inertia
from graspatlas.simulation.mjcf import add_inertial, add_shape, child, pose, text
from graspatlas.simulation.protocols import Protocol
from graspatlas.support.arrays import Array
from graspatlas.support.mujoco_library import mujoco_library

if TYPE_CHECKING:
    import mujoco

__all__ = ["HAND", "OBJECT", "Scene"]

#: Before the names of shapes.
HAND, OBJECT = "hand/", "object/"
#: At this lever a servo of a sliding joint is as stiff and as strong as one of a turning joint [m].
LEVER = 0.1
#: Inertia of a motor at its joint [kg m2]; of a sliding one that at the lever. It keeps light links from trembling.
ARMATURE = 5e-4
#: Contacts as DexGraspBench states them: stiff, settled within 5 ms.
CONTACT = {"solref": "0.005 1", "solimp": "0.5 0.99 0.0001"}
#: What may touch what: bits of shapes of the hand, which touch both, and of the object, which touch the hand.
HAND_BITS, OBJECT_BITS = {"contype": "1", "conaffinity": "3"}, {"contype": "2", "conaffinity": "1"}
#: Couplings of joints, as stiff as a step of 4 ms allows.
COUPLING = {"solref": "0.008 1", "solimp": "0.9999 0.9999 0.001"}
COLOURS = {HAND: "0.62 0.64 0.67 1", OBJECT: "0.86 0.62 0.32 1"}


class Scene:
    """Hand, object and servos of a problem under the conditions of a protocol.

    Attributes:
        problem: The problem.
        protocol: The protocol.
        servos: Names of the joints with a servo, in the order of the targets (a,).
        directions: How many directions a push can have: 3, in the plane 2; their controls follow those of the servos.

    Raises:
        GraspAtlasError: If hand or object has no collision shape, or the object one that is not convex.
    """

    def __init__(self, problem: Problem, protocol: Protocol) -> None:
        self.problem, self.protocol = problem, protocol
        self.servos = problem.hand.mechanism.actuated
        self.directions = problem.object_joint_model.translations
        self._sliding = {joint.name: joint.prismatic for joint in problem.hand.model.hand_joints}
        self._shapes = collision_shapes(problem)
        self.center_of_mass: Array = problem.object.center_of_mass

    @cached_property
    def root(self) -> Element:
        """The scene as MJCF."""
        protocol = self.protocol
        root = Element("mujoco", model=self.problem.name)
        child(root, "compiler", angle="radian", autolimits="true")
        how = {"integrator": "implicitfast", "cone": "elliptic", "impratio": "10", "noslip_iterations": "2"}
        child(root, "option", timestep=text([protocol.step]), gravity="0 0 0", **how)
        soft = protocol.torsional > 0.0
        friction = text([protocol.friction, protocol.torsional, 1e-4])
        defaults = child(root, "default")
        child(defaults, "geom", condim="4" if soft else "3", friction=friction, **CONTACT)
        assets, world = child(root, "asset"), child(root, "worldbody")
        names = self._add_hand(world, assets)
        self._add_object(world, assets)
        self._ignore_pairs(child(root, "contact"), names)
        self._couple_joints(child(root, "equality"))
        self._add_servos(child(root, "actuator"))
        return root

    @property
    def xml(self) -> str:
        """The scene as the text of an MJCF file, which needs no other file."""
        ElementTree.indent(self.root)
        return ElementTree.tostring(self.root, encoding="unicode")

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The scene as MuJoCo has compiled it."""
        library = mujoco_library()
        try:
            return library.MjModel.from_xml_string(self.xml)
        except ValueError as error:
            reason = " ".join(str(error).split())
            raise GraspAtlasError(f"MuJoCo cannot load the scene of problem '{self.problem.name}': {reason}") from None

    def configurations(self, positions: Array, T_palm_object: Array) -> Array:
        """MuJoCo's configurations (n, nq) of joint positions (n, h) and poses of the object (n, 4, 4)."""
        model, hand = self.model, self.problem.hand
        qpos = np.zeros((len(positions), model.nq))
        for column, name in enumerate(hand.joints):
            qpos[:, model.joint(name).qposadr[0]] = positions[:, column]
        R = T_palm_object[:, :3, :3]
        center = T_palm_object[:, :3, 3] + R @ self.center_of_mass
        at = self.object_at
        if self.problem.object_joint_model.planar:
            qpos[:, at : at + 2] = center[:, :2]
            qpos[:, at + 2] = np.arctan2(R[:, 1, 0], R[:, 0, 0])
        else:
            qpos[:, at : at + 3] = center
            qpos[:, at + 3 : at + 7] = quaternions_from_matrices(R)[:, [3, 0, 1, 2]]
        return qpos

    def poses(self, qpos: Array) -> tuple[Array, Array]:
        """Joint positions (n, h) and poses of the object (n, 4, 4) of MuJoCo's configurations (n, nq)."""
        from scipy.spatial.transform import Rotation  # slow to import

        columns = [self.model.joint(name).qposadr[0] for name in self.problem.hand.joints]
        T, at = np.tile(np.eye(4), (len(qpos), 1, 1)), self.object_at
        if self.problem.object_joint_model.planar:
            T[:, :2, 3] = qpos[:, at : at + 2]
            T[:, :3, :3] = Rotation.from_euler("z", qpos[:, at + 2, None]).as_matrix()
        else:
            T[:, :3, 3] = qpos[:, at : at + 3]
            T[:, :3, :3] = Rotation.from_quat(qpos[:, at + 3 : at + 7][:, [1, 2, 3, 0]]).as_matrix()
        T[:, :3, 3] -= T[:, :3, :3] @ self.center_of_mass
        return qpos[:, columns], T

    @cached_property
    def object_at(self) -> int:
        """Where the object's pose begins in MuJoCo's configuration."""
        return int(self.model.jnt_qposadr[self.model.body("object").jntadr[0]])

    def _add_hand(self, world: Element, assets: Element) -> dict[int, str]:
        """Bodies of the hand, one for each joint; their names by the joints' numbers."""
        import pinocchio as pin

        hand = self.problem.hand
        model = pin.buildModelFromXML(hand.tree)
        elements = {joint.get("name"): joint for joint in ElementTree.fromstring(hand.tree).iter("joint")}
        bodies, names = {0: world}, {0: "world"}
        for number in range(1, model.njoints):
            name, placement = model.names[number], model.jointPlacements[number].homogeneous
            names[number] = f"{HAND}{name}"
            body = child(bodies[model.parents[number]], "body", name=names[number], **pose(placement))
            bodies[number] = body
            inertia = model.inertias[number]
            add_inertial(body, inertia.mass, inertia.lever, inertia.inertia)
            self._add_joint(body, name, elements[name].find("axis"))
        for shape in self._shapes.hand:
            _add(bodies[shape.joint], assets, HAND, convex_hull(shape), shape.placement, **HAND_BITS)
        return names

    def _add_joint(self, body: Element, name: str, axis: Element | None) -> None:
        direction = axis.get("xyz", "1 0 0") if axis is not None else "1 0 0"
        lower, upper = self.problem.hand.limits_by_name[name]
        limits = {"range": text((lower, upper))} if np.isfinite([lower, upper]).all() else {}
        sliding = self._sliding[name]
        armature = text([ARMATURE / LEVER**2 if sliding else ARMATURE])
        kind = "slide" if sliding else "hinge"
        child(body, "joint", name=name, type=kind, axis=direction, armature=armature, **limits)

    def _add_object(self, world: Element, assets: Element) -> None:
        """The object; its frame is that of its URDF moved to the centre of mass, where it is pushed."""
        body = child(world, "body", name="object")
        if self.problem.object_joint_model.planar:
            for axis, direction in (("x", "1 0 0"), ("y", "0 1 0")):
                child(body, "joint", name=f"{OBJECT}{axis}", type="slide", axis=direction)
            child(body, "joint", name=f"{OBJECT}turn", type="hinge", axis="0 0 1")
        else:
            child(body, "freejoint", name=f"{OBJECT}pose")
        mass = self.protocol.mass
        add_inertial(body, mass, np.zeros(3), mass * unit_inertia(self.problem.object, self._shapes.object))
        for shape in self._shapes.object:
            if shape.is_mesh:
                raise GraspAtlasError(
                    f"the collision mesh '{shape.name}' of the object is not convex, and MuJoCo would use its "
                    "convex hull: decompose it into convex pieces, for example with CoACD"
                )
            T = shape.placement.copy()
            T[:3, 3] -= self.center_of_mass
            _add(body, assets, OBJECT, shape, T, **OBJECT_BITS)

    def _ignore_pairs(self, contact: Element, names: dict[int, str]) -> None:
        """Shapes of the hand that may touch each other, as ``collision_free`` lets them.

        MuJoCo leaves out whole bodies; of these, the pairs of shapes that must not touch are named again.
        """
        shapes = self._shapes.hand
        ignored = {tuple(sorted((shapes[a].joint, shapes[b].joint))) for a, b in self._shapes.ignored}
        for first, second in sorted(ignored):
            if first != second:
                child(contact, "exclude", body1=names[first], body2=names[second])
        for a, b in self._shapes.hand_pairs:
            if tuple(sorted((shapes[a].joint, shapes[b].joint))) in ignored:
                child(contact, "pair", geom1=HAND + shapes[a].name, geom2=HAND + shapes[b].name)

    @property
    def touching_shapes(self) -> tuple[tuple[str, ...], ...]:
        """Names of the shapes that touch at each contact (m,): those of its link."""
        by_contact = self._shapes.touching_by_contact
        return tuple(tuple(self._shapes.hand[i].name for i in sorted(numbers)) for numbers in by_contact)

    def _couple_joints(self, equality: Element) -> None:
        for mimic in self.problem.hand.mechanism.mimics:
            line = text((mimic.offset, mimic.multiplier, 0, 0, 0))
            child(equality, "joint", joint1=mimic.joint, joint2=mimic.driver, polycoef=line, **COUPLING)

    def _add_servos(self, actuators: Element) -> None:
        for name in self.servos:
            stiffness, largest = self.servo(name)
            damping = self.protocol.damping / (LEVER**2 if self._sliding[name] else 1.0)
            damped = {"kv": text([damping])} if damping > 0.0 else {"dampratio": "1"}
            how = {"kp": text([stiffness]), **damped, "forcerange": text((-largest, largest))}
            child(actuators, "position", name=name, joint=name, **how)
        for i, axis in enumerate("xyz"[: self.directions]):
            planar = self.problem.object_joint_model.planar
            where = {"joint": f"{OBJECT}{axis}"} if planar else {"joint": f"{OBJECT}pose", "gear": text(np.eye(6)[i])}
            child(actuators, "motor", name=f"push/{axis}", **where)

    def servo(self, joint: str) -> tuple[float, float]:
        """Stiffness and largest force of a joint's servo [N m/rad and N m, or N/m and N]."""
        stiffness, largest = self.protocol.stiffness, self.protocol.largest_torque
        return (stiffness / LEVER**2, largest / LEVER) if self._sliding[joint] else (stiffness, largest)


def _add(body: Element, assets: Element, owner: str, shape: Shape, T: Array, **bits: str) -> None:
    add_shape(body, assets, shape, owner + shape.name, T, rgba=COLOURS[owner], **bits)
