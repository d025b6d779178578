"""The planar hand of Section V, straight from the paper: its constants, equations (19) to (25), and its index."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources

import numpy as np
import yaml
from numpy.typing import NDArray

import graspatlas as ga

Array = NDArray[np.float64]

FINGERS = ("first", "second", "third")


def turned(a: Array) -> Array:
    """A vector of the plane turned by a quarter, or several [..., 2]."""
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def angle(a: Array, b: Array) -> Array:
    """Angles from the vectors a to the vectors b [...], in (-pi, pi]."""
    return np.arctan2(np.sum(turned(a) * b, axis=-1), np.sum(a * b, axis=-1))


@dataclass(frozen=True)
class PlanarHand:
    """The constants of Fig. 8, read from the files as numbers [m, rad].

    Attributes:
        anchors: a_i [3, 2].
        lengths: l_i1 and l_i2 [3, 2].
        centers: c_i, in the object's frame [3, 2].
        radii: l_i3 [3].
        arcs: a_i and b_i [3, 2].
        theta_1: Joint angles at x1: base and elbow of each finger [3, 2].
        frozen: E_s [6].
        scale: Length that counts as one.
    """

    anchors: Array
    lengths: Array
    centers: Array
    radii: Array
    arcs: Array
    theta_1: Array
    frozen: Array
    scale: float

    @classmethod
    def read(cls) -> PlanarHand:
        """The constants, by ways of their own: no kinematics and no patch of the package is used."""
        file = resources.files("graspatlas") / "problems" / "planar_hand.yaml"
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
        urdf = (ga.hand.robots_folder() / data["hand"]["urdf"]).read_text(encoding="utf-8")
        joints, contacts = data["x1"]["joints"], data["contacts"]
        arcs = [contact["object"] for contact in contacts]
        assert [contact["frame"] for contact in contacts] == [f"{name}_distal" for name in FINGERS]
        covariance = np.array(data["hand_motions"]["covariance"])
        assert data["hand_motions"]["joints"] == [f"{name}_{j}" for name in FINGERS for j in ("base", "elbow")]
        return cls(
            anchors=np.array([joint_origin(urdf, f"{name}_base")[:2] for name in FINGERS]),
            lengths=np.array(
                [
                    [joint_origin(urdf, f"{name}_elbow")[0], contact["hand"]["position"][0]]
                    for name, contact in zip(FINGERS, contacts, strict=True)
                ]
            ),
            centers=np.array([arc["origin"][:2] for arc in arcs]),
            radii=np.array([arc["radius"] for arc in arcs]),
            arcs=np.array([arc["u_interval"] for arc in arcs]),
            theta_1=np.array([[joints[f"{name}_base"], joints[f"{name}_elbow"]] for name in FINGERS]),
            frozen=np.linalg.eigh(covariance)[1][:, 0],
            scale=data["length_scale"],
        )


def joint_origin(urdf: str, joint: str) -> Array:
    """Where the text of a URDF puts a joint [3]."""
    part = urdf[urdf.index(f'<joint name="{joint}"') :]
    return np.array(part[part.index('xyz="') + 5 :].split('"')[0].split(), float)


@dataclass(frozen=True)
class Parts:
    """A vector x of the second route, taken apart.

    Attributes:
        v: Unit vectors along the phalanges [3 fingers, 2 phalanges, 2].
        t: Position of the object, in units of the length scale [2].
        o: Its orientation (s_o, c_o) [2].
        u: Angles of the contacts on their arcs [3].
    """

    v: Array
    t: Array
    o: Array
    u: Array

    @classmethod
    def of(cls, x: Array) -> Parts:
        return cls(x[:12].reshape(3, 2, 2), x[12:14], x[14:16], x[16:])

    def rotation(self) -> Array:
        """The matrix of eq (23)."""
        s, c = self.o
        return np.array([[c, -s], [s, c]])


class PaperGrasps(ga.System):
    """Eqs (19) to (25), and (13) unless `frozen` is False: 19 variables, lengths in units of the length scale.

    The arcs are fixed to the object, so u_i is read as an angle in its frame: with the w(u_i) of eq (24) taken in the
    palm's frame the interval [a_i, b_i] would not bound an arc of the object.
    """

    def __init__(self, hand: PlanarHand, frozen: bool = True) -> None:
        lower, upper = np.full(19, -np.inf), np.full(19, np.inf)
        lower[16:], upper[16:] = hand.arcs.T
        super().__init__(19, 17 if frozen else 16, lower, upper)
        self.hand = hand
        self.frozen = frozen
        first = hand.theta_1[:, 0]
        self.base_1 = np.column_stack([np.cos(first), np.sin(first)])

    def residual(self, x: Array) -> Array:
        p, hand = Parts.of(x), self.hand
        w = np.column_stack([np.cos(p.u), np.sin(p.u)])
        q = (hand.anchors + np.einsum("ij,ijc->ic", hand.lengths, p.v)) / hand.scale
        o = p.t + (hand.centers + hand.radii[:, None] * w) @ p.rotation().T / hand.scale
        units = np.r_[np.sum(p.v**2, axis=2).ravel(), p.o @ p.o] - 1.0
        # n_i = -m_i turns about one axis: that the two are parallel is one equation, the sign is looked at elsewhere.
        parallel = np.sum(turned(p.v[:, 1]) * (w @ p.rotation().T), axis=1)
        rows = [units, (q - o).ravel(), parallel]
        return np.concatenate([*rows, self.frozen_motion(p)] if self.frozen else rows)

    def frozen_motion(self, p: Parts) -> Array:
        """Eq (13) [1]; base angles are counted from x1, elbow angles from a straight finger."""
        elbow = angle(p.v[:, 0], p.v[:, 1]) - self.hand.theta_1[:, 1]
        return np.array([np.column_stack([angle(self.base_1, p.v[:, 0]), elbow]).ravel() @ self.hand.frozen])

    def jacobian(self, x: Array) -> Array:
        p, hand = Parts.of(x), self.hand
        w = np.column_stack([np.cos(p.u), np.sin(p.u)])
        R, D = p.rotation(), np.array([[[0.0, -1.0], [1.0, 0.0]], np.eye(2)])  # dR / ds_o, dR / dc_o
        J = np.zeros((17, 19))
        J[np.repeat(range(6), 2), range(12)] = 2.0 * p.v.ravel()
        J[6, 14:16] = 2.0 * p.o
        for i in range(3):
            rows, v2 = slice(7 + 2 * i, 9 + 2 * i), slice(4 * i + 2, 4 * i + 4)
            arm = hand.centers[i] + hand.radii[i] * w[i]
            J[rows, 4 * i : 4 * i + 4] = np.kron(hand.lengths[i], np.eye(2)) / hand.scale
            J[rows, 12:14] = -np.eye(2)
            J[rows, 14:16] = -(D @ arm).T / hand.scale
            J[rows, 16 + i] = -hand.radii[i] * R @ turned(w[i]) / hand.scale
            J[13 + i, v2] = -turned(R @ w[i])
            J[13 + i, 14:16] = turned(p.v[i, 1]) @ (D @ w[i]).T
            J[13 + i, 16 + i] = turned(p.v[i, 1]) @ R @ turned(w[i])
            base, distal = (turned(p.v[i, j]) / (p.v[i, j] @ p.v[i, j]) for j in (0, 1))
            e_base, e_elbow = hand.frozen[2 * i : 2 * i + 2]
            J[16, 4 * i : 4 * i + 4] = np.r_[(e_base - e_elbow) * base, e_elbow * distal]
        return J[: self.n_equations]


def to_paper(hand: PlanarHand, x: Array) -> Array:
    """The second route's x of a grasp of the general route: both have 19 numbers, and they are not the same."""
    base, elbow = x[:12].reshape(3, 2, 2).transpose(1, 2, 0)
    global_2 = np.stack([base[0] * elbow[0] - base[1] * elbow[1], base[1] * elbow[0] + base[0] * elbow[1]])
    v = np.stack([base.T, global_2.T], axis=1)
    return np.r_[v.ravel(), x[12:14] / hand.scale, x[15], x[14], x[16:]]


