r"""Forces with which the contacts hold the object, and the joint torques with which the fingers exert them.

Of all forces that balance and have this total normal force N, they stay farthest from the friction cones' surfaces:

.. math:: \max_f \min_i \; (\mu \, n_i^\top f_i - \| f_i - n_i n_i^\top f_i \|) / \sqrt{1 + \mu^2}, \qquad
    G f + w = 0, \quad \sum_i n_i^\top f_i = N

with the inward normals :math:`n_i` and a load w, by default none. :math:`f_i` acts on the object; the finger is pushed
back by :math:`-f_i`, and at rest its joints have the torques :math:`\tau = J^\top f`, to which the weight of the hand
is not added. Soft fingers also exert torques about the normals, within the limit surface of
:func:`graspatlas.quality.force_closure_margin`; the joints supply these as well.

Source: the torques are the kinetostatics of D. Prattichizzo, J. C. Trinkle, "Grasping", Springer Handbook of Robotics.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypedDict

import numpy as np
from numpy.typing import ArrayLike

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.hand import Hand
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.support.validation import checked_instance, number, number_array, positive

__all__ = ["NORMAL_FORCE", "ContactForces", "ForceOptions", "actuated_efforts", "contact_forces"]

#: Normal force of a contact where nothing is said [N].
NORMAL_FORCE = 5.0


class ForceOptions(TypedDict, total=False):
    """Which contact forces are meant.

    Attributes:
        normal_force: Sum of the normal forces [N]; by default 5 N a contact.
        friction: Coefficient of friction mu; 0.5 by default.
        torsional: Torsional friction gamma [m] of soft fingers; 0 by default, hard fingers.
        load: What pulls at the object at its centre of mass, in the object's frame: a force [N] (3,), or a force and a
            torque [N m] (6,); in the plane (2,) or (3,). One for all grasps, or a row for each. None by default.
        within_efforts: Whether the normal forces of a grasp are reduced until no joint exceeds its effort; they are not
            by default. Joints that state no effort are taken for strong enough.
    """

    normal_force: float | None
    friction: float
    torsional: float
    load: ArrayLike | None
    within_efforts: bool


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Contact forces of one grasp: m contacts, d actuated joints; or of n, all arrays with a leading axis of length n.

    Attributes:
        forces: Forces on the object in the palm's axes (m, 3) [N]; NaN where the grasp cannot hold.
        normal_forces: Their parts along the inward normals (m,) [N].
        torques: Torques on the object about the inward normals (m,) [N m]; 0 of hard fingers.
        joints: Names of the actuated joints.
        joint_torques: Torques of these joints (d,) [N m], or forces where they slide [N], without the hand's weight.
        efforts: Largest ones by the hand's URDF (d,); NaN where it states none.
        margin: Distance of the forces from the surfaces of their cones for a total normal force of one (); 0 where the
            grasp cannot hold. Without a load it is :func:`graspatlas.quality.force_closure_margin`.
        total_normal_force: Sum of the normal forces () [N].
        friction: Coefficient of friction mu.
        torsional: Torsional friction [m].
    """

    forces: Array
    normal_forces: Array
    torques: Array
    joints: tuple[str, ...]
    joint_torques: Array
    efforts: Array
    margin: Array
    total_normal_force: Array
    friction: float
    torsional: float

    @property
    def effort_share(self) -> Array:
        """Largest share that a joint needs of its effort (); above 1 it is too weak, NaN where none states one."""
        stated = np.isfinite(self.efforts)
        if not stated.any():
            return np.full(np.shape(self.margin), np.nan)[()]
        return np.asarray((np.abs(self.joint_torques[..., stated]) / self.efforts[stated]).max(axis=-1))[()]

    def __getitem__(self, i: int) -> ContactForces:
        """Those of grasp i of a batch."""
        names = ("forces", "normal_forces", "torques", "joint_torques", "margin", "total_normal_force")
        return replace(self, **{name: getattr(self, name)[i] for name in names})

    def scaled(self, factor: ArrayLike) -> ContactForces:
        """All forces and torques times a factor, one or one for each grasp (n,)."""
        by = np.asarray(factor, float)
        return replace(
            self,
            forces=self.forces * by[..., None, None],
            normal_forces=self.normal_forces * by[..., None],
            torques=self.torques * by[..., None],
            joint_torques=self.joint_torques * by[..., None],
            total_normal_force=self.total_normal_force * by,
        )


