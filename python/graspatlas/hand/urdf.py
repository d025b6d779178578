"""Edits and texts of URDF: joints locked at a position, and bodies of one primitive or one mesh."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from xml.etree import ElementTree

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.mechanism import Mimic, read_mimics
from graspatlas.numerics.rotations import matrix_from_rotvec, matrix_from_rpy, rpy_from_matrix
from graspatlas.support.arrays import Array

__all__ = [
    "box_urdf",
    "center_of_mass",
    "cylinder_urdf",
    "effort_limits",
    "fixed_parents",
    "joint_limits",
    "joints_of_kind",
    "joints_on_way",
    "lock_joints",
    "mesh_urdf",
    "mimics",
    "moving_joints",
    "origin_of",
    "root_link",
    "sphere_urdf",
    "velocity_limits",
    "with_followers_limited",
    "without_visuals",
]

#: Joints that move with one degree of freedom.
TURNING, SLIDING = ("revolute", "continuous"), ("prismatic",)
#: Two positions of a locked joint that differ by less are the same [rad or m].
SAME = 1e-6


def moving_joints(urdf: str) -> tuple[str, ...]:
    """Names of the joints that are not fixed, in the order of the text.

    Args:
        urdf: Text of a URDF.
    """
    return tuple(str(joint.get("name")) for joint in _joints(ElementTree.fromstring(urdf)))


def joints_of_kind(urdf: str, kind: str) -> set[str]:
    """Names of the joints of a type, such as ``continuous``.

    Args:
        urdf: Text of a URDF.
        kind: The type.
    """
    return {str(joint.get("name")) for joint in _joints(ElementTree.fromstring(urdf)) if joint.get("type") == kind}


def joint_limits(urdf: str) -> dict[str, tuple[float, float]]:
    """Limits (lower, upper) of the revolute joints of a URDF [rad], by name.

    Args:
        urdf: Text of a URDF.
    """
    limits = {}
    for joint in _joints(ElementTree.fromstring(urdf)):
        limit = joint.find("limit")
        if joint.get("type") == "revolute" and limit is not None:
            limits[str(joint.get("name"))] = (float(limit.get("lower", "0")), float(limit.get("upper", "0")))
    return limits


def velocity_limits(urdf: str) -> dict[str, float]:
    """Velocity limits of the moving joints of a URDF that state a positive one [rad/s or m/s], by name.

    Args:
        urdf: Text of a URDF.
    """
    limits = {}
    for joint in _joints(ElementTree.fromstring(urdf)):
        limit = joint.find("limit")
        velocity = 0.0 if limit is None else float(limit.get("velocity", "0"))
        if velocity > 0.0:
            limits[str(joint.get("name"))] = velocity
    return limits


def effort_limits(urdf: str) -> dict[str, float]:
    """Effort limits of the joints of a URDF that state a positive, finite one [N m or N], by name.

    Args:
        urdf: Text of a URDF.
    """
    limits = {}
    for joint in _joints(ElementTree.fromstring(urdf)):
        limit = joint.find("limit")
        effort = 0.0 if limit is None or joint.get("type") not in TURNING + SLIDING else _effort(limit)
        if 0.0 < effort < np.inf:
            limits[str(joint.get("name"))] = effort
    return limits


def _effort(limit: ElementTree.Element) -> float:
    """The effort of a ``<limit>``; 0 where it is none, as that of a continuous joint may be, which nobody checks."""
    try:
        return float(limit.get("effort", "0"))
    except ValueError:
        return 0.0


def center_of_mass(urdf: str) -> Array:
    """Centre of mass of a URDF with all joints at 0, in the frame of its root link (3,), metres.

    Args:
        urdf: Text of a URDF; links without a positive mass weigh nothing, and without any the centre is the origin.
    """
    root = ElementTree.fromstring(urdf)
    placed = {root_link(urdf): (np.eye(3), np.zeros(3))}
    joints = root.findall("joint")
    for _ in joints:
        for joint in joints:
            parent, child = (_link_of(joint, side) for side in ("parent", "child"))
            if parent in placed and child not in placed:
                R, at = placed[parent]
                turned, moved = origin_of(joint)
                placed[child] = R @ turned, at + R @ moved
    moment, total = np.zeros(3), 0.0
    for link in root.findall("link"):
        inertial, mass = link.find("inertial"), link.find("inertial/mass")
        weight = 0.0 if mass is None else float(mass.get("value", "0"))
        if inertial is None or not weight > 0.0 or str(link.get("name")) not in placed:
            continue
        R, at = placed[str(link.get("name"))]
        moment, total = moment + weight * (at + R @ origin_of(inertial)[1]), total + weight
    return np.asarray(moment / total) if total > 0.0 else moment


def _link_of(joint: ElementTree.Element, side: str) -> str:
    """Name of the parent or child link of a joint."""
    element = joint.find(side)
    return "" if element is None else str(element.get("link"))


def origin_of(element: ElementTree.Element) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) [m] of the ``<origin>`` of a joint or inertial."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    return matrix_from_rpy(_triple(origin.get("rpy"), (0, 0, 0))), _triple(origin.get("xyz"), (0, 0, 0))


def root_link(urdf: str) -> str:
    """Name of the link of a URDF that is no joint's child; of the first where there are several.

    Args:
        urdf: Text of a URDF.
    """
    root = ElementTree.fromstring(urdf)
    children = {str(child.get("link")) for joint in root.findall("joint") for child in joint.findall("child")}
    return next((name for link in root.findall("link") if (name := str(link.get("name"))) not in children), "")


def fixed_parents(urdf: str) -> dict[str, str]:
    """The link that each link is fixed to, by the name of the link that a fixed joint carries.

    Args:
        urdf: Text of a URDF.
    """
    fixed = [joint for joint in ElementTree.fromstring(urdf).findall("joint") if joint.get("type") == "fixed"]
    ends = [(joint.find("child"), joint.find("parent")) for joint in fixed]
    return {
        str(child.get("link")): str(parent.get("link"))
        for child, parent in ends
        if child is not None and parent is not None
    }


def joints_on_way(urdf: str, link: str) -> tuple[str, ...]:
    """Names of the moving joints between the root link and another, from the root on.

    Args:
        urdf: Text of a URDF.
        link: Name of the link.
    """
    carriers = {_link_of(joint, "child"): joint for joint in ElementTree.fromstring(urdf).findall("joint")}
    way = []
    while (joint := carriers.pop(link, None)) is not None:
        if joint.get("type") != "fixed":
            way.append(str(joint.get("name")))
        link = _link_of(joint, "parent")
    return tuple(reversed(way))


def mimics(urdf: str) -> tuple[Mimic, ...]:
    """The joints that mimic others; see :func:`graspatlas.hand.mechanism.read_mimics`.

    Args:
        urdf: Text of a URDF.
    """
    return read_mimics(ElementTree.fromstring(urdf)) if "<mimic" in urdf else ()


def with_followers_limited(urdf: str) -> str:
    """The URDF with the continuous joints made revolute that mimic joints with limits: they never go round.

    Their limits are written as 0 and mean nothing.

    Args:
        urdf: Text of a URDF.
    """
    plain = {mimic.joint for mimic in mimics(urdf) if not mimic.turns}
    root = ElementTree.fromstring(urdf)
    changed = [joint for joint in _joints(root) if joint.get("name") in plain and joint.get("type") == "continuous"]
    for joint in changed:
        joint.set("type", "revolute")
        for limit in joint.findall("limit"):
            joint.remove(limit)
        ElementTree.SubElement(joint, "limit", {"lower": "0", "upper": "0", "effort": "0", "velocity": "0"})
    return ElementTree.tostring(root, encoding="unicode") if changed else urdf


def without_visuals(urdf: str) -> str:
    """The URDF without what is to be seen alone.

    Args:
        urdf: Text of a URDF.
    """
    root = ElementTree.fromstring(urdf)
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    return ElementTree.tostring(root, encoding="unicode")


def lock_joints(urdf: str, positions: Mapping[str, float]) -> str:
    """The URDF with some joints fixed where they stand at given positions, and with them those that mimic them.

    Args:
        urdf: Text of a URDF.
        positions: Positions of the joints to lock, by name [rad or m].

    Raises:
        GraspAtlasError: If there is no such joint that moves, a position lies outside its limits, or a joint mimics
            another that is not locked or has it elsewhere.
    """
    root = ElementTree.fromstring(urdf)
    joints = {str(joint.get("name")): joint for joint in _joints(root)}
    for name in positions:
        if name not in joints:
            raise unknown_name("joint", name, joints, "one that moves")
    for name, position in _with_followers(positions, mimics(urdf)).items():
        _lock(joints[name], float(position))
    return ElementTree.tostring(root, encoding="unicode")


def _with_followers(positions: Mapping[str, float], followers: Iterable[Mimic]) -> dict[str, float]:
    """Positions of joints to lock, those that mimic them included."""
    full = dict(positions)
    for mimic in followers:
        if mimic.driver not in positions:
            if mimic.joint in positions:
                raise GraspAtlasError(
                    f"joint '{mimic.joint}' mimics '{mimic.driver}' and cannot be locked alone: lock "
                    f"'{mimic.driver}' instead"
                )
            continue
        must = mimic.position(float(positions[mimic.driver]))
        if not abs(float(positions.get(mimic.joint, must)) - must) <= SAME:
            raise GraspAtlasError(
                f"joint '{mimic.joint}' is locked at {float(positions[mimic.joint]):g}, but it mimics: {mimic} = "
                f"{must:g}; lock '{mimic.driver}' alone"
            )
        full[mimic.joint] = must
    return full


def _joints(root: ElementTree.Element) -> Iterable[ElementTree.Element]:
    return [joint for joint in root.findall("joint") if joint.get("type") != "fixed"]


def _lock(joint: ElementTree.Element, position: float) -> None:
    """Makes a joint fixed; its origin takes up the motion."""
    name, kind = joint.get("name"), joint.get("type")
    if kind not in TURNING + SLIDING:
        raise GraspAtlasError(f"joint '{name}' is {kind} and cannot be locked at one number")
    limit = joint.find("limit")
    if limit is not None and kind != "continuous":
        lower, upper = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
        if not lower <= position <= upper:
            limits = f"[{lower:g}, {upper:g}]"
            raise GraspAtlasError(f"joint '{name}' is locked at {position:g}, outside its limits {limits}")
    origin = joint.find("origin")
    if origin is None:
        origin = ElementTree.SubElement(joint, "origin")
    xyz, rpy = _triple(origin.get("xyz"), (0, 0, 0)), _triple(origin.get("rpy"), (0, 0, 0))
    element = joint.find("axis")
    axis = _triple(None if element is None else element.get("xyz"), (1, 0, 0))
    axis = axis / max(float(np.linalg.norm(axis)), np.finfo(float).tiny)
    R = matrix_from_rpy(rpy)
    if kind in TURNING:
        rpy = rpy_from_matrix(R @ matrix_from_rotvec(position * axis))
    else:
        xyz = xyz + R @ (position * axis)
    origin.set("xyz", _words(xyz))
    origin.set("rpy", _words(rpy))
    joint.set("type", "fixed")
    for tag in ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"):
        for child in joint.findall(tag):
            joint.remove(child)


def _triple(text: str | None, default: Sequence[float]) -> Array:
    return np.array(default if text is None else [float(word) for word in text.split()], float)


def _words(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def sphere_urdf(name: str, radius: float) -> str:
    """URDF of a sphere about the origin; `radius` in metres."""
    return _one_link(name, f'<sphere radius="{radius!r}"/>')


def box_urdf(name: str, size: Iterable[float]) -> str:
    """URDF of a box about the origin; `size` (3,) are its edges along x, y and z [m]."""
    return _one_link(name, f'<box size="{_words(size)}"/>')


def cylinder_urdf(name: str, radius: float, length: float) -> str:
    """URDF of a cylinder about the origin, its axis along z; `radius` and `length` in metres."""
    return _one_link(name, f'<cylinder radius="{radius!r}" length="{length!r}"/>')


def mesh_urdf(name: str, filename: str, scale: Iterable[float]) -> str:
    """URDF of a mesh; `filename` as URDFs name them, `scale` (3,) from the mesh's unit to metres."""
    return _one_link(name, f'<mesh filename="{escape(filename)}" scale="{_words(scale)}"/>')


def _one_link(name: str, shape: str) -> str:
    """One link, seen and touched as one shape."""
    geometry = f"<geometry>{shape}</geometry>"
    return (
        f'<robot name="{escape(name)}"><link name="{escape(name)}"><visual>{geometry}<material name="grey">'
        f'<color rgba="0.72 0.74 0.78 1"/></material></visual><collision>{geometry}</collision></link></robot>'
    )