def to_general(hand: PlanarHand, x: Array) -> Array:
    """The inverse of :func:`to_paper`."""
    p = Parts.of(x)
    v = p.v / np.linalg.norm(p.v, axis=2, keepdims=True)
    elbow = np.column_stack([np.sum(v[:, 0] * v[:, 1], axis=1), np.sum(turned(v[:, 0]) * v[:, 1], axis=1)])
    return np.r_[np.stack([v[:, 0], elbow], axis=1).ravel(), p.t * hand.scale, p.o[::-1], p.u]


def inverse_condition_number(hand: PlanarHand, x: Array) -> float:
    """Smallest over largest semi-axis of the manipulability ellipsoid, lengths in millimetres; by NumPy alone."""
    p = Parts.of(x)
    J, Gt = np.zeros((6, 6)), np.zeros((6, 3))
    links = 1e3 * hand.lengths[:, :, None] * turned(p.v)
    tips = 1e3 * (hand.anchors + np.einsum("ij,ijc->ic", hand.lengths, p.v))
    for i in range(3):
        J[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = np.column_stack([links[i].sum(axis=0), links[i, 1]])
        Gt[2 * i : 2 * i + 2] = np.column_stack([np.eye(2), turned(tips[i] - 1e3 * hand.scale * p.t)])
    # Object velocity t and joint velocity J^-1 G' t belong together; unit joint velocities make the ellipsoid.
    sigma = np.linalg.svd(np.linalg.solve(J, Gt), compute_uv=False)
    return float(sigma[-1] / sigma[0])