def contact_forces(
    problem: Problem,
    system: _core.GraspSystem,
    X: Array,
    *,
    normal_force: float | None = None,
    friction: float = 0.5,
    torsional: float = 0.0,
    load: ArrayLike | None = None,
    within_efforts: bool = False,
) -> ContactForces:
    """Contact forces of grasps X (n, configuration_size); see the top of this module and :class:`ForceOptions`.

    Raises:
        GraspAtlasError: If an argument is out of its range, or efforts shall be kept that the hand does not state.
    """
    n, m = len(X), len(problem.contacts)
    total = NORMAL_FORCE * m if normal_force is None else positive(normal_force, "normal_force")
    mu, gamma = positive(friction, "friction"), number(torsional, "torsional")
    checked_instance(within_efforts, bool, "within_efforts")
    places = system.grasp_arrays(X)
    loads = None if load is None else _loads_at_origin(problem, places["T_palm_object"], load) / total
    found = _core.contact_forces(system, X, mu, gamma, loads)
    unit = ContactForces(
        forces=found["forces"],
        normal_forces=-np.einsum("nmc,nmc->nm", found["forces"], places["object_normals"]),
        torques=found["torques"],
        joints=problem.hand.mechanism.actuated,
        joint_torques=found["joint_torques"],
        efforts=actuated_efforts(problem.hand),
        margin=found["margin"],
        total_normal_force=np.ones(n),
        friction=mu,
        torsional=gamma,
    )
    forces = unit.scaled(np.full(n, total))
    return _within_efforts(forces, problem.hand, load is not None) if within_efforts else forces


def actuated_efforts(hand: Hand) -> Array:
    """Effort of each actuated joint (d,) [N m or N]; NaN where the URDF states none."""
    efforts = hand.efforts_by_name
    return np.array([efforts.get(name, np.nan) for name in hand.mechanism.actuated])


def _within_efforts(forces: ContactForces, hand: Hand, loaded: bool) -> ContactForces:
    if loaded:
        raise GraspAtlasError(
            "within_efforts reduces forces that balance among themselves, and a load stays as it is: leave out one of "
            "the two, and compare effort_share with 1"
        )
    if not np.isfinite(forces.efforts).any():
        raise GraspAtlasError(
            f"the URDF of hand '{hand.name}' has no effort limit of an actuated joint, which within_efforts needs: add "
            "<limit effort=...> [N m or N]"
        )
    share = forces.effort_share
    return forces.scaled(1.0 / np.where(share > 1.0, share, 1.0))


def _loads_at_origin(problem: Problem, T_palm_object: Array, load: ArrayLike) -> Array:
    """Loads at the centre of mass, in the object's frame, as wrenches at its origin in the palm's axes (n, dof)."""
    joint, given = problem.object_joint_model, number_array(load, "load")
    axes, dof, n = joint.translations, joint.dof, len(T_palm_object)
    if given.ndim not in (1, 2) or given.shape[-1] not in (axes, dof) or given.shape[:-1] not in ((), (n,)):
        raise GraspAtlasError(
            f"load must hold a force of {axes} numbers, or with a torque {dof}, or one row of them for each of {n} "
            f"grasps; got the shape {given.shape}"
        )
    if not np.isfinite(given).all():
        raise GraspAtlasError("load must hold finite numbers")
    wrenches = np.zeros((n, dof))
    wrenches[:, : given.shape[-1]] = given
    R, force, torque = T_palm_object[:, :3, :3], np.zeros((n, 3)), np.zeros((n, 3))
    force[:, :axes] = wrenches[:, :axes]
    torque[:, 3 - (dof - axes) :] = wrenches[:, axes:]
    torque += np.cross(problem.object.center_of_mass, force)
    turned = [np.einsum("nij,nj->ni", R, v) for v in (force, torque)]
    return np.hstack([turned[0][:, :axes], turned[1][:, 3 - (dof - axes) :]])
