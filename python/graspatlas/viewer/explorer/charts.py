"""What the page knows of each grasp: those at the charts' centres, and after them the refined maxima."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.execution.contact_forces import ContactForces
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import quality_name
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.requirements.base import Requirement, asked, requirement_name
from graspatlas.requirements.force_closure import stated_friction
from graspatlas.requirements.lost import kept
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.arrays import AnyArray, Array, IntArray
from graspatlas.viewer.explorer.numbers import Numbers
from graspatlas.viewer.explorer.tree import Joint, joint_tree, world_placements
from graspatlas.viewer.scene.velocity_ellipsoid import velocity_ellipsoids

__all__ = ["Charts"]

#: Indices that the page offers besides those of the result; they take hardly any time.
QUICK = (
    "manipulability_volume",
    "smallest_semi_axis",
    "inverse_condition_number",
    "force_closure_margin",
    "joint_centrality",
)
#: Refined maxima that are shown, the best first.
MOST_MAXIMA = 20
#: Coefficient of friction where no requirement states one.
FRICTION = 0.5


class Charts:
    """The grasps of a page, and the columns of numbers that it has of them.

    Args:
        result: The result.
        batches: Other grasps of it in place of these.
    """

    def __init__(self, result: GraspAtlas, batches: Sequence[Grasps] | None = None) -> None:
        self.result = result
        self.joints: list[Joint] = joint_tree(result.problem.hand)
        if batches is not None:
            self.batches = list(batches)
            return
        self.batches = [Grasps(result.problem, result.atlas.centers, result.system)]
        if result.refinement:
            full = result.refinement.all_motions
            system = result.problem.full_system if full else result.system
            self.batches.append(Grasps(result.problem, result.refinement.x[:MOST_MAXIMA], system))

    @property
    def n_maxima(self) -> int:
        """How many refined maxima stand after the charts."""
        return sum(map(len, self.batches[1:]))

    def _of_all(self, read: Callable[[Grasps], AnyArray]) -> Array:
        return np.concatenate([np.asarray(read(grasps), float) for grasps in self.batches])

    @cached_property
    def indices(self) -> dict[str, Array]:
        """Values of the indices by name, the result's own first, (n,) each; NaN where one is not known."""
        result = self.result
        columns = dict(self._stored())
        for name in QUICK:
            if name not in columns:
                try:
                    columns[name] = self._of_all(partial(evaluate, name))
                except GraspAtlasError:  # it does not apply to this problem
                    continue
        main = quality_name(result.quality)
        return {main: columns.pop(main), **columns}

    def _stored(self) -> Iterator[tuple[str, Array]]:
        """Values of the indices that the result holds."""
        result = self.result
        main = quality_name(result.quality)
        for name, values in ((main, result.qualities), *result.others.items()):
            at_maxima = [np.full(len(grasps), np.nan) for grasps in self.batches[1:]]
            if result.refinement and name == main:
                at_maxima = [result.refinement.qualities[: self.n_maxima]]
            elif name in INDICES:
                at_maxima = [evaluate(name, grasps) for grasps in self.batches[1:]]
            yield name, np.concatenate([values, *at_maxima])

    @cached_property
    def rejections(self) -> tuple[list[str], AnyArray]:
        """Names of the requirements, and which of them reject each grasp, a bit for each (n,).

        Functions are not asked again: what the named requirements accept and the result does not, they have rejected.
        """
        requirements = kept(self.result.requirements)
        named = [r for r in requirements if isinstance(r, Requirement)]
        names = [requirement_name(r) for r in named]
        bits = np.zeros(len(self._of_all(lambda grasps: grasps.charts)), np.uint32)
        for bit, requirement in enumerate(named):
            bits |= (self._of_all(partial(asked, requirement)) == 0.0).astype(np.uint32) << bit
        by_functions = np.flatnonzero((bits[: len(self.result.accepted)] == 0) & ~self.result.accepted)
        if len(by_functions):
            functions = [requirement_name(r) for r in self.result.requirements if r not in named]
            bits[by_functions] |= 1 << len(named)
            names.append(", ".join(functions) or "other requirements")
        return names, bits

    @cached_property
    def friction(self) -> tuple[float, float]:
        """Coefficient of friction of the contact forces, and torsional friction [m]."""
        return stated_friction(self.result.requirements) or (FRICTION, 0.0)

    def write(self, numbers: Numbers) -> None:
        """Write all columns."""
        self.write_postures(numbers)
        numbers.add("rejections", self.rejections[1])
        for i, values in enumerate(self.indices.values()):
            numbers.add(f"index_{i}", _short(values, self.result.accepted))

    def write_postures(self, numbers: Numbers) -> None:
        """Write what is drawn of the grasps: joints, object, contacts, forces and ellipsoid."""
        numbers.add_rounded("positions", self._positions)
        numbers.add_rounded("object_xyz", self._of_all(lambda grasps: grasps.object_xyz))
        numbers.add_rounded("object_quat", self._of_all(lambda grasps: grasps.object_quat_xyzw))
        for name, column in zip(("contact_points", "contact_normals"), self._contacts(), strict=True):
            numbers.add_rounded(name, column)
        axes, semi_axes = (np.concatenate(parts) for parts in zip(*map(velocity_ellipsoids, self.batches), strict=True))
        numbers.add_rounded("ellipsoid_axes", axes[:, :, :2].swapaxes(1, 2).reshape(len(axes), 6))
        numbers.add_rounded("ellipsoid_lengths", semi_axes, log=True)
        numbers.add_rounded("semi_axes", self._of_all(lambda grasps: grasps.semi_axes), log=True)
        forces = [self._forces(grasps) for grasps in self.batches]
        numbers.add_rounded("forces", np.concatenate([f.forces.reshape(len(f.forces), -1) for f in forces]))

    @cached_property
    def _positions(self) -> Array:
        """Positions of all joints (n, h), radians and metres."""
        return self._of_all(lambda grasps: np.column_stack(list(grasps.joint_positions.values())))

    def _contacts(self) -> tuple[Array, Array]:
        """Contact points and the object's outward normals (n, 3 m) in the joints that carry the contacts.

        There the points of fingertips do not move, and cost nothing.
        """
        points = self._of_all(lambda grasps: grasps.contact_points)
        normals = self._of_all(lambda grasps: grasps.contact_normals)
        placements = world_placements(self.joints, self._positions)
        for i, joint in enumerate(self.contact_joints()):
            R, p = placements[joint][:, :3, :3], placements[joint][:, :3, 3]
            points[:, i] = np.einsum("nji,nj->ni", R, points[:, i] - p)
            normals[:, i] = np.einsum("nji,nj->ni", R, normals[:, i])
        return points.reshape(len(points), -1), normals.reshape(len(normals), -1)

    def contact_joints(self) -> IntArray:
        """Number of the joint that carries each contact (m,); 0 is the palm."""
        hand = self.result.problem.hand
        return np.array([hand.frame(contact.frame)[0] for contact in self.result.problem.contacts])

    def _forces(self, grasps: Grasps) -> ContactForces:
        friction, torsional = self.friction
        return grasps.contact_forces(friction=friction, torsional=torsional)


def _short(values: Array, accepted: AnyArray) -> AnyArray:
    """Values in four bytes, unless that would make another chart the best or the worst, or one overflow."""
    with np.errstate(over="ignore"):
        short = values.astype(np.float32)
    n = len(accepted)
    exact, rounded = (np.where(accepted, v[:n], np.nan) for v in (values, short))
    if np.isinf(short).sum() > np.isinf(values).sum() or not accepted.any():
        return values
    same = all(pick(exact) == pick(rounded) for pick in (np.nanargmax, np.nanargmin))
    return short if same else values
