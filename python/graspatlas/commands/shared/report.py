"""What the command optimize tells of a result, line by line."""

from __future__ import annotations

from pathlib import Path

from graspatlas.atlas.status import Status
from graspatlas.optimizer.components import Components, SearchStatus
from graspatlas.quality.batched import quality_name
from graspatlas.result.refinement import Refinement, SearchEnd, SearchReport
from graspatlas.result.result import Result
from graspatlas.result.summary import ArmSummary, GapSummary
from graspatlas.support.arrays import Array

__all__ = ["component_lines", "result_lines"]


def component_lines(found: Components) -> list[str]:
    """What a search for components found."""
    lines = [
        f"{len(found)} components from {found.found} grasps found in {found.tries} tries, {found.seconds:.1f} s; the "
        f"last {found.covered} lie in these: others get at most {found.share_not_found():.1%} of the finds, with 95 % "
        "confidence"
    ]
    for number, (result, hits) in enumerate(zip(found.results, found.hits, strict=True), start=1):
        quality = f"best {result.best.quality:.6g}" if result.accepted.any() else "no grasp meets the requirements"
        lines.append(
            f"  component {number}: {result.atlas.n_charts} charts, hit {hits} times, {quality}; {result.status}"
        )
    if found.status is not SearchStatus.COVERED:
        lines.append(f"  search cut short ({found.status}): other components may exist")
    return lines


def result_lines(result: Result, folder: Path | None) -> list[str]:
    """What a result says: its atlas, its best grasp, its refinement, and why better ones may exist."""
    summary = result.summary()
    seconds = summary["seconds"]
    closed = {reason: count for reason, count in result.atlas.closed_vertices.items() if count}
    audit = result.atlas.audit
    lines = [
        f"{summary['problem']}: {summary['n_charts']} charts of dimension {summary['dimension']} in "
        f"{seconds['atlas']:.3f} s, index in {seconds['quality']:.3f} s; {summary['status']}",
        f"  largest residual {summary['max_residual']:.1e}",
    ]
    if closed:
        lines.append(f"  vertices that no step could leave: {closed}")
    if result.atlas.complete:
        lines.append(
            f"  audited at {audit.points} points of random walks, all covered: at most {audit.share_missing():.2g} of "
            f"such points are missing, with 95 % confidence"
        )
    if result.requirements:
        counts = ", ".join(f"{name} rejected {count}" for name, count in result.rejected.items())
        lines.append(f"  {result.accepted.sum()} grasps meet the requirements; checked in this order, {counts}")
    if "arm" in summary:
        lines += _arm_lines(summary["arm"])
    if result.accepted.any():
        lines += _best_lines(result)
    elif result.refinement:
        lines.append("  none of the charts meets the requirements, but grasps with other hand motions do:")
    else:
        lines += [*_nearest_lines(result), "  relax a requirement, or search among all motions: --motions all"]
    if result.refinement:
        lines += _refined_lines(result)
    if summary["gap"]:
        lines.append(_gap_line(summary["gap"], summary["n_charts"]))
    lines += [f"  better grasps may exist: {doubt}" for doubt in result.atlas.doubts]
    if folder and result.status not in (Status.COMPLETE, Status.BLOCKED):
        lines.append("  run the same command again, with a higher limit if there was one, and it goes on from here")
    if folder:
        lines.append(f"  written to {folder}; look at it with: graspatlas view {folder}")
    return lines


def _nearest_lines(result: Result) -> list[str]:
    """Where no grasp is accepted, the one that comes nearest, and what it lacks."""
    nearest = result.nearest
    assert nearest is not None
    lines = [f"  no best grasp; nearest to one is chart {nearest.chart}, rejected by"]
    return lines + [f"    {rejection}" for rejection in result.rejections(nearest.chart)]


def _gap_line(gap: GapSummary, n_charts: int) -> str:
    """How many charts could hold a better grasp, by the estimate."""
    line = f"  gap (estimated): {gap['n_charts'] or 'none'} of {n_charts} charts could hold a better grasp"
    if gap["n_charts"]:
        more = "" if gap["share"] is None else f" ({100.0 * gap['share']:+.3g} %)"
        line += f", up to {gap['bound']:.6g}{more}"
    if gap["n_rejected"]:
        line += f"; the centres of {gap['n_rejected']} of them are rejected"
    if gap["n_unknown"]:
        line += f"; too few neighbours to tell of {gap['n_unknown']} more"
    return line


