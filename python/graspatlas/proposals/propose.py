"""From a hand and a mesh to grasps: assignments tried in the order of promise, and an atlas for each of the best."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

from graspatlas.cluster.workers import check_workers
from graspatlas.errors import GraspAtlasError
from graspatlas.hand.named_hands import named_hand
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.problem.validation import check_obstacles
from graspatlas.proposals.assignments.matching import Assignment
from graspatlas.proposals.files import folder_name, problem_file, write_text
from graspatlas.proposals.outcome import Proposal, Proposals, ProposalsEnd, Tried
from graspatlas.proposals.page import REGIONS, write_page, write_regions, write_views
from graspatlas.proposals.plan import Plan
from graspatlas.proposals.setting import made_ready
from graspatlas.proposals.trials.atlases import GROWING, Grower, GrowOnWorkers, atlases_of, best_looks, grow_here
from graspatlas.proposals.trials.kept_looks import KeptLooks
from graspatlas.proposals.trials.looks import Looker, LookOnWorkers, look_here, looks_at
from graspatlas.proposals.trials.trial import Look
from graspatlas.quality.batched import Quality
from graspatlas.quality.evaluation import find_index
from graspatlas.requirements.base import RequirementLike
from graspatlas.requirements.collision_free import CollisionFree
from graspatlas.requirements.force_closure import ForceClosure
from graspatlas.requirements.screening import check_requirements
from graspatlas.result.result import Result
from graspatlas.storage.files import writable_folder
from graspatlas.support.deadlines import deadline_after
from graspatlas.support.interrupts import stoppable
from graspatlas.support.progress import progress_bar
from graspatlas.support.validation import whole
from graspatlas.world.obstacle import Obstacle

__all__ = ["MAX_SECONDS", "PAGE", "TABLE", "TOP", "propose"]

#: Time for all of it, and the least share of it that first looks may take.
MAX_SECONDS, LOOKING = 90.0, 0.5
#: Grasps that are proposed.
TOP = 5
#: What is required where nothing is said.
REQUIREMENTS = (ForceClosure(0.5, 0.02), CollisionFree())
#: Time that the picture and the page of an atlas take, about [s].
VIEWING = 2.0
#: Files about all of it.
PAGE, TABLE = "proposals.html", "proposals.csv"
#: Files of a proposal.
PROBLEM, RESULT = "problem.yaml", "result.npz"


@stoppable()
def propose(
    hand: str | os.PathLike[str],
    mesh: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    scale: float | None = None,
    fingers: int | None = None,
    links: Sequence[str] | None = None,
    obstacles: Sequence[Obstacle] = (),
    on_table: bool = False,
    quality: Quality = "holding_force",
    require: Sequence[RequirementLike] = REQUIREMENTS,
    top: int = TOP,
    max_seconds: float | None = MAX_SECONDS,
    seed: int = 0,
    workers: int | None = None,
    scheduler: str | None = None,
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
        output: Folder to write to: ``proposals.html`` to look at, ``proposals.csv``, and for each proposal a folder
            with ``problem.yaml`` to edit, ``result.npz``, ``grasp.png`` and ``grasps.html``.
        scale: From the mesh's unit to metres.
        fingers: How many fingertips touch; three by default, or all where the hand has fewer.
        links: Links that may touch; the fingertips by default.
        obstacles: What the hand must not touch beside the object.
        on_table: The object stands on a table: a plane below its lowest point, z being upwards, is an obstacle too.
        quality: The index that ranks the grasps.
        require: What they must meet; force closure at friction 0.5 and no collision by default.
        top: How many grasps to propose at most.
        max_seconds: Time for all of it; None for as long as it takes.
        seed: Of the random numbers.
        workers: Processes on this machine for looks and atlases; this one by default.
        scheduler: Address of a Dask scheduler, whose workers do looks and atlases.
        progress: Show a progress bar on standard error; by default when it is a terminal.

    Returns:
        The proposals, the best first.

    Raises:
        GraspAtlasError: If hand or mesh cannot be read, nothing can be held by this hand, an argument makes no sense,
            or the scheduler does not answer.
    """
    start = time.perf_counter()
    deadline = deadline_after(max_seconds)
    whole(top, "top")
    find_index(quality)
    check_requirements(require)
    check_obstacles(obstacles)
    _check_requirements_see(obstacles, on_table, require)
    _check_no_arm(require)
    whole(seed, "seed", 0)
    looker: Looker = look_here
    grower: Grower = grow_here
    if workers is not None or scheduler is not None:
        check_workers("proposals on workers", workers, scheduler)
        looker, grower = LookOnWorkers(workers, scheduler), GrowOnWorkers(workers, scheduler)
    folder = writable_folder(output)
    setting = made_ready(
        named_hand(os.fspath(hand)),
        Path(mesh),
        folder,
        scale=scale,
        fingers=fingers,
        links=links,
        obstacles=tuple(obstacles),
        on_table=on_table,
        seed=seed,
    )
    plan = Plan(
        setting.hand,
        setting.source,
        setting.body,
        setting.surface,
        quality,
        tuple(require),
        seed=seed,
        obstacles=setting.obstacles,
    )
    kept = KeptLooks(folder / "looks", plan, setting.assignments)
    looked, grown = _schedule(start, deadline, top)
    with progress_bar("assignments", total=len(setting.assignments), progress=progress) as bar:
        looks, end = looks_at(plan, setting.assignments, kept, looker=looker, until=looked, deadline=deadline, bar=bar)
    tried = tuple(_tried(each, look) for each, look in zip(setting.assignments, looks, strict=False))
    results: dict[int, Result] = {}
    faults: list[str] = []
    if end is not ProposalsEnd.INTERRUPTED:
        best = best_looks(looks, top)
        with progress_bar("atlases", total=len(best), progress=progress) as bar:
            results, faults, atlases_end = atlases_of(
                plan, setting.assignments, looks, best, grower=grower, deadline=grown, bar=bar
            )
        end = end if atlases_end is ProposalsEnd.COMPLETE else atlases_end
    proposals = [
        _written(plan, setting.assignments[i], Proposal(tried[i], result, folder / folder_name(i, tried[i].name)))
        for i, result in results.items()
    ]
    proposals.sort(key=lambda each: -each.quality)
    seconds = time.perf_counter() - start
    notes = (*setting.notes, *faults)
    found = Proposals(tuple(proposals), quality, tried, setting.counts, end, seconds, notes)
    found.save_table(folder / TABLE)
    write_regions(setting.regions, folder / REGIONS)
    write_page(found, f"{setting.body.name} by {setting.hand}", folder / PAGE)
    return found


