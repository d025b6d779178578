"""What `optimize` returns: grasps, atlas and qualities, able to verify themselves."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from graspatlas.atlas.verification import CheckReport
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.columns import grasp_columns, parameter_columns
from graspatlas.grasps.grasp import Grasp
from graspatlas.grasps.grasps import Grasps
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.reachable import Reachable
from graspatlas.result.exports import Choice, save_grasps
from graspatlas.result.files import read_result, save_result
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.result.summary import (
    ArmSummary,
    GapSummary,
    GraspSummary,
    NearestSummary,
    OtherSummary,
    PeakSummary,
    RefinementSummary,
    ResultSummary,
)
from graspatlas.result.verification import check_result
from graspatlas.storage.columns import joined, to_frame
from graspatlas.support.notebooks import EmbeddedPage, explorer_of
from graspatlas.support.renamed import renamed_keyword

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["Result", "load_result"]

#: Places at which climbs ended that a summary lists, the best first.
MOST_PEAKS = 20


@dataclass(frozen=True, eq=False, repr=False)
class Result(GraspAtlas):
    """What :func:`graspatlas.optimize` returns: the best grasp, everything it was chosen from, and what is made of it.

    Its arrays cannot be written to: copy what you want to change.
    """

    @renamed_keyword("feasible", "accepted")
    def save_grasps(
        self,
        path: str | os.PathLike[str],
        *,
        charts: Sequence[int] | None = None,
        best: int | None = None,
        accepted: bool = False,
        refined: bool = False,
        pregrasp: float | None = None,
    ) -> int:
        """Write grasps for other programs: joints by name, poses of palm and object, contacts, values of the indices.

        All charts in their order by default. The fields and columns are listed in docs/results.md. Lengths are in
        metres, angles in radians, quaternions x y z w; numbers have all digits.

        Args:
            path: Ends in ``.json``, one object with the names of frames and units, or ``.csv``, one row a grasp; an
                existing file is replaced at once or not.
            charts: Only these, in this order.
            best: Only so many, the best that meet the requirements, the best first.
            accepted: Only those that meet the requirements.
            refined: Put the refined best before the others.
            pregrasp: Add the joint positions at which all contact points are off the object by this distance [m], as
                :meth:`graspatlas.Grasp.pregrasp` finds them, and whether they were reached.

        Returns:
            How many grasps were written.

        Raises:
            GraspAtlasError: If the file has another ending or cannot be written, there is no such chart, no grasp meets
                the requirements where some must, `refined` was asked for and the result was not refined, or the
                pregrasp's distance makes no sense.
        """
        choice: Choice = {"charts": charts, "best": best, "accepted": accepted, "refined": refined}
        return save_grasps(self, path, pregrasp, **choice)

    def to_pandas(self, *, volumes: bool = False) -> DataFrame:
        """The atlas as a table, one row a chart: indices, joints, poses and what :meth:`Atlas.to_pandas` tells.

        Joints stand by their names [rad or m], the free patch parameters as ``contact0_hand_u`` and so on.

        Args:
            volumes: Add the volume of each chart's polytope; slow in high dimensions.

        Raises:
            GraspAtlasError: If pandas is not installed, or two columns have one name.
        """
        grasps = Grasps(self.problem, self.atlas.centers)
        return to_frame(
            joined(
                {"accepted": self.accepted},
                {quality_name(self.quality): self.qualities, **self.others},
                grasp_columns(grasps),
                parameter_columns(grasps),
                self.atlas.chart_columns(volumes),
            )
        )

    def explore(self, chart: int | None = None, *, height: int = 640) -> EmbeddedPage:
        """The page of the whole atlas, with the hand beside it, in a notebook: as the output of a cell that ends in it.

        It is the page that :func:`graspatlas.export_html` writes, within a notebook.

        Args:
            chart: The chart at which it opens; by default the best grasp, the worst beside it.
            height: Its height [pixels], 200 to 4000.

        Raises:
            GraspAtlasError: If a mesh cannot be read, or there is no such chart.
        """
        return explorer_of(self, chart, height)

    def check(self) -> CheckReport:
        """Verify every chart again, from the problem alone; see :func:`graspatlas.result.verification.check_result`."""
        return check_result(self)

    def summary(self) -> ResultSummary:
        """The result in plain data, as the command line prints it; best is None where no grasp meets requirements."""
        atlas = self.atlas
        best, worst = (self.best, self.worst) if self.accepted.any() else (None, None)
        summary: ResultSummary = {
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
                "best": best.quality if best else None,
                "worst": worst.quality if worst else None,
                "at_x1": float(self.qualities[0]),
            },
            "best": _summary_of_grasp(best) if best else None,
            "gap": self._summary_of_gap(),
        }
        if best is None and self.refinement is None:
            summary["nearest"] = self._summary_of_nearest()
        if self.others:
            summary["others"] = self._summary_of_others(best)
        for required in self.requirements:
            if isinstance(required, Reachable) and self.problem.arm is not None:
                summary["arm"] = self._summary_of_arm(required, self.problem.arm.name)
        if self.refinement:
            summary["refined"] = self._summary_of_refinement()
        return summary

    def _summary_of_others(self, best: Grasp | None) -> dict[str, OtherSummary]:
        """The other indices: at the best grasp, and over all grasps that meet the requirements."""
        out: dict[str, OtherSummary] = {}
        for name, values in self.others.items():
            left = values[self.accepted]
            out[name] = {"at_best": float(values[best.chart]) if best else None}
            if len(left):
                out[name]["largest"] = float(left.max())
        return out

    def _summary_of_nearest(self) -> NearestSummary:
        """The grasp that comes nearest to being accepted, and what it lacks."""
        assert self.nearest is not None
        chart = self.nearest.chart
        return {
            "chart": chart,
            "rejected_by": [
                {"requirement": rejection.requirement, "shortfall": _finite(rejection.shortfall), "why": rejection.why}
                for rejection in self.rejections(chart)
            ],
        }

    def _summary_of_arm(self, required: Reachable, name: str) -> ArmSummary:
        """What the arm can bring about, and its posture at the best grasp."""
        reachable, posture = int(self.accepted.sum()), None
        if self.refinement or reachable:
            best = self.refined_best if self.refinement else self.best
            with suppress(GraspAtlasError):  # a stored result may be read where the meshes are not
                posture = best.arm_positions(required.clearance)
        of = reachable + self.rejected.get(str(required), 0)
        return {"name": name, "reachable": reachable, "of": of, "best": posture}

    def _summary_of_gap(self) -> GapSummary | None:
        """The gap; None where there is no best to compare with."""
        runs_away = self.refinement is not None and bool(self.refinement.unbounded[0])
        if runs_away or not self.accepted.any():
            return None
        gap = self.gap
        return {
            "kind": "estimated",
            "n_charts": gap.n_charts,
            "n_rejected": gap.n_rejected,
            "n_unknown": len(gap.unknown),
            "best": gap.best,
            "bound": gap.bound,
            "share": gap.share if np.isfinite(gap.share) else None,
        }

    def _summary_of_refinement(self) -> RefinementSummary:
        best, refinement = self.refined_best, self.refinement
        assert refinement is not None
        search = refinement.search
        peaks: list[PeakSummary] = [
            {"quality": float(quality), "status": str(status), "hits": int(hits), "kkt": _finite(kkt)}
            for quality, status, hits, kkt in zip(
                refinement.qualities, refinement.statuses, refinement.hits, refinement.kkt, strict=True
            )
        ]
        summary: RefinementSummary = {
            "quality": best.quality,
            "gain": None if refinement.unbounded[0] or not self.accepted.any() else self.gain,
            "status": str(refinement.statuses[0]),
            "converged": bool(refinement.converged[0]),
            "steps": int(refinement.steps[0]),
            "kkt": _finite(refinement.kkt[0]),
            "starts": search.climbs if search else int(refinement.hits.sum()),
            "share_missing": search.share_missing if search else None,
            "peaks": peaks[:MOST_PEAKS],
            "n_peaks": refinement.n_peaks,
            "n_unbounded": int(refinement.unbounded.sum()),
            "advice": refinement.advice,
            "all_motions": refinement.all_motions,
            "complete": refinement.complete,
            "q": best.q.tolist(),
            "object_xyz": best.object_xyz.tolist(),
            "object_quat_xyzw": best.object_quat_xyzw.tolist(),
        }
        if search:
            summary["search"] = {**asdict(search), "status": str(search.status)}
        return summary

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result to one file, which :func:`load_result` reads; an existing file is replaced at once or not.

        Args:
            path: Such as ``"can.npz"``.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        save_result(self, path)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _summary_of_grasp(grasp: Grasp) -> GraspSummary:
    return {
        "q": grasp.q.tolist(),
        "object_xyz": grasp.object_xyz.tolist(),
        "object_quat_xyzw": grasp.object_quat_xyzw.tolist(),
        "chart": grasp.chart,
    }


def load_result(path: str | os.PathLike[str]) -> Result:
    """Read a result that :meth:`Result.save` wrote. Nothing in the file is executed.

    Args:
        path: The file, or a folder that holds ``result.npz``.

    Raises:
        GraspAtlasError: If the file is missing, damaged, or of another version.
    """
    return Result(**read_result(path))
