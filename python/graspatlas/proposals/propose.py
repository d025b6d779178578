"""From a hand and a mesh to grasps: the regions of the mesh, the fingertips of the hand, and which touches which."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from graspatlas.collision.always_touching import with_touching_links_allowed
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.named_hands import NamedHand, named_hand
from graspatlas.meshes.repair import repaired
from graspatlas.proposals.files import folder_name, problem_file, write_text
from graspatlas.proposals.fingers import grips
from graspatlas.proposals.kept_looks import KeptLooks
from graspatlas.proposals.matching import Assignment, Counts, assignments_of
from graspatlas.proposals.object_files import write_object
from graspatlas.proposals.outcome import Proposal, Proposals, ProposalsEnd, Tried
from graspatlas.proposals.plan import Plan
from graspatlas.proposals.symmetry import region_symmetries
from graspatlas.proposals.trial import Look, LookEnd, atlas_of, look_at
from graspatlas.quality.batched import Quality
from graspatlas.quality.evaluation import find_index
from graspatlas.regions.find import find_regions
from graspatlas.requirements.base import RequirementLike
from graspatlas.requirements.collision_free import CollisionFree
from graspatlas.requirements.force_closure import ForceClosure
from graspatlas.requirements.screening import check_requirements
from graspatlas.result.result import Result
from graspatlas.storage.files import writable_folder
from graspatlas.support.deadlines import deadline_after, seconds_until
from graspatlas.support.interrupts import stoppable, stopping
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import whole

__all__ = ["propose"]

#: Time for all of it, and the share of it that first looks may take.
MAX_SECONDS, LOOKING = 90.0, 0.5
#: Grasps that are proposed.
TOP = 5
#: What is required where nothing is said.
REQUIREMENTS = (ForceClosure(0.5, 0.02), CollisionFree())
#: Time that an atlas is given where none is left [s].
SHORTEST = 1.0


@stoppable()
def propose(
    hand: str,
    mesh: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    scale: float | None = None,
    fingers: int | None = None,
    links: Sequence[str] | None = None,
    quality: Quality = "holding_force",
    require: Sequence[RequirementLike] = REQUIREMENTS,
    top: int = TOP,
    max_seconds: float | None = MAX_SECONDS,
    seed: int = 0,
    progress: bool | None = None,
) -> Proposals:
    """Propose grasps of a mesh by a hand, when nothing else is known.

    Pads are found on the hand and regions on the mesh. Assignments of fingertips to regions that no posture drawn could
    bring about, or that are the same by a symmetry of the object, are left out; the others are looked at, the most
    promising first; and the best of them each get an atlas, and its best grasp climbs on in all motions of the hand.
    Ctrl-C ends it and returns what there is; called again with the same arguments, it goes on from there.

    Args:
        hand: A URDF or an MJCF; or a name such as ``"allegro_right_hand"``.
        mesh: A mesh file.
        output: Folder to write to: ``proposals.csv``, and for each proposal a folder with ``problem.yaml`` and
            ``result.npz``.
        scale: From the mesh's unit to metres.
        fingers: How many fingertips touch; three by default, or all where the hand has fewer.
        links: Links that may touch; the fingertips by default.
        quality: The index that ranks the grasps.
        require: What they must meet; force closure at friction 0.5 and no collision by default.
        top: How many grasps to propose at most.
        max_seconds: Time for all of it; None for as long as it takes.
        seed: Of the random numbers.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The proposals, the best first.

    Raises:
        GraspAtlasError: If hand or mesh cannot be read, nothing can be held by this hand, or an argument makes no sense.
    """
    start = time.perf_counter()
    deadline = deadline_after(max_seconds)
    whole(top, "top")
    find_index(quality)
    check_requirements(require)
    folder = writable_folder(output)
    setting = _setting(named_hand(hand), Path(mesh), scale, folder, fingers, links, seed)
    plan = Plan(setting.source, setting.body, quality, tuple(require), seed=seed)
    kept = KeptLooks(folder / "looks", plan, setting.assignments)
    looks, end = _looks(plan, setting.assignments, kept, start, deadline, progress)
    tried = tuple(_tried(each, look) for each, look in zip(setting.assignments, looks, strict=False))
    met = [i for i, look in enumerate(looks) if look.end is LookEnd.MET]
    best = sorted(met, key=lambda i: -looks[i].value)[:top]
    proposals: list[Proposal] = []
    with progress_bar("atlases", total=len(best), progress=progress) as bar:
        for number, i in enumerate(best):
            if stopping() or (time.perf_counter() > deadline and proposals):
                end = ProposalsEnd.INTERRUPTED if stopping() else ProposalsEnd.TIME_LIMIT
                break
            left = seconds_until(deadline, SHORTEST)
            share = None if left is None else max(left / (len(best) - number), SHORTEST)
            try:
                result = atlas_of(plan, setting.assignments[i], looks[i], share)
            except GraspAtlasError:
                continue  # where it is singular; the look stays in the table
            if result.accepted.any() or result.refinement:
                proposals.append(Proposal(tried[i], result, folder))
            bar.update()
    proposals.sort(key=lambda each: -each.quality)
    written = tuple(_written(plan, setting, proposal, rank, folder) for rank, proposal in enumerate(proposals, start=1))
    found = Proposals(written, tried, setting.counts, end, time.perf_counter() - start, setting.notes)
    found.save_table(folder / "proposals.csv")
    return found


@dataclass(frozen=True, eq=False)
class _Setting:
    """Hand and object made ready, and the assignments."""

    source: dict[str, str]
    body: Body
    assignments: list[Assignment]
    counts: Counts
    notes: tuple[str, ...] = field(default=())


def _setting(
    named: NamedHand,
    mesh: Path,
    scale: float | None,
    folder: Path,
    fingers: int | None,
    links: Sequence[str] | None,
    seed: int,
) -> _Setting:
    """Read hand and mesh, write the object, and find the assignments.

    Raises:
        GraspAtlasError: If they cannot be read, or no posture could hold the object.
    """
    hand, touching = with_touching_links_allowed(named.hand)
    notes = []
    if touching:
        pairs = ", ".join(f"{a} and {b}" for a, b in touching)
        notes.append(f"links of the hand that touch in all postures are let: {pairs}; an SRDF would say which may")
    if hand.srdf:
        write_text(hand.srdf, folder / "hand.srdf")
    fixed, report = repaired(mesh, scale=1.0 if scale is None else scale)
    if scale is None and report.unit_doubt():
        raise GraspAtlasError(report.unit_doubt())
    regions = find_regions(fixed, scale=1.0)
    body, note = write_object(fixed, mesh.stem, folder)
    notes.append(note)
    assignments, counts = assignments_of(
        grips(hand, fingers, links), regions, region_symmetries(regions), np.random.default_rng(seed)
    )
    if not assignments:
        raise GraspAtlasError(
            f"no posture of hand '{hand.name}' could hold '{mesh.name}' by its fingertips ({counts}): look whether its "
            "size fits the hand, or name other links, such as the palm"
        )
    return _Setting(dict(named.source), body, assignments, counts, tuple(notes))


def _looks(
    plan: Plan,
    assignments: Sequence[Assignment],
    kept: KeptLooks,
    start: float,
    deadline: float,
    progress: bool | None,
) -> tuple[list[Look], ProposalsEnd]:
    """Looks at the assignments in their order, as far as time goes."""
    until = deadline if deadline == float("inf") else start + LOOKING * (deadline - start)
    looks: list[Look] = []
    with progress_bar("assignments", total=len(assignments), progress=progress) as bar:
        for number, assignment in enumerate(assignments):
            if stopping():
                return looks, ProposalsEnd.INTERRUPTED
            if time.perf_counter() > until and any(look.end is LookEnd.MET for look in looks):
                return looks, ProposalsEnd.TIME_LIMIT
            if time.perf_counter() > deadline:
                return looks, ProposalsEnd.TIME_LIMIT
            try:
                looks.append(kept.look(number) or kept.keep(number, look_at(plan, assignment)))
            except KeyboardInterrupt:
                return looks, ProposalsEnd.INTERRUPTED
            bar.update()
    return looks, ProposalsEnd.COMPLETE


def _tried(assignment: Assignment, look: Look) -> Tried:
    return Tried(
        links=tuple(pad.frame for pad in assignment.fingers.grip.pads),
        regions=tuple(region.name for region in assignment.regions),
        score=assignment.score,
        end=look.end,
        value=look.value,
        why=look.why,
    )


def _written(plan: Plan, setting: _Setting, proposal: Proposal, rank: int, folder: Path) -> Proposal:
    """The proposal with its files in a folder of its own."""
    place = writable_folder(folder / folder_name(rank, proposal.tried.name))
    result: Result = proposal.result
    locked = next(
        each.fingers.grip.locked
        for each in setting.assignments
        if tuple(pad.frame for pad in each.fingers.grip.pads) == proposal.tried.links
    )
    write_text(problem_file(plan, result.problem, locked, ".."), place / "problem.yaml")
    result.save(place / "result.npz")
    return replace(proposal, folder=place)
