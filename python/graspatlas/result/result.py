"""What `optimize` returns: grasps, atlas and qualities, able to verify themselves."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspatlas.atlas.atlas import Atlas, Status
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasp, Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import Quality, evaluate, quality_name
from graspatlas.requirements.screening import Require, requirement_name, screen
from graspatlas.result.exports import save_grasps
from graspatlas.result.files import read_result, save_result
from graspatlas.result.refinement import Refinement
from graspatlas.result.verification import CheckReport, check_result
from graspatlas.support.pickling import Light
from graspatlas.support.validation import read_only

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["Result", "load_result"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Result(Light):
    """The best grasp, and everything it was chosen from. Its arrays cannot be written to: copy what you want to change.

    Attributes:
        problem: The problem.
        atlas: Atlas of the relevant grasps.
        quality: The index: its name, or the callable.
        qualities: Its value at each chart centre [n].
        quality_seconds: Time that its evaluation and that of the requirements took.
        requirements: What a grasp must meet to be the best or the worst; names where a callable was not stored.
        feasible: Which charts meet the requirements [n].
        refused: How many charts each requirement refused, of those that the ones before it had left.
        others: Values of the other indices that were asked for, by name, [n] each.
        refinement: Local maxima between the charts' centres, when they were asked for.
    """

    problem: Problem
    atlas: Atlas
    quality: Quality
    qualities: Array
    quality_seconds: float
    requirements: tuple[Require | str, ...]
    feasible: NDArray[np.bool_]
    refused: Mapping[str, int]
    others: Mapping[str, Array] = field(default_factory=dict)
    refinement: Refinement | None = None

    def __repr__(self) -> str:
        atlas = f"{self.atlas.n_charts} charts, k = {self.dimension}, {self.status}"
        best = f"{self.qualities[self.feasible].max():.6g}" if self.feasible.any() else "none, no grasp will do"
        return f"<Result of {self.problem.name!r}: {atlas}; best {quality_name(self.quality)} {best}>"

    def __post_init__(self) -> None:
        object.__setattr__(self, "qualities", read_only(self.qualities))
        object.__setattr__(self, "feasible", read_only(self.feasible))
        object.__setattr__(self, "others", {name: read_only(values) for name, values in self.others.items()})

    @property
    def status(self) -> Status:
        """Whether the atlas is complete, or why it was cut short."""
        return self.atlas.status

    @property
    def dimension(self) -> int:
        """k: dimension of the set of relevant grasps."""
        return self.atlas.dimension

    @property
    def is_global(self) -> bool:
        """True when the best is the best of all grasps connected to x1 that meet the requirements, up to a chart.

        Then the atlas is complete and was audited, and the Jacobian keeps its rank: see :attr:`Atlas.doubts`, which say
        why it is not. What an audit can know is said by :meth:`Audit.share_missing`.
        """
        return not self.atlas.doubts

    @cached_property
    def best(self) -> Grasp:
        """Grasp with the largest quality of those that meet the requirements; the first of equals.

        Raises:
            GraspAtlasError: If no grasp meets them.
        """
        candidates = self.candidates()
        return self.grasp(int(candidates[np.argmax(self.qualities[candidates])]))

    @cached_property
    def worst(self) -> Grasp:
        """Grasp with the smallest quality of those that meet the requirements; the first of equals.

        Raises:
            GraspAtlasError: If no grasp meets them.
        """
        candidates = self.candidates()
        return self.grasp(int(candidates[np.argmin(self.qualities[candidates])]))

    def candidates(self) -> NDArray[np.intp]:
        """Charts that meet the requirements, ascending; at least one.

        Raises:
            GraspAtlasError: If no grasp meets them.
        """
        if not self.feasible.any():
            counts = ", ".join(f"{name} refused {count}" for name, count in self.refused.items())
            raise GraspAtlasError(f"none of {self.atlas.n_charts} grasps meets the requirements ({counts}): relax one")
        return np.flatnonzero(self.feasible)

    @cached_property
    def refined_best(self) -> Grasp:
        """The best grasp, no longer bound to the centre of a chart; its chart is the one the climb to it began from.

        It is the highest place at which a climb ended. Whether that is a maximum says ``refinement.statuses[0]``.

        Raises:
            GraspAtlasError: If no refinement was asked for.
        """
        if self.refinement is None:
            raise GraspAtlasError("this result was not refined: give optimize refine=True")
        system = self.problem.full_system if self.refinement.all_motions else self.atlas.system
        one = Grasps(self.problem, self.refinement.x[0], system)[0]  # type: ignore[arg-type]
        quality, chart = float(self.refinement.qualities[0]), int(self.refinement.starts[0])
        return replace(one, quality=quality, chart=chart)

    @property
    def gain(self) -> float:
        """By how much the refined best is better than the best chart, as a share of the latter's quality."""
        return (self.refined_best.quality - self.best.quality) / max(abs(self.best.quality), 1e-300)

    def values(self, quality: Quality) -> Array:
        """Value of any index at each chart centre [n].

        Args:
            quality: Name of an index, or a callable: see :mod:`graspatlas.quality`.

        Raises:
            GraspAtlasError: If there is no such index, or it fails.
        """
        name = quality_name(quality)
        if quality == self.quality:
            return self.qualities
        if isinstance(quality, str) and name in self.others:
            return self.others[name]
        charts = np.arange(self.atlas.n_charts)
        return evaluate(quality, Grasps(self.problem, self.atlas.centers, self.atlas.system, charts))  # type: ignore[arg-type]

    def by(self, quality: Quality) -> Result:
        """The same grasps with another index to choose the best by; not refined.

        Args:
            quality: Name of an index, or a callable.

        Raises:
            GraspAtlasError: If there is no such index, or it fails.
        """
        values = self.values(quality)
        kept = {**self.others, quality_name(self.quality): self.qualities}
        kept.pop(quality_name(quality), None)
        return replace(self, quality=quality, qualities=values, others=kept, refinement=None)

    @property
    def at_x1(self) -> Grasp:
        """The first grasp; the atlas began with it."""
        return self.grasp(0)

    def grasp(self, chart: int) -> Grasp:
        """Grasp at a chart's centre, with its quality.

        Raises:
            GraspAtlasError: If there is no such chart.
        """
        one = Grasps(self.problem, self.atlas.centers[self.checked_chart(chart)])[0]
        return replace(one, quality=float(self.qualities[chart]), chart=chart)

    def checked_chart(self, chart: int) -> int:
        """The number of a chart that exists.

        Raises:
            GraspAtlasError: If there is no such chart.
        """
        whole = isinstance(chart, int | np.integer) and not isinstance(chart, bool)
        if not whole or not 0 <= chart < self.atlas.n_charts:
            raise GraspAtlasError(
                f"chart {chart!r} does not exist; the atlas has charts 0 to {self.atlas.n_charts - 1}"
            )
        return int(chart)

    def meets(self, X: ArrayLike) -> NDArray[np.bool_]:
        """Which configurations meet the requirements [n].

        Args:
            X: Configurations [n, configuration_size].

        Raises:
            GraspAtlasError: If a requirement was a callable, which is not stored with a result.
        """
        lost = [r for r in self.requirements if isinstance(r, str)]
        if lost:
            raise GraspAtlasError(
                f"requirement '{requirement_name(lost[0])}' is a callable that was not stored with the result; run "
                "optimize again in this program, or leave out feasible=True"
            )
        return screen([r for r in self.requirements if not isinstance(r, str)], Grasps(self.problem, X))[0]

    def save_grasps(
        self,
        path: str | os.PathLike[str],
        *,
        charts: Sequence[int] | None = None,
        best: int | None = None,
        feasible: bool = False,
        refined: bool = False,
    ) -> int:
        """Write grasps for other programs: joints by name, poses of palm and object, contacts, values of the indices.

        All charts in their order by default. The fields and columns are listed in docs/results.md. Lengths are in
        metres, angles in radians, quaternions x y z w; numbers have all digits.

        Args:
            path: Ends in ``.json``, one object with the names of frames and units, or ``.csv``, one row a grasp; an
                existing file is replaced at once or not.
            charts: Only these, in this order.
            best: Only so many, the best that meet the requirements, the best first.
            feasible: Only those that meet the requirements.
            refined: Put the refined best before the others.

        Returns:
            How many grasps were written.

        Raises:
            GraspAtlasError: If the file has another ending or cannot be written, there is no such chart, no grasp meets
                the requirements where some must, or `refined` was asked for and the result was not refined.
        """
        return save_grasps(self, path, charts=charts, best=best, feasible=feasible, refined=refined)

    def to_pandas(self, *, volumes: bool = False) -> DataFrame:
        """The atlas as a table, one row a chart: indices, joints, poses and what :meth:`Atlas.to_pandas` tells.

        Joints stand by their names [rad or m], the free patch parameters as ``contact0_hand_u`` and so on.

        Args:
            volumes: Add the volume of each chart's polytope; slow in high dimensions.

        Raises:
            GraspAtlasError: If pandas is not installed, or two columns have one name.
        """
        from graspatlas.result.data_frames import result_frame  # pandas is slow to import

        return result_frame(self, volumes)

    def check(self) -> CheckReport:
        """Verify every chart again, from the problem alone; see :func:`graspatlas.result.verification.check_result`."""
        return check_result(self)

    def summary(self) -> dict[str, Any]:
        """The result in plain data, as the command line prints it; best is None where no grasp meets requirements."""
        atlas = self.atlas
        best, worst = (self.best, self.worst) if self.feasible.any() else (None, None)
        return {
            "problem": self.problem.name,
            "dimension": self.dimension,
            "radius": atlas.radius,
            "epsilon": atlas.epsilon,
            "length_scale": self.problem.length_scale,
            "torque_length": self.problem.torque_arm,
            "status": str(self.status),
            "is_global": self.is_global,
            "doubts": list(atlas.doubts),
            "audit": {
                "points": atlas.audit.points,
                "holes": atlas.audit.holes,
                "share_missing": atlas.audit.share_missing(),
                "confidence": 0.95,
            },
            "n_charts": atlas.n_charts,
            "seconds": {"atlas": atlas.seconds, "audit": atlas.audit.seconds, "quality": self.quality_seconds},
            "max_residual": float(atlas.residuals.max()),
            "quality": {
                "name": quality_name(self.quality),
                "best": best and best.quality,
                "worst": worst and worst.quality,
                "at_x1": float(self.qualities[0]),
            },
            "best": best
            and {
                "q": best.q.tolist(),
                "object_xyz": best.object_xyz.tolist(),
                "object_quat_xyzw": best.object_quat_xyzw.tolist(),
                "chart": best.chart,
            },
            **({"others": self._summary_of_others(best)} if self.others else {}),
            **({"refined": self._summary_of_refinement()} if self.refinement else {}),
        }

    def _summary_of_others(self, best: Grasp | None) -> dict[str, Any]:
        """The other indices: at the best grasp, and over all grasps that meet the requirements."""
        out = {}
        for name, values in self.others.items():
            left = values[self.feasible]
            at_best = float(values[best.chart]) if best else None
            out[name] = {"at_best": at_best, **({"largest": float(left.max())} if len(left) else {})}
        return out

    def _summary_of_refinement(self) -> dict[str, Any]:
        best, refinement = self.refined_best, self.refinement
        assert refinement is not None
        return {
            "quality": best.quality,
            "gain": None if refinement.unbounded[0] else self.gain,
            "status": str(refinement.statuses[0]),
            "converged": bool(refinement.converged[0]),
            "steps": int(refinement.steps[0]),
            "n_peaks": refinement.n_peaks,
            "n_unbounded": int(refinement.unbounded.sum()),
            "advice": refinement.advice,
            "all_motions": refinement.all_motions,
            "complete": refinement.complete,
            "q": best.q.tolist(),
            "object_xyz": best.object_xyz.tolist(),
            "object_quat_xyzw": best.object_quat_xyzw.tolist(),
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result to one file, which :func:`load_result` reads; an existing file is replaced at once or not.

        Args:
            path: Such as ``"can.npz"``.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        save_result(self, path)


def load_result(path: str | os.PathLike[str]) -> Result:
    """Read a result that :meth:`Result.save` wrote. Nothing in the file is executed.

    Args:
        path: The file, or a folder that holds ``result.npz``.

    Raises:
        GraspAtlasError: If the file is missing, damaged, or of another version.
    """
    return Result(**read_result(path))
