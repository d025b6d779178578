"""What was found, and nothing that is made of it: problem, atlas, values of the index, accepted grasps, the best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Self

from graspatlas import _core
from graspatlas.atlas.atlas import Atlas
from graspatlas.atlas.status import Status
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.quality.evaluation import evaluate
from graspatlas.requirements.base import RequirementLike
from graspatlas.requirements.reachable import Reachable
from graspatlas.requirements.rejections import Rejection, nearest, rejections
from graspatlas.requirements.screening import screen
from graspatlas.result.gap import Gap, estimate_gap
from graspatlas.result.refinement import Refinement
from graspatlas.support.arrays import Array, BoolArray, IndexArray
from graspatlas.support.notebooks import Displayed
from graspatlas.support.pickling import Light
from graspatlas.support.renamed import renamed_attribute
from graspatlas.support.validation import read_only, shown

__all__ = ["GraspAtlas", "check_is_result", "grasp_system"]


def grasp_system(atlas: Atlas) -> _core.GraspSystem:
    """System R(x) = 0 of an atlas of grasps.

    Raises:
        GraspAtlasError: If the atlas is one of anything else.
    """
    system = atlas.system
    if not isinstance(system, _core.GraspSystem):
        raise GraspAtlasError(f"the atlas must be one of grasps, got one of a {type(system).__name__}")
    return system


def check_is_result(value: object) -> None:
    """Make sure that a value is a result.

    Raises:
        GraspAtlasError: If it is anything else.
    """
    if not isinstance(value, GraspAtlas):
        raise GraspAtlasError(f"result must be a graspatlas.Result, got {shown(value)}; see graspatlas.optimize")


@dataclass(frozen=True, eq=False)
class GraspAtlas(Light, Displayed):
    """The best grasp, and everything it was chosen from; :class:`graspatlas.Result` adds what is made of it.

    Its arrays cannot be written to: copy what you want to change.

    Attributes:
        problem: The problem.
        atlas: Atlas of the relevant grasps.
        quality: The index: its name, or the callable.
        qualities: Its value at each chart centre [n].
        quality_seconds: Time that its evaluation and that of the requirements took.
        requirements: What a grasp must meet to be the best or the worst; a ``Lost`` one where a file
            did not keep a function.
        accepted: Which charts meet the requirements [n].
        rejected: How many charts each requirement rejected, of those that the ones before it had left.
        others: Values of the other indices that were asked for, by name, [n] each.
        refinement: Local maxima between the charts' centres, when they were asked for.
    """

    problem: Problem
    atlas: Atlas
    quality: Quality
    qualities: Array
    quality_seconds: float
    requirements: tuple[RequirementLike, ...]
    accepted: BoolArray
    rejected: Mapping[str, int]
    others: Mapping[str, Array] = field(default_factory=dict)
    refinement: Refinement | None = None

    def __repr__(self) -> str:
        atlas = f"{self.atlas.n_charts} charts, k = {self.dimension}, {self.status}"
        best = f"{self.qualities[self.accepted].max():.6g}" if self.accepted.any() else "none, all rejected"
        if self.refinement:
            best = f"{self.refined_best.quality:.6g}, refined"
        return f"<{type(self).__name__} of {self.problem.name!r}: {atlas}; best {quality_name(self.quality)} {best}>"

    def __post_init__(self) -> None:
        object.__setattr__(self, "qualities", read_only(self.qualities))
        object.__setattr__(self, "accepted", read_only(self.accepted))
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
    def system(self) -> _core.GraspSystem:
        """System R(x) = 0 of the relevant grasps.

        Raises:
            GraspAtlasError: If the atlas is not one of grasps.
        """
        return grasp_system(self.atlas)

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

    @cached_property
    def nearest(self) -> Grasp | None:
        """Where no chart meets the requirements, the grasp that comes nearest to it; None where one does.

        It is the grasp that the fewest requirements reject, and of those the one with the least shortfall: see
        :mod:`graspatlas.requirements.rejections`, and :meth:`rejections` for what it lacks.
        """
        if self.accepted.any():
            return None
        grasps = Grasps(self.problem, self.atlas.centers, self.system)
        return self.grasp(nearest(self.requirements, grasps, self.qualities))

    def rejections(self, chart: int) -> tuple[Rejection, ...]:
        """Which requirements reject the grasp of a chart, by how much, which shapes collide; none if it is accepted.

        Raises:
            GraspAtlasError: If there is no such chart.
        """
        if self.accepted[self.checked_chart(chart)]:
            return ()
        return rejections(self.requirements, Grasps(self.problem, self.atlas.centers[chart], self.system))

    def candidates(self) -> IndexArray:
        """Charts that meet the requirements, ascending; at least one.

        Raises:
            GraspAtlasError: If no grasp meets them.
        """
        if not self.accepted.any():
            counts = ", ".join(f"{name} rejected {count}" for name, count in self.rejected.items())
            raise GraspAtlasError(
                f"none of {self.atlas.n_charts} grasps meets the requirements ({counts}): relax a requirement; "
                "result.nearest is the grasp that comes nearest, and result.rejections says what it lacks"
            )
        return np.flatnonzero(self.accepted)

    def accepted_charts(self) -> IndexArray:
        """Charts that meet the requirements, ascending; none where the refined best alone does.

        Raises:
            GraspAtlasError: If no grasp meets them.
        """
        return np.zeros(0, np.intp) if self.refinement and not self.accepted.any() else self.candidates()

    @cached_property
    def refined_best(self) -> Grasp:
        """The best grasp, no longer bound to the centre of a chart; its chart is the one the climb to it began from.

        It is the highest place at which a climb ended. Whether that is a maximum says ``refinement.statuses[0]``.

        Raises:
            GraspAtlasError: If no refinement was asked for.
        """
        if self.refinement is None:
            raise GraspAtlasError("this result was not refined: give optimize refine=True")
        system = self.problem.full_system if self.refinement.all_motions else self.system
        one = Grasps(self.problem, self.refinement.x[0], system)[0]
        quality, chart = float(self.refinement.qualities[0]), int(self.refinement.starts[0])
        return replace(one, quality=quality, chart=chart)

    @property
    def gain(self) -> float:
        """By how much the refined best is better than the best chart, as a share of the latter's quality.

        Infinite where no chart meets the requirements.
        """
        if not self.accepted.any():
            return float("inf")
        return (self.refined_best.quality - self.best.quality) / max(abs(self.best.quality), 1e-300)

    @cached_property
    def gap(self) -> Gap:
        """Which charts could still hold a grasp better than the refined best, or than the best chart: an estimate.

        It is estimated from the index at neighbouring charts, and not proved. Where the refinement ran after an index
        that grows without bound there is no best to compare with, and the best chart stands in for it.

        Raises:
            GraspAtlasError: If no grasp meets the requirements.
        """
        refined = self.refinement is not None and not self.refinement.unbounded[0]
        best = self.refined_best if refined else self.best
        return estimate_gap(self.atlas, self.qualities, self.accepted, best.quality)

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
        return evaluate(quality, Grasps(self.problem, self.atlas.centers, self.system, charts))

    def by(self, quality: Quality) -> Self:
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

    @cached_property
    def reachable(self) -> BoolArray:
        """Which charts the problem's arm can bring about, whatever else is required of them [n].

        The clearance is that of the requirement ``reachable``, 0 where that is not required. False says that no posture
        of the arm was found, which is no proof that there is none; see :class:`graspatlas.Reachable`.

        Raises:
            GraspAtlasError: If the problem has no arm, or something has no collision shape.
        """
        required = next((r for r in self.requirements if isinstance(r, Reachable)), Reachable())
        return read_only(required.met(Grasps(self.problem, self.atlas.centers, self.system)))

    def meets(self, X: ArrayLike) -> BoolArray:
        """Which configurations meet the requirements [n].

        Args:
            X: Configurations [n, configuration_size].

        Raises:
            GraspAtlasError: If a requirement was a function, which files do not keep.
        """
        return screen(self.requirements, Grasps(self.problem, X))[0]

    feasible = renamed_attribute("feasible", "accepted")
    refused = renamed_attribute("refused", "rejected")
