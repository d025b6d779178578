"""Principal hand motions (postural synergies): Section III of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.support.arrays import Array
from graspatlas.support.validation import (
    PlainTable,
    StatedTable,
    checked_instance,
    checked_table,
    number,
    number_array,
    read_only,
)

__all__ = ["HandMotions", "coupling_rows"]

#: Joint positions are smaller [rad or m]: larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9


@dataclass(frozen=True, eq=False)
class HandMotions:
    r"""Principal directions of variance of a set of hand configurations.

    .. math:: T T^\top = E S^2 E^\top

    Attributes:
        joints: Names of the joints, in the order of all arrays below (h,).
        mean: Mean configuration (h,), radians.
        covariance: Their covariance (h, h); only its eigenvectors and the order of its eigenvalues matter.
        couplings: Coefficients (c, h) of joints whose sum keeps its value: a row of index_dip 1 and index_pip -0.7 lets
            the one turn by 0.7 of what the other turns. They are always frozen, before all other motions, and count
            among the s of eq (12). They narrow R, not F: what the mechanism couples belongs into the hand's URDF, as a
            ``<mimic>`` tag.

    Source: "Global Optimization of Robotic Grasps", Section III, eqs (10) to (13).
    """

    joints: tuple[str, ...]
    mean: Array
    covariance: Array
    couplings: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        checked_instance(self.joints, Sequence, "joints")
        h = len(self.joints)
        mean = number_array(self.mean, "the mean of the hand motions")
        covariance = number_array(self.covariance, "the covariance of the hand motions")
        if mean.shape != (h,) or covariance.shape != (h, h):
            raise GraspAtlasError(
                f"hand motions of {h} joints need a mean of shape ({h},) and a covariance of shape ({h}, {h}); "
                f"got {mean.shape} and {covariance.shape}"
            )
        if h == 0:
            raise GraspAtlasError("hand motions need joints")
        if not ((np.abs(mean) < LARGEST).all() and (np.abs(covariance) < LARGEST**2).all()):
            raise GraspAtlasError(f"hand motions hold a number that is not finite, or not below {LARGEST:g}")
        if not np.allclose(covariance, covariance.T, atol=1e-9 * max(1.0, float(np.abs(covariance).max()))):
            raise GraspAtlasError("the covariance of the hand motions is not symmetric")
        if len(set(self.joints)) != h:
            raise GraspAtlasError("a joint of the hand motions is named twice")
        object.__setattr__(self, "joints", tuple(self.joints))
        object.__setattr__(self, "mean", read_only(mean.copy()))
        object.__setattr__(self, "covariance", read_only(covariance.copy()))
        couplings = number_array(self.couplings, "the couplings of the hand motions")
        object.__setattr__(self, "couplings", read_only(couplings.copy() if couplings.size else np.zeros((0, h))))
        self._check_couplings()

    def __repr__(self) -> str:
        return f"<HandMotions of {len(self.joints)} joints, {len(self.couplings)} couplings>"

    def _check_couplings(self) -> None:
        c, h = self.couplings.shape if self.couplings.ndim == 2 else (-1, -1)
        if h != len(self.joints) or not np.isfinite(self.couplings).all():
            raise GraspAtlasError(f"the couplings must be rows of {len(self.joints)} finite numbers, one a joint")
        if c and np.linalg.matrix_rank(self.couplings) < c:
            raise GraspAtlasError("a coupling of the hand motions is empty or follows from the others: drop it")
        if c >= h:
            raise GraspAtlasError(f"{c} couplings leave the {h} joints no freedom: drop some")

    @classmethod
    def from_samples(cls, samples: ArrayLike, joints: Sequence[str]) -> HandMotions:
        """Hand motions of recorded configurations.

        Args:
            samples: One configuration a row (z, h), radians; at least two rows.
            joints: Names of the joints (h,).

        Raises:
            GraspAtlasError: If the samples have another shape or hold NaN.
        """
        X = number_array(samples, "samples")
        checked_instance(joints, Sequence, "joints")
        if X.ndim != 2 or X.shape[0] < 2 or X.shape[1] != len(joints):
            raise GraspAtlasError(f"samples must have shape (z, {len(joints)}) with z of at least 2, got {X.shape}")
        if not (np.abs(X) < LARGEST).all():
            raise GraspAtlasError(f"samples hold a number that is not finite, or not below {LARGEST:g}")
        return cls(tuple(joints), X.mean(axis=0), np.cov(X, rowvar=False).reshape(len(joints), -1))

    @classmethod
    def from_couplings(cls, couplings: Sequence[Mapping[str, float]], joints: Sequence[str]) -> HandMotions:
        """Hand motions of couplings alone, with nothing known of what else matters.

        Args:
            couplings: Coefficients by joint name, one table for each coupling; see ``couplings`` above.
            joints: Names of all joints (h,).

        Raises:
            GraspAtlasError: If there is no such joint, or the couplings are not independent.
        """
        h = len(joints)
        return cls(tuple(joints), np.zeros(h), np.zeros((h, h)), coupling_rows(couplings, joints))

    @property
    def variances(self) -> Array:
        """Variance along each motion, decreasing (h,); those of the couplings last."""
        if not len(self.couplings):
            return np.asarray(np.linalg.eigvalsh(self.covariance)[::-1])
        E = self.E
        return np.asarray(np.einsum("ij,ik,kj->j", E, self.covariance, E))

    @property
    def E(self) -> Array:
        """Motions as orthonormal columns, largest variance first, then the couplings (h, h).

        The largest entry of each is positive.
        """
        if len(self.couplings):
            Q, _ = np.linalg.qr(self.couplings.T, mode="complete")
            coupled, rest = np.split(Q, [len(self.couplings)], axis=1)
            _, vectors = np.linalg.eigh(rest.T @ self.covariance @ rest)
            E = np.hstack([rest @ vectors[:, ::-1], coupled])
        else:
            _, vectors = np.linalg.eigh(self.covariance)
            E = vectors[:, ::-1]
        largest = np.argmax(np.abs(E), axis=0)
        return np.asarray(E * np.sign(E[largest, np.arange(E.shape[1])]))

    def kept(self, s: int) -> Array:
        """The motions that stay when the s least important are frozen (h, h - s)."""
        self.check_frozen(s)
        return np.ascontiguousarray(self.E[:, : len(self.joints) - s])

    def frozen(self, s: int) -> Array:
        """E_s of eq (13): the s least important motions (h, s)."""
        self.check_frozen(s)
        return np.ascontiguousarray(self.E[:, len(self.joints) - s :])

    def variance_kept(self, s: int) -> float:
        """Share of the variance that stays when the s least important motions are frozen."""
        self.check_frozen(s)
        variances = np.maximum(self.variances, 0.0)
        total = float(variances.sum())
        return float(variances[: len(variances) - s].sum()) / total if total > 0.0 else 1.0

    def check_frozen(self, s: int) -> None:
        """Raise GraspAtlasError unless s hand motions can be frozen: a number up to h, at least all couplings."""
        if isinstance(s, bool) or not isinstance(s, Integral) or not 0 <= s <= len(self.joints):
            raise GraspAtlasError(f"0 to {len(self.joints)} hand motions can be frozen, not {s!r}")
        c = len(self.couplings)
        if s < c:
            raise GraspAtlasError(
                f"the hand motions have {c} couplings, which are always frozen, so s = {s} is too few: use a dimension "
                f"smaller by {c - s}"
            )
        if s > c > 0 and not self.covariance.any():
            raise GraspAtlasError(
                f"the hand motions have {c} couplings and no postures to tell what to freeze next, so s = {s} is too "
                f"many: use a dimension larger by {s - c}, or give samples"
            )

    def reordered(self, joints: Sequence[str]) -> HandMotions:
        """The same motions with the joints in another order."""
        checked_instance(joints, Sequence, "joints")
        for name in joints:
            if name not in self.joints:
                raise unknown_name("joint", name, self.joints, "one of the hand motions'")
        at = [self.joints.index(name) for name in joints]
        return HandMotions(tuple(joints), self.mean[at], self.covariance[np.ix_(at, at)], self.couplings[:, at])

    def to_dict(self) -> PlainTable:
        """The motions as plain data."""
        table: PlainTable = {
            "joints": list(self.joints),
            "mean": self.mean.tolist(),
            "covariance": self.covariance.tolist(),
        }
        rows = [
            {name: value for name, value in zip(self.joints, row, strict=True) if value != 0.0}
            for row in self.couplings.tolist()
        ]
        return {**table, "couplings": rows} if rows else table

    @classmethod
    def from_dict(cls, data: StatedTable) -> HandMotions:
        """The motions that :meth:`to_dict` described."""
        try:
            joints = tuple(data["joints"])
            couplings = coupling_rows(data.get("couplings") or (), joints)
            return cls(joints, data["mean"], data["covariance"], couplings)
        except (KeyError, TypeError, AttributeError) as error:
            raise GraspAtlasError(f"hand motions need joints, mean and covariance: {error!r}") from None


def coupling_rows(couplings: Sequence[Mapping[str, float]], joints: Sequence[str]) -> Array:
    """The matrix (c, h) of couplings that are stated as coefficients by joint name.

    Args:
        couplings: One table for each coupling.
        joints: Names of the joints (h,).

    Raises:
        GraspAtlasError: If there is no such joint, or a coefficient is not a number.
    """
    rows = np.zeros((len(couplings), len(joints)))
    for row, table in zip(rows, couplings, strict=True):
        for name, value in checked_table(table, "a coupling", (), None).items():
            if name not in joints:
                raise unknown_name("joint", name, joints, "one that moves")
            row[list(joints).index(name)] = number(value, f"the coefficient of joint '{name}'")
    return rows
