"""What the summary of a result holds; docs/results.md says what its entries mean."""

from __future__ import annotations

from typing import Any, TypedDict

from typing_extensions import NotRequired

__all__ = [
    "ArmSummary",
    "AuditSummary",
    "GapSummary",
    "GraspSummary",
    "NearestSummary",
    "OtherSummary",
    "QualitySummary",
    "RefinementSummary",
    "RejectionSummary",
    "ResultSummary",
    "SecondsSummary",
]


class AuditSummary(TypedDict):
    """The audit of the atlas."""

    points: int
    holes: int
    share_missing: float
    confidence: float


class SecondsSummary(TypedDict):
    """How long the parts took [s]."""

    atlas: float
    audit: float
    quality: float


class QualitySummary(TypedDict):
    """The index; None where no grasp meets the requirements."""

    name: str
    best: float | None
    worst: float | None
    at_x1: float


class GapSummary(TypedDict):
    """The charts that could hold a better grasp, estimated; no share of a best that is 0."""

    kind: str
    n_charts: int
    n_rejected: int
    n_unknown: int
    best: float
    bound: float
    share: float | None


class GraspSummary(TypedDict):
    """A chart's grasp."""

    q: list[float]
    object_xyz: list[float]
    object_quat_xyzw: list[float]
    chart: int


class RejectionSummary(TypedDict):
    """What a requirement has against a grasp; the shortfall is None where it cannot be measured."""

    requirement: str
    shortfall: float | None
    why: str


class NearestSummary(TypedDict):
    """The grasp that comes nearest to being accepted where none is."""

    chart: int
    rejected_by: list[RejectionSummary]


class ArmSummary(TypedDict):
    """For how many charts a posture of the arm was found, of those that meet the other requirements.

    And its posture at the best grasp, the refined one where there is one; None where there is no best, or the
    arm's meshes are not there.
    """

    name: str
    reachable: int
    of: int
    best: dict[str, float] | None


class OtherSummary(TypedDict):
    """Another index at the best grasp, and its largest value over the grasps that meet the requirements."""

    at_best: float | None
    largest: NotRequired[float]


class PeakSummary(TypedDict):
    """A place at which climbs ended; kkt is None where it is not known."""

    quality: float
    status: str
    hits: int
    kkt: float | None


class RefinementSummary(TypedDict):
    """The best of the refined maxima; no gain where the index grows without bound, or no chart is accepted."""

    quality: float
    gain: float | None
    status: str
    converged: bool
    steps: int
    kkt: float | None
    starts: int
    share_missing: float | None
    peaks: list[PeakSummary]
    search: NotRequired[dict[str, Any]]
    n_peaks: int
    n_unbounded: int
    advice: str
    all_motions: bool
    complete: bool
    q: list[float]
    object_xyz: list[float]
    object_quat_xyzw: list[float]


class ResultSummary(TypedDict):
    """A result in plain data; best is None where no grasp meets the requirements, and then the gap is, too.

    The gap is also None where the index grows without bound, so that there is no best.
    """

    problem: str
    dimension: int
    radius: float
    epsilon: float
    length_scale: float
    torque_length: float
    status: str
    is_global: bool
    doubts: list[str]
    audit: AuditSummary
    n_charts: int
    seconds: SecondsSummary
    max_residual: float
    quality: QualitySummary
    best: GraspSummary | None
    gap: GapSummary | None
    nearest: NotRequired[NearestSummary]
    others: NotRequired[dict[str, OtherSummary]]
    arm: NotRequired[ArmSummary]
    refined: NotRequired[RefinementSummary]
