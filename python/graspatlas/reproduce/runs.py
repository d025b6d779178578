"""One run: an atlas with its quality, and its numbers beside the paper's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from graspatlas.analysis.peaks import local_maxima
from graspatlas.atlas.status import Status
from graspatlas.optimizer.optimize import optimize
from graspatlas.problems import load_problem
from graspatlas.reproduce.published import PUBLISHED, WHY, Published
from graspatlas.reproduce.report import Number
from graspatlas.result.result import Result
from graspatlas.viewer.figures.indices import SINGULAR_BELOW, with_index

__all__ = ["Setting", "numbers_of", "run"]


@dataclass(frozen=True)
class Setting:
    """How an experiment is run here.

    Attributes:
        problem: Name of the bundled problem.
        dimension: k.
        radius: r [rad, or length scales].
        epsilon: epsilon.
        quality: The index.
    """

    problem: str
    dimension: int
    radius: float
    epsilon: float
    quality: str


def run(setting: Setting) -> Result:
    """Trace the atlas and evaluate the index: lengths in millimetres, in length scales where the problem is planar.

    As in the paper, no grasp is ruled out: requirements that the problem's file states are left aside.

    Raises:
        KeyboardInterrupt: If it was interrupted: an atlas cut short is none to report.
    """
    result = optimize(
        load_problem(setting.problem),
        dimension=setting.dimension,
        radius=setting.radius,
        epsilon=setting.epsilon,
        quality=setting.quality,
        require=[],
        progress=False,
    )
    if result.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return with_index(result, setting.quality) if result.problem.object_joint_model.planar else result


def numbers_of(result: Result, setting: Setting, label: str = "") -> list[Number]:
    """The numbers of a run beside the paper's.

    Args:
        result: What :func:`run` returned.
        setting: How it was run.
        label: Name of the run, when its experiment has several.
    """
    paper = PUBLISHED[setting.problem, setting.dimension]
    rows = [*_sizes(result, setting, paper), *_times(result, paper), *_qualities(result, setting)]
    return [replace(row, run=label) for row in rows]


def _sizes(result: Result, setting: Setting, paper: Published) -> Iterator[Number]:
    problem, k = result.problem, setting.dimension
    full = problem.full_system
    planar = problem.object_joint_model.planar
    yield Number("", "variables of F", paper.variables, full.tangent_size, "", WHY["variables"])
    yield Number("", "equations of F", paper.equations, full.n_equations, "", WHY["equations"])
    yield Number("", "dimension t of feasible grasps", paper.full_dimension, problem.full_dimension)
    s = problem.frozen_motions(k)
    yield Number("", "frozen hand motions s", paper.frozen_motions, s)
    if problem.motions is not None:
        kept = 100.0 * problem.motions.variance_kept(s)
        yield Number(
            "", "variance of the hand motions that is kept", paper.kept, kept, "%", WHY["kept"] if paper.kept else ""
        )
    yield Number("", "dimension k of relevant grasps", paper.dimension, result.dimension)
    same = paper.radius == setting.radius
    yield Number("", "radius r of a chart", paper.radius, setting.radius, "", "" if same else WHY["radius"])
    yield Number("", "epsilon", paper.epsilon, setting.epsilon)
    yield Number(
        "", "charts", paper.charts, result.atlas.n_charts, "", WHY["charts of the planar hand" if planar else "charts"]
    )
    yield Number("", "atlas", None, str(result.status))


def _times(result: Result, paper: Published) -> Iterator[Number]:
    atlas, index = result.atlas.seconds, result.quality_seconds
    if paper.total_seconds is not None:
        yield Number("", "time for atlas and index", paper.total_seconds, atlas + index, "s", WHY["atlas time"])
    yield Number(
        "", "time for the atlas", paper.atlas_seconds, atlas, "s", WHY["atlas time"] if paper.atlas_seconds else ""
    )
    yield Number(
        "", "time for the index", paper.index_seconds, index, "s", WHY["index time"] if paper.index_seconds else ""
    )


def _qualities(result: Result, setting: Setting) -> Iterator[Number]:
    scaled = with_index(result, setting.quality)
    index = setting.quality.replace("_", " ")
    n_singular = int((scaled.qualities < SINGULAR_BELOW[setting.quality]).sum())
    unit = f"{1e3 * result.problem.length_scale:g} mm" if result.problem.object_joint_model.planar else "mm"
    yield Number("", f"best {index}, lengths in {unit}", None, result.best.quality)
    yield Number("", f"worst {index}, lengths in {unit}", None, result.worst.quality)
    yield Number("", "index at the first grasp", None, float(result.qualities[0]))
    yield Number(
        "", f"singular charts (below {SINGULAR_BELOW[setting.quality]:g}, lengths in length scales)", None, n_singular
    )
    yield Number("", "local maxima on the graph of charts", None, len(local_maxima(result)))
    yield Number("", "largest residual of a chart centre", None, float(result.atlas.residuals.max()))
