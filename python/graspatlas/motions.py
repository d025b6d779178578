"""Principal hand motions (postural synergies): Section III of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.tables import checked_instance, number_array

__all__ = ["HandMotions"]

Array = NDArray[np.float64]

#: Joint positions are smaller [rad or m]: larger ones are mistakes, and their squares may overflow.
LARGEST = 1e9


@dataclass(frozen=True, eq=False)
class HandMotions:
    r"""Principal directions of variance of a set of hand configurations.

    .. math:: T T^\top = E S^2 E^\top

    Attributes:
        joints: Names of the joints, in the order of all arrays below [h].
        mean: Mean configuration [h], radians.
        covariance: Their covariance [h, h]; only its eigenvectors and the order of its eigenvalues matter.

    Source: "Global Optimization of Robotic Grasps", Section III, eqs (10) to (13).
    """

    joints: tuple[str, ...]
    mean: Array
    covariance: Array

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
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "covariance", covariance)

    @classmethod
    def from_samples(cls, samples: ArrayLike, joints: Sequence[str]) -> HandMotions:
        """Hand motions of recorded configurations.

        Args:
            samples: One configuration a row [z, h], radians; at least two rows.
            joints: Names of the joints [h].

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

    @property
    def variances(self) -> Array:
        """Variance along each motion, decreasing [h]."""
        return np.asarray(np.linalg.eigvalsh(self.covariance)[::-1])

    @property
    def E(self) -> Array:
        """Motions as orthonormal columns, largest variance first [h, h]; the largest entry of each is positive."""
        _, vectors = np.linalg.eigh(self.covariance)
        E = vectors[:, ::-1]
        largest = np.argmax(np.abs(E), axis=0)
        return np.asarray(E * np.sign(E[largest, np.arange(E.shape[1])]))

    def kept(self, s: int) -> Array:
        """The motions that stay when the s least important are frozen [h, h - s]."""
        self._check_count(s)
        return np.ascontiguousarray(self.E[:, : len(self.joints) - s])

    def frozen(self, s: int) -> Array:
        """E_s of eq (13): the s least important motions [h, s]."""
        self._check_count(s)
        return np.ascontiguousarray(self.E[:, len(self.joints) - s :])

    def variance_kept(self, s: int) -> float:
        """Share of the variance that stays when the s least important motions are frozen."""
        self._check_count(s)
        variances = np.maximum(self.variances, 0.0)
        total = float(variances.sum())
        return float(variances[: len(variances) - s].sum()) / total if total > 0.0 else 1.0

    def _check_count(self, s: int) -> None:
        if isinstance(s, bool) or not isinstance(s, Integral) or not 0 <= s <= len(self.joints):
            raise GraspAtlasError(f"0 to {len(self.joints)} hand motions can be frozen, not {s!r}")

    def reordered(self, joints: Sequence[str]) -> HandMotions:
        """The same motions with the joints in another order."""
        checked_instance(joints, Sequence, "joints")
        for name in joints:
            if name not in self.joints:
                raise unknown_name("joint", name, self.joints, "one of the hand motions'")
        at = [self.joints.index(name) for name in joints]
        return HandMotions(tuple(joints), self.mean[at], self.covariance[np.ix_(at, at)])

    def to_dict(self) -> dict[str, Any]:
        """The motions as plain data."""
        return {
            "joints": list(self.joints),
            "mean": self.mean.tolist(),
            "covariance": self.covariance.tolist(),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> HandMotions:
        """The motions that :meth:`to_dict` described."""
        try:
            return cls(tuple(data["joints"]), data["mean"], data["covariance"])
        except (KeyError, TypeError) as error:
            raise GraspAtlasError(f"hand motions need joints, mean and covariance: {error!r}") from None