def _check_requirements_see(obstacles: Sequence[Obstacle], on_table: bool, require: Sequence[RequirementLike]) -> None:
    """Raise GraspAtlasError where there are obstacles that no requirement looks at."""
    if (obstacles or on_table) and not any(isinstance(each, CollisionFree) for each in require):
        raise GraspAtlasError("obstacles count where grasps must be free of collision: require collision_free too")


def _check_no_arm(require: Sequence[RequirementLike]) -> None:
    """Raise GraspAtlasError where a requirement asks for an arm."""
    for each in require:
        if isinstance(each, StatedRequirement) and each.needs_arm:
            raise GraspAtlasError(
                f"requirement {each.name} asks what an arm can bring about, and proposals know of none: leave it out, "
                "and state the arm in the problem file of a proposal"
            )


def _schedule(start: float, deadline: float, top: int) -> tuple[float, float]:
    """When looks are to end, and atlases, so that there is time for what comes after them."""
    if deadline == float("inf"):
        return deadline, deadline
    looked = max(deadline - top * (GROWING + VIEWING), start + LOOKING * (deadline - start))
    return looked, looked + GROWING / (GROWING + VIEWING) * (deadline - looked)


def _written(plan: Plan, assignment: Assignment, proposal: Proposal) -> Proposal:
    """A proposal whose files are written; a problem file that is there already, and may be edited, stays."""
    place = writable_folder(proposal.folder)
    if not (place / PROBLEM).exists():
        locked = assignment.fingers.grip.locked
        write_text(problem_file(plan, proposal.result.problem, locked, ".."), place / PROBLEM)
    proposal.result.save(place / RESULT)
    write_views(proposal)
    return proposal


def _tried(assignment: Assignment, look: Look) -> Tried:
    return Tried(
        links=tuple(pad.frame for pad in assignment.fingers.grip.pads),
        regions=tuple(region.name for region in assignment.regions),
        score=assignment.score,
        end=look.end,
        value=look.value,
        why=look.why,
        lack=look.lack,
    )