def _arm_lines(arm: ArmSummary) -> list[str]:
    """What the arm can bring about, and how it stands at the best grasp."""
    share = f" ({arm['reachable'] / arm['of']:.1%})" if arm["of"] else ""
    lines = [
        f"  arm {arm['name']}: a posture was found for {arm['reachable']} of the {arm['of']} grasps that meet the "
        f"other requirements{share}; that none was found is no proof that there is none"
    ]
    if arm["best"]:
        lines.append("    its joints at the best grasp below [rad or m]:")
        lines += [f"    {joint:20} {value:9.4f}" for joint, value in arm["best"].items()]
    return lines


def _best_lines(result: Result) -> list[str]:
    best, name = result.best, quality_name(result.quality)
    values = f"best {best.quality:.6g}, worst {result.worst.quality:.6g}, first grasp {result.at_x1.quality:.6g}"
    pose = f"object at {_row(best.object_xyz)} m, quaternion xyzw {_row(best.object_quat_xyzw)}"
    angles = [f"    {joint:20} {value:9.4f}" for joint, value in best.joint_positions.items()]
    others = [f"  {name}: {values[best.chart]:.6g} at the best grasp" for name, values in result.others.items()]
    return [f"  {name}: {values}", *others, f"  best grasp (chart {best.chart}): {pose}, joints [rad or m]:", *angles]


def _refined_lines(result: Result) -> list[str]:
    refinement, best = result.refinement, result.refined_best
    assert refinement is not None
    where = "all feasible grasps" if refinement.all_motions else "the relevant grasps"
    if refinement.unbounded[0]:
        lines = _runaway_lines(refinement, where)
    else:
        peaks = f"{refinement.n_peaks} local maxima" if refinement.n_peaks > 1 else "one local maximum"
        what = f"the highest of {peaks}" if refinement.converged[0] else "not yet a maximum"
        gain = f" ({100.0 * result.gain:+.3g} %)" if result.accepted.any() else ""
        lines = [
            f"  refined best {best.quality:.9g}{gain}, {what} among {where}:",
            f"    object at {_row(best.object_xyz)} m, quaternion xyzw {_row(best.object_quat_xyzw)}, "
            "joints [rad or m]:",
            *(f"    {joint:20} {value:9.4f}" for joint, value in best.joint_positions.items()),
        ]
    if refinement.search:
        lines += _search_lines(refinement.search, float(refinement.kkt[0]))
    if refinement.advice:
        lines.append(f"    {refinement.advice}")
    if not refinement.complete and refinement.search is None:
        lines.append("    interrupted: local maxima may be missing")
    return lines


def _search_lines(search: SearchReport, kkt: float) -> list[str]:
    """What a search over all feasible grasps did, and what it can say of what it did not find."""
    lines = [
        f"    {search.best_hits} of {search.climbs} climbs ended there, {search.met} at grasps that meet the "
        f"requirements, in {search.seconds:.1f} s; residual of the optimality conditions {kkt:.1e}",
        f"    maxima not found yet get {search.share_missing:.1%} of such climbs, by expectation",
    ]
    if search.status not in (SearchEnd.ENOUGH, SearchEnd.UNBOUNDED):
        lines.append(f"    search cut short ({search.status}): better maxima may be missing")
    return lines


def _runaway_lines(refinement: Refinement, where: str) -> list[str]:
    """An index without a maximum, and the highest maximum that it has elsewhere."""
    n, runs = refinement.n_peaks, int(refinement.unbounded.sum())
    lines = [
        f"  no refined best among {where}: the index grows without bound at {runs} of the {n} places where climbs "
        f"ended, {refinement.qualities[0]:.3g} when they were stopped"
    ]
    if refinement.converged.any():
        lines.append(f"    the highest of the others: {refinement.qualities[refinement.converged][0]:.9g}")
    return lines


def _row(values: Array) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in values) + ")"
