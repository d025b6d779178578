"""Verification of a result from the problem that it carries; every check could fail."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from graspatlas.atlas.coverage import measure_coverage
from graspatlas.atlas.verification import RESIDUAL_TOLERANCE, Check, CheckReport, atlas_checks
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.requirements.base import requirement_name
from graspatlas.requirements.lost import kept
from graspatlas.requirements.screening import screen
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.result.refinement import Refinement
from graspatlas.support.arrays import Array

__all__ = ["check_result"]


#: How far a point of the manifold may lie from the nearest polytope, as a share of the chart radius.
COVERAGE_TOLERANCE = 0.5
#: Largest residual of the optimality conditions of a grasp that is called a maximum.
KKT_TOLERANCE = 1e-6


def check_result(result: GraspAtlas) -> CheckReport:
    """Verify a result from the problem that it carries.

    Beside :func:`check_atlas`: the frozen hand motions of eq (13), opposite normals, a closed atlas, the qualities
    (when the index has a name) and the choice of the best.

    Args:
        result: The result.

    Returns:
        What was measured.
    """
    return CheckReport(tuple(_result_checks(result)))


def _result_checks(result: GraspAtlas) -> Iterator[Check]:
    problem, atlas = result.problem, result.atlas
    system = problem.system(result.dimension)
    yield from atlas_checks(atlas, system)
    if atlas.complete:
        coverage = measure_coverage(atlas, system)
        claim = f"of {coverage.points} points found without the atlas, the farthest from a chart by, in radii"
        yield Check(claim, coverage.farthest, COVERAGE_TOLERANCE)
    frozen = problem.frozen_residual(atlas.centers, result.dimension)
    yield Check(
        "frozen hand motions, eq (13), are off by",
        float(np.abs(frozen).max(initial=0.0)),
        RESIDUAL_TOLERANCE,
    )
    yield from _mimic_checks(problem, atlas.centers, "joints that mimic others are off by [rad or m]")
    start = float(np.abs(system.difference(problem.x1_array, atlas.centers[0])).max())
    yield Check("the first chart is off x1 by [rad or length_scale]", start, 1.0)
    grasps = Grasps(problem, atlas.centers, system)
    arrays = system.grasp_arrays(grasps.x)
    cosines = np.einsum("nmc,nmc->nm", arrays["hand_normals"], arrays["object_normals"])
    yield Check("cosine between the normals of hand and object", float(cosines.max()), -1.0 + 1e-9)
    for reason in ("curvature", "not_converged"):
        yield Check(
            f"vertices closed for {reason.replace('_', ' ')}",
            float(atlas.closed_vertices[reason]),
            0.0,
        )
    if result.quality in INDICES:
        again = evaluate(result.quality, grasps)
        scale = np.maximum(np.abs(again), 1e-12)
        error = float((np.abs(again - result.qualities) / scale).max())
        yield Check("qualities differ from a new evaluation by, relatively", error, 1e-6)
    if result.accepted.any():
        top, chosen = float(result.qualities[result.accepted].max()), result.best.quality
        gap = 0.0 if top == chosen else top - chosen
        yield Check("a chart that meets the requirements is better than the best grasp by", gap, 0.0)
        winner = Grasps(problem, result.best.x, system)
        for requirement in kept(result.requirements):
            met, _ = screen([requirement], winner)
            yield Check(f"the best grasp fails requirement {requirement_name(requirement)}", float(not met[0]), 0.0)
    if result.refinement is not None:
        yield from _refinement_checks(result, result.refinement)


def _mimic_checks(problem: Problem, X: Array, claim: str) -> Iterator[Check]:
    """The joints that mimic others are where those drive them, from the tags of the URDF and the joint positions."""
    if problem.hand.mechanism.mimics:
        yield Check(claim, float(np.abs(problem.mimic_residual(X)).max(initial=0.0)), RESIDUAL_TOLERANCE)


def _refinement_checks(result: GraspAtlas, refinement: Refinement) -> Iterator[Check]:
    """The local maxima are grasps of the system, meet the requirements, and none is worse than its chart."""
    problem = result.problem
    dimension = problem.largest_dimension if refinement.all_motions else result.dimension
    system = problem.system(dimension)
    residuals = [np.abs(system.evaluate_residual(x)).max(initial=0.0) for x in refinement.x]
    yield Check("largest residual of a refined grasp", float(np.max(residuals)), RESIDUAL_TOLERANCE)
    slacks = [system.slack(x).min(initial=np.inf) for x in refinement.x]
    yield Check("farthest that a refined grasp lies outside its bounds", float(-np.min(slacks)), RESIDUAL_TOLERANCE)
    if problem.frozen_motions(dimension) > 0:
        frozen = float(np.abs(problem.frozen_residual(refinement.x, dimension)).max(initial=0.0))
        yield Check("frozen hand motions of the refined grasps are off by", frozen, RESIDUAL_TOLERANCE)
    claim = "joints that mimic others are off in the refined grasps by [rad or m]"
    yield from _mimic_checks(problem, refinement.x, claim)
    grasps = Grasps(problem, refinement.x, system)
    if result.quality in INDICES:
        again = evaluate(result.quality, grasps)
        with np.errstate(invalid="ignore"):
            error = np.abs(again - refinement.qualities) / np.maximum(np.abs(again), 1e-12)
        error[again == refinement.qualities] = 0.0  # both may be infinite
        yield Check("refined qualities differ from a new evaluation by, relatively", float(error.max()), 1e-6)
    if result.accepted.any():
        best, top = result.best.quality, float(refinement.qualities.max())
        loss = 0.0 if best == top else best - top
        yield Check("the refined best is worse than the best chart by", loss, 0.0)
    largest = float(np.nan_to_num(refinement.kkt[refinement.converged]).max(initial=0.0))
    yield Check("largest residual of the optimality conditions at a maximum", largest, KKT_TOLERANCE)
    met, _ = screen(kept(result.requirements), grasps)
    yield Check("refined grasps that fail a requirement", float((~met).sum()), 0.0)
