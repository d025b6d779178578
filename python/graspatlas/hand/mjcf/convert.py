"""Hands in MJCF: MuJoCo's compiled model as a URDF, which the rest of the package reads.

A body becomes a link, each of its joints one joint of the URDF: where it has several, links of their own stand between
them. Joints are at the same positions in both, couplings of two joints become mimics, and sites frames.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.mjcf.contacts import allowed_pairs
from graspatlas.hand.mjcf.names import Names
from graspatlas.hand.mjcf.shapes import ShapeWriter, pose
from graspatlas.hand.robot_files import first_tag
from graspatlas.numerics.rotations import matrix_from_rotvec, rpy_from_matrix
from graspatlas.support.arrays import Array
from graspatlas.support.mujoco_library import mujoco_library

if TYPE_CHECKING:
    import mujoco

__all__ = ["ConvertedHand", "convert_mjcf"]

#: How far a slide joint that states no range may go to either side [m].
SLIDE = 1.0
#: Coefficients of a coupling that are smaller than this are none.
NONE = 1e-12


@dataclass(frozen=True)
class ConvertedHand:
    """A hand as URDF.

    Attributes:
        urdf: Its text.
        srdf: Pairs of links that may touch, as SRDF.
        notes: What the MJCF holds and the hand does not, a line each.
    """

    urdf: str
    srdf: str
    notes: tuple[str, ...]


def convert_mjcf(path: Path, root: str | None = None) -> ConvertedHand:
    """A hand from an MJCF file.

    Args:
        path: The file.
        root: The body that is the palm: what is not below it is left out, and with it the joints that move it. By
            default the last body before the fingers part.

    Raises:
        GraspAtlasError: If MuJoCo is not installed or cannot read the file; if there is no such body, no joint moves
            anything below it, it has a ball or free joint below it, or one that follows another other than linearly.
    """
    library = mujoco_library()
    if first_tag(path) == "robot":  # which MuJoCo would read in its own way
        raise GraspAtlasError(f"'{path}' holds a <robot>, a URDF: say urdf: in place of mjcf:, or Hand.from_urdf")
    try:
        model = library.MjModel.from_xml_path(str(path))
    except (ValueError, OSError) as error:
        reason = " ".join(str(error).split())
        raise GraspAtlasError(f"MuJoCo cannot read '{path}': {reason}") from None
    return _Converter(model, library, path, root).hand()


class _Converter:
    """One model on its way to a URDF."""

    def __init__(self, model: mujoco.MjModel, library: Any, path: Path, root: str | None) -> None:
        self._model, self._library, self._path = model, library, path
        self._names = Names(model)
        self._root = self._palm(root)
        self._bodies = [b for b in range(self._root, model.nbody) if self._is_below(b)]
        self._notes: list[str] = []
        self._robot = Element("robot", name=path.stem, version="1.1")

    def hand(self) -> ConvertedHand:
        """The hand."""
        self._check_joints()
        shapes = ShapeWriter(self._model, self._library, self._path, self._names, self._robot)
        for body in self._bodies:
            self._add_body(body, shapes)
        self._couple()
        self._note_rest(shapes)
        ElementTree.indent(self._robot)
        srdf = allowed_pairs(self._model, self._library, self._bodies, self._names, self._path.stem)
        return ConvertedHand(ElementTree.tostring(self._robot, encoding="unicode"), srdf, tuple(self._notes))

    def _palm(self, root: str | None) -> int:
        """Number of the body that is the palm."""
        names = self._names.bodies
        if root is not None:
            if root not in names:
                raise unknown_name("body", root, names, f"in '{self._path}'")
            return names.index(root)
        moved = [b for b in range(1, self._model.nbody) if self._hinges(b)]
        if not moved:
            raise GraspAtlasError(
                f"'{self._path}' has no hinge or slide joint: it is not a hand, or its joints are in another file"
            )
        palm, fingers = 0, self._fingers(0, moved)
        while len(fingers) == 1:
            palm = fingers[0]
            fingers = self._fingers(palm, moved)
        if palm == 0:
            listed = ", ".join(f"'{names[b]}'" for b in fingers[:5])
            raise GraspAtlasError(
                f"'{self._path}' has several bodies with joints in its world ({listed}): say which is the palm, "
                "root: ..., or the world itself, root: world"
            )
        return palm if fingers else self._parent(moved[0])  # a hand of one finger has its palm before the first joint

    def _fingers(self, body: int, moved: Iterable[int]) -> list[int]:
        """The bodies on a body from which on joints move something."""
        on_it = [b for b in range(1, self._model.nbody) if self._parent(b) == body]
        return [b for b in on_it if any(self._is_below(other, b) for other in moved)]

    def _parent(self, body: int) -> int:
        return int(self._model.body_parentid[body])

    def _is_below(self, body: int, above: int | None = None) -> bool:
        """Whether a body hangs on another one, or is it; the palm by default."""
        above = self._root if above is None else above
        while body > above:
            body = self._parent(body)
        return body == above

    def _all_joints(self, body: int) -> list[int]:
        first = int(self._model.body_jntadr[body])
        return list(range(first, first + int(self._model.body_jntnum[body])))

    def _hinges(self, body: int) -> list[int]:
        """Joints of a body that turn or slide."""
        return [j for j in self._all_joints(body) if self._kind(j) in ("hinge", "slide")]

    def _kind(self, joint: int) -> str:
        """What kind of joint it is: hinge, slide, ball or free."""
        kind = self._library.mjtJoint(int(self._model.jnt_type[joint]))
        return str(kind.name).removeprefix("mjJNT_").lower()

    def _check_joints(self) -> None:
        moving = [j for b in self._bodies[1:] for j in self._all_joints(b)]
        for joint in moving:
            kind = self._kind(joint)
            if kind in ("ball", "free"):
                raise GraspAtlasError(
                    f"joint '{self._names.joints[joint]}' of '{self._path}' is a {kind} joint, which no hand "
                    "can have here: state hinges about three axes in its place, or choose a root: that is not above it"
                )
        if not moving:
            raise GraspAtlasError(
                f"no joint moves a body below '{self._names.bodies[self._root]}' of '{self._path}'; choose another root"
            )

    def _add_body(self, body: int, shapes: ShapeWriter) -> None:
        """A link, the joints that move it, and its sites."""
        model, name = self._model, self._names.bodies[body]
        if body != self._root:
            self._add_joints(body, name)
        link = SubElement(self._robot, "link", name=name)
        if body > 0 and model.body_mass[body] > 0.0:
            inertial = SubElement(link, "inertial")
            _add_origin(inertial, pose(model.body_ipos[body], model.body_iquat[body]))
            SubElement(inertial, "mass", value=_words([model.body_mass[body]]))
            x, y, z = model.body_inertia[body]
            moments = {"ixx": x, "iyy": y, "izz": z, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
            SubElement(inertial, "inertia", {axis: _words([moment]) for axis, moment in moments.items()})
        first = int(model.body_geomadr[body])
        for geom in range(first, first + int(model.body_geomnum[body])):
            shapes.add(link, geom)
        for site in np.flatnonzero(model.site_bodyid == body):
            self._add_site(int(site), name)

    def _add_site(self, site: int, body: str) -> None:
        name = self._names.sites[site]
        if name:
            SubElement(self._robot, "link", name=name)
            T = pose(self._model.site_pos[site], self._model.site_quat[site])
            self._add_fixed(name, body, name, T)

    def _add_fixed(self, name: str, parent: str, child: str, T: Array) -> None:
        joint = SubElement(self._robot, "joint", name=self._names.new_joint(f"{name}_fixed"), type="fixed")
        _add_origin(joint, T)
        SubElement(joint, "parent", link=parent)
        SubElement(joint, "child", link=child)

    def _add_joints(self, body: int, name: str) -> None:
        """The joints between a body and the one that carries it; each turns about its own anchor."""
        model, parent = self._model, self._names.bodies[self._parent(body)]
        T = pose(model.body_pos[body], model.body_quat[body])
        joints = self._all_joints(body)
        if not joints:
            self._add_fixed(name, parent, name, T)
        for place, number in enumerate(joints):
            anchor = np.asarray(model.jnt_pos[number], float)
            last = place == len(joints) - 1 and not anchor.any()
            child = name if last else self._names.new_link(f"{name}_after_{self._names.joints[number]}")
            if not last:
                SubElement(self._robot, "link", name=child)
            self._add_joint(number, parent, child, T @ _shift(anchor))
            parent, T = child, _shift(-anchor)
            if place == len(joints) - 1 and not last:
                self._add_fixed(name, parent, name, T)

    def _add_joint(self, number: int, parent: str, child: str, T: Array) -> None:
        model = self._model
        name, axis = self._names.joints[number], np.asarray(model.jnt_axis[number], float)
        reference = float(model.qpos0[model.jnt_qposadr[number]])
        slides = self._kind(number) == "slide"
        zero = np.eye(4)
        if slides:
            zero[:3, 3] = -reference * axis
        else:
            zero[:3, :3] = matrix_from_rotvec(-reference * axis)
        limited = bool(model.jnt_limited[number])
        low, high = (float(end) for end in model.jnt_range[number]) if limited else (-SLIDE, SLIDE)
        if slides and not limited:
            self._notes.append(f"slide joint '{name}' states no range; it may go {SLIDE:g} m to either side")
        kind = "prismatic" if slides else "revolute" if limited else "continuous"
        joint = SubElement(self._robot, "joint", name=name, type=kind)
        _add_origin(joint, T @ zero)
        SubElement(joint, "parent", link=parent)
        SubElement(joint, "child", link=child)
        SubElement(joint, "axis", xyz=_words(axis))
        ends = {} if kind == "continuous" else {"lower": _words([low]), "upper": _words([high])}
        SubElement(joint, "limit", {**ends, "effort": _words([self._effort(number)]), "velocity": "0"})

    def _effort(self, joint: int) -> float:
        """Largest torque or force of what drives a joint [N m or N]; 0 where none is stated."""
        model, library = self._model, self._library
        efforts = []
        if model.jnt_actfrclimited[joint]:
            efforts.append(float(np.abs(model.jnt_actfrcrange[joint]).max()))
        for actuator in range(model.nu):
            driven = int(model.actuator_trntype[actuator]) == int(library.mjtTrn.mjTRN_JOINT)
            if driven and int(model.actuator_trnid[actuator, 0]) == joint:
                largest = self._largest_force(actuator) * abs(float(model.actuator_gear[actuator, 0]))
                efforts += [largest] if largest > 0.0 else []
        return min(efforts, default=0.0)

    def _largest_force(self, actuator: int) -> float:
        """Largest force of an actuator before its gear: its range, or that of a motor's control; 0 where none is."""
        model, library = self._model, self._library
        if model.actuator_forcelimited[actuator]:
            return float(np.abs(model.actuator_forcerange[actuator]).max())
        plain = int(model.actuator_gaintype[actuator]) == int(library.mjtGain.mjGAIN_FIXED)
        plain &= int(model.actuator_biastype[actuator]) == int(library.mjtBias.mjBIAS_NONE)
        if plain and model.actuator_ctrllimited[actuator]:
            return float(np.abs(model.actuator_ctrlrange[actuator]).max() * abs(model.actuator_gainprm[actuator, 0]))
        return 0.0

    def _couple(self) -> None:
        """Mimics of the equality constraints that couple two joints."""
        model, coupling = self._model, int(self._library.mjtEq.mjEQ_JOINT)
        below = {j for b in self._bodies[1:] for j in self._all_joints(b)}
        elements = {joint.get("name"): joint for joint in self._robot.findall("joint")}
        loops = 0
        for number in range(model.neq):
            if not model.eq_active0[number]:
                continue
            if int(model.eq_type[number]) != coupling:
                loops += 1
                continue
            joint, driver = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
            if joint not in below:
                continue
            name = self._names.joints[joint]
            if driver not in below:
                where = f"'{self._names.joints[driver]}', which does not move" if driver >= 0 else "nothing"
                self._notes.append(f"joint '{name}' is held by an equality with {where}; lock it (locked: ...)")
                continue
            multiplier, offset = self._line(number, joint, driver)
            tag = {"joint": self._names.joints[driver], "multiplier": _words([multiplier]), "offset": _words([offset])}
            SubElement(elements[name], "mimic", tag)
        if loops:
            what = f"{loops} equality constraint{'s' if loops > 1 else ''}"
            self._notes.append(f"{what} other than of two joints (loops, welds, tendons): not kept")

    def _line(self, number: int, joint: int, driver: int) -> tuple[float, float]:
        """Multiplier and offset of a coupling; MuJoCo's is between the distances from the reference positions."""
        model = self._model
        a0, a1, *higher = (float(a) for a in model.eq_data[number, :5])
        name, other = self._names.joints[joint], self._names.joints[driver]
        if any(abs(a) > NONE for a in higher):
            terms = ", ".join(f"{a:g}" for a in (a0, a1, *higher))
            raise GraspAtlasError(
                f"joint '{name}' of '{self._path}' follows '{other}' by a polynomial that is not linear ({terms}); "
                "hands know linear couplings: state its slope alone (polycoef), or take it out and lock the joint"
            )
        y0, x0 = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (joint, driver))
        return a1, y0 + a0 - a1 * x0

    def _note_rest(self, shapes: ShapeWriter) -> None:
        """Say what is left out."""
        model, names = self._model, self._names
        palm = names.bodies[self._root]
        dropped = [names.joints[j] for b in self._carriers() for j in self._all_joints(b)]
        if dropped:
            self._notes.append(
                f"{_listed('joint', dropped)} move{'s' if len(dropped) == 1 else ''} the palm '{palm}', which stands "
                "still here: left out; a root: above it keeps what turns or slides"
            )
        outside = model.nbody - len(self._bodies) - (self._root > 0)
        if outside:
            self._notes.append(f"{outside} bod{'y' if outside == 1 else 'ies'} not on the palm '{palm}': left out")
        coupling = [t for t in range(model.ntendon) if model.tendon_num[t] > 1]
        if coupling:
            self._notes.append(
                f"{_listed('tendon', [names.tendons[t] for t in coupling])} of several joints: not kept; say what "
                "moves together by an equality of joints, or by couplings under hand_motions"
            )
        self._notes += shapes.notes

    def _carriers(self) -> list[int]:
        """The palm and the bodies that carry it, but for the world."""
        bodies: list[int] = []
        body = self._root
        while body > 0:
            bodies.insert(0, body)
            body = self._parent(body)
        return bodies


def _listed(kind: str, names: list[str]) -> str:
    """Some names, not more than a line holds."""
    shown = ", ".join(f"'{name}'" for name in names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
    return f"{kind}{'s' if len(names) > 1 else ''} {shown}"


def _shift(offset: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = offset
    return T


def _add_origin(element: Element, T: Array) -> None:
    SubElement(element, "origin", xyz=_words(T[:3, 3]), rpy=_words(rpy_from_matrix(T[:3, :3])))


def _words(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
