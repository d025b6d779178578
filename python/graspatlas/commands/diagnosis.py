"""What a problem is like before its atlas is traced: freedoms, contacts, limits, collisions, and the size to expect."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from graspatlas.atlas.build import build_atlas
from graspatlas.atlas.status import Status
from graspatlas.collision.checker import CollisionChecker
from graspatlas.collision.hulls import LARGEST_ERROR
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.optimizer.first_grasp import with_good_first_grasp
from graspatlas.problem.problem import Problem
from graspatlas.problem.redundancy import near_x1, null_space, redundant_joints
from graspatlas.requirements.base import asked
from graspatlas.search.random_starts import hand_size

__all__ = ["NOTE", "OK", "PROBLEM", "Finding", "diagnose", "report"]


OK, NOTE, PROBLEM = "ok", "note", "problem"
#: A joint or parameter this near its limit is pointed out [rad, or lengths / length_scale].
NEAR_LIMIT = 0.02
#: A contact point this far from the collision shape that it should lie on is pointed out; shapes approximate [m].
OFF_SHAPE = 2e-3
#: How far along its outward normal a contact point is moved to see whether it comes out of the shape [m].
OUTWARDS = 1e-3
#: Less kept variance than this is pointed out.
LITTLE_VARIANCE = 0.9
#: Two variances closer than this share of the largest are the same.
SAME_VARIANCE = 1e-9
#: A first grasp turned by more than this from the guess is pointed out: something is not where it was thought [rad].
FAR_FROM_GUESS = 0.8
#: And so is one that is farther off than this share of the hand's size.
FAR_SHARE = 0.1
#: How long to look for a first grasp where none is given [s].
SEARCH_SECONDS = 10.0
#: How long an atlas may grow for the estimate of its size [s], and how often its radius may be doubled.
ESTIMATE_SECONDS, DOUBLINGS = 0.5, 3


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        mark: ``"ok"``, ``"note"`` or ``"problem"``.
        subject: What it is about.
        text: What was found.
        hint: What to do about it, or what it means.
    """

    mark: str
    subject: str
    text: str
    hint: str

    def to_dict(self) -> dict[str, str]:
        """The finding as plain data."""
        return asdict(self)


def diagnose(problem: Problem, *, dimension: int | None = None, radius: float | None = None) -> list[Finding]:
    """Look at all that decides whether an atlas of a problem can be traced, and how large it will be.

    Args:
        problem: The problem.
        dimension: k that is wanted; the problem's default, or else the smallest of 2 and t.
        radius: r that is wanted; the problem's default when there is one.

    Returns:
        The findings, in the order of the paper. One marked ``"problem"`` means that no atlas can be traced.
    """
    findings = [*_mimics(problem), _size(problem)]
    if problem.x1 is None:
        try:
            problem = with_first_grasp_for(problem, dimension)
        except GraspAtlasError as error:
            return [*findings, Finding(PROBLEM, "first grasp", str(error), "what follows is not known without one")]
        findings += [_found(problem), *_unmet(problem)]
    try:
        t = problem.full_dimension
    except GraspAtlasError as error:
        return [*findings, Finding(PROBLEM, "rank", str(error), "contacts and posture are what to look at")]
    findings.append(_rank(problem))
    k = dimension or problem.defaults.get("dimension") or min(2, t)
    findings += [*_motions(problem, k), *_contacts(problem), *_limits(problem), *_redundancies(problem)]
    findings += [*_shapes(problem), _collision(problem), *_arm(problem), _defaults(problem)]
    r = radius or problem.defaults.get("radius")
    if r is not None and all(finding.mark != PROBLEM for finding in findings if finding.subject == "hand motions"):
        findings.append(_charts(problem, int(k), float(r)))
    return findings


def _searched_dimension(problem: Problem, dimension: int | None) -> int:
    """Dimension in which a first grasp is sought: the wanted one, or where it cannot be, the largest that can."""
    largest = problem.largest_dimension
    wanted = dimension or int(problem.defaults.get("dimension") or min(2, largest))
    try:
        problem.frozen_motions(wanted)
    except GraspAtlasError:
        return largest
    return wanted


def with_first_grasp_for(problem: Problem, dimension: int | None) -> Problem:
    """The problem with a first grasp, for the dimension that is wanted; see :func:`with_good_first_grasp`.

    Raises:
        GraspAtlasError: If none is found.
    """
    k = _searched_dimension(problem, dimension)
    return with_good_first_grasp(problem, k, problem.requirements, SEARCH_SECONDS, False)


def _found(problem: Problem) -> Finding:
    """A first grasp was found; how far it is from where it was wanted."""
    text, hint = "none given, but one is found", "x1 below is the one found; check --write-x1 writes it into the file"
    guess, x1 = problem.pose_guess, problem.x1
    if guess is not None and x1 is not None:
        from scipy.spatial.transform import Rotation  # slow to import

        metres, angle = guess.offset(x1.object_xyz, Rotation.from_quat(x1.object_quat_xyzw))
        text += f", {1000.0 * metres:.3g} mm from the pose guess"
        text += f" and turned by {np.degrees(angle):.3g} degrees" if guess.quat_xyzw else ""
        if guess.quat_xyzw and angle > FAR_FROM_GUESS:
            hint = "a normal, an axis or a frozen u may be wrong; or state a reference, the hand about to close"
            return Finding(NOTE, "first grasp", text, hint)
        if metres > FAR_SHARE * hand_size(problem):
            hint = "no nearer one was found: check that the fingers can close around the object there, and its frame"
            return Finding(NOTE, "first grasp", text, hint)
    return Finding(OK, "first grasp", text, hint)


def _unmet(problem: Problem) -> Iterator[Finding]:
    """The requirements that a first grasp which was found misses."""
    grasps = Grasps(problem, problem.x1_array[None], problem.full_system)
    missed = [str(each) for each in problem.requirements if not asked(each, grasps)[0]]
    if missed:
        text = f"the first grasp that was found misses {', '.join(missed)}, and no grasp that meets all was found"
        yield Finding(NOTE, "requirements", text, "an atlas may hold some all the same; or these contacts allow none")


def _mimics(problem: Problem) -> Iterator[Finding]:
    mimics = problem.hand.mechanism.mimics
    if mimics:
        hint = "by the <mimic> tags of the URDF; they hold on all grasps and count neither as joints nor among the s"
        yield Finding(OK, "mimic joints", "; ".join(map(str, mimics)), hint)


def _size(problem: Problem) -> Finding:
    system = problem.full_system
    mechanism = problem.hand.mechanism
    h, w = len(mechanism.actuated), sum(len(contact.free()) for contact in problem.contacts)
    which = " that mimic no other" if mechanism.mimics else ""
    text = (
        f"{h} joints{which}, {system.object_dof} freedoms of the object and {w} free patch parameters: "
        f"{system.tangent_size} unknowns; {len(problem.contacts)} contacts: {system.n_equations} equations"
    )
    return Finding(OK, "freedoms", text, "t is unknowns minus rank")


def _rank(problem: Problem) -> Finding:
    equations, t = problem.full_system.n_equations, problem.full_dimension
    hint = f"a dimension k from 1 to {problem.largest_dimension} is possible"
    return Finding(OK, "rank", f"{equations} of {equations} at x1, so t = {t}", hint)


def _motions(problem: Problem, k: int) -> Iterator[Finding]:
    """How many motions the wanted k freezes, the couplings, and how much of the hand's variance stays."""
    motions, t = problem.motions, problem.full_dimension
    try:
        s = problem.frozen_motions(k)
    except GraspAtlasError as error:
        yield Finding(PROBLEM, "hand motions", str(error), f"t = {t}; choose another dimension or other hand motions")
        return
    if motions is None:
        yield Finding(OK, "hand motions", f"none; k = t = {t}, s = 0", "give some to trace fewer dimensions")
        return
    c, h = len(motions.couplings), len(problem.hand.mechanism.actuated)
    coupled = f", {c} of them couplings" if c else ""
    hint = "a smaller k freezes more of them"
    if not motions.covariance.any():
        yield Finding(OK, "hand motions", f"k = {k} freezes s = {s} of {h}{coupled}", "without postures only couplings")
        return
    mechanism = problem.hand.mechanism
    constrained = mechanism.constrained(motions)
    variances, kept = constrained.variances, constrained.variance_kept(s + len(mechanism.mimics))
    text = f"k = {k} freezes s = {s} of {h}{coupled}; {100.0 * kept:.4g} % of the variance stay"
    last = h - s
    tied = c < s < h and variances[last - 1] - variances[last] <= SAME_VARIANCE * max(variances[0], 0.0)
    if tied:
        hint = "the last motion kept and the first frozen have equal variance, so either would do; change k by one"
    elif kept < LITTLE_VARIANCE:
        hint = "much of what the hand can do is frozen; a larger k keeps more"
    yield Finding(NOTE if tied or kept < LITTLE_VARIANCE else OK, "hand motions", text, hint)


def _contacts(problem: Problem) -> Iterator[Finding]:
    arrays = problem.full_system.grasp_arrays(problem.x1_array[None])
    gaps = np.linalg.norm(arrays["hand_points"] - arrays["object_points"], axis=2)[0]
    cosines = -np.sum(arrays["hand_normals"] * arrays["object_normals"], axis=2)[0]
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    for contact, gap, angle in zip(problem.contacts, gaps, angles, strict=True):
        text = f"{contact.frame}: {1000.0 * gap:.3g} mm apart, normals {angle:.3g} degrees off"
        yield Finding(OK, "contact at x1", text, "x1 is projected onto the contacts")


def _limits(problem: Problem) -> Iterator[Finding]:
    system = problem.full_system
    slack = np.asarray(system.slack(problem.x1_array))
    named = [_with_contact(name, problem) for name in system.bound_names]
    near = [f"{name} ({s:.3g})" for name, s in zip(named, slack, strict=True) if s < NEAR_LIMIT]
    if not near:
        text = f"x1 is at least {slack.min():.3g} from all {len(slack)}" if len(slack) else "there are none"
        yield Finding(OK, "limits", text, "in radians, and lengths / length_scale")
        return
    hint = "an atlas grows from there one way only; that is all right unless x1 was meant to lie inside"
    yield Finding(NOTE, "limits", f"x1 is at the {', the '.join(near)}", hint)


def _with_contact(bound: str, problem: Problem) -> str:
    """The name of a bound, its patch parameter said by contact and side in place of its number in x."""
    of, found, number = bound.partition("patch parameter ")
    if not found:
        return bound
    names = [
        f"{name} of the {side.name}'s patch at {contact.frame}"
        for contact in problem.contacts
        for side in contact.sides
        for name in side.free
    ]
    return of + names[int(number)]


def _redundancies(problem: Problem) -> Iterator[Finding]:
    h, groups = len(problem.hand.mechanism.actuated), redundant_joints(problem)
    J_x1, J_near = (problem.full_system.evaluate_jacobian(x) for x in (problem.x1_array, near_x1(problem)))
    extra = len(null_space(J_x1[:, :h])) - len(groups)
    if groups:
        text = "; ".join(" with ".join(group) for group in groups)
        hint = "they move no contact, and the atlas traces them needlessly: lock joints (hand: locked)"
        yield Finding(NOTE, "redundancies", f"{len(groups)}: {text}", hint)
    elif extra > 0:
        text = f"none, but at x1 itself the contacts do not feel {extra} motion{'s' if extra > 1 else ''} of the joints"
        hint = "x1 is singular, as with a straight finger; bend it a little if no atlas can grow from it"
        yield Finding(NOTE, "redundancies", text, hint)
    else:
        yield Finding(OK, "redundancies", "none: every joint velocity moves a contact", "nothing is traced needlessly")
    loose = min(len(null_space(J[:, h:])) for J in (J_x1, J_near))
    if loose:
        text = f"it can move in {loose} way{'s' if loose > 1 else ''} while the hand stays still"
        hint = "symmetric objects do: freeze u or v of one contact, or the atlas repeats its grasps"
        yield Finding(NOTE, "object", text, hint)
    else:
        yield Finding(OK, "object", "it stays where it is while the hand stays still", "no grasp is traced twice")


def _shapes(problem: Problem) -> Iterator[Finding]:
    """Whether what touches is what collides: patches against collision shapes, which are stated apart."""
    try:
        checker = CollisionChecker(problem)
    except GraspAtlasError:
        return  # which the next finding says
    if checker.thinned:
        yield _thinned(checker.thinned)
    x = problem.x1_array
    arrays = problem.full_system.grasp_arrays(x[None])
    largest, faults = 0.0, []
    for i, contact in enumerate(problem.contacts):
        for side, frame in (("hand", contact.frame), ("object", None)):
            point, normal = arrays[f"{side}_points"][0, i], arrays[f"{side}_normals"][0, i]
            here, out = checker.depths(x, frame, [point, point + OUTWARDS * normal])
            what = f"{contact.frame}: the {side}'s"
            if np.isfinite(here):
                largest = max(largest, abs(here))
            if np.isfinite(here) and abs(here) > OFF_SHAPE:
                faults.append(f"{what} point is {1000.0 * abs(here):.3g} mm off the surface of its collision shape")
            elif out < here - 0.5 * OUTWARDS:
                faults.append(f"{what} normal points into its collision shape")
    if faults:
        hint = "patches touch, shapes collide: compare the point or axis, the normal and the units of both"
        yield Finding(NOTE, "shapes at x1", "; ".join(faults), hint)
    else:
        text = f"contact points lie on the collision shapes, to {1000.0 * largest:.2f} mm"
        yield Finding(OK, "shapes at x1", text, "what touches is what collides")


def _thinned(thinned: Mapping[str, float]) -> Finding:
    """Hulls that collide with fewer corners than their meshes have."""
    largest = max(thinned.values())
    text = f"thinned, to {1000.0 * largest:.2f} mm: {', '.join(thinned)}"
    hint = "these hulls have more corners than collisions need; simpler meshes would be read faster"
    return Finding(OK if largest <= LARGEST_ERROR else NOTE, "collision hulls", text, hint)


def _collision(problem: Problem) -> Finding:
    try:
        hit = CollisionChecker(problem).first_collision(problem.x1_array)
    except GraspAtlasError as error:
        return Finding(NOTE, "collision at x1", str(error), "the requirement collision_free cannot be asked for")
    if hit is None:
        return Finding(OK, "collision at x1", "none", "other grasps may collide: require collision_free")
    hint = "not forbidden, but collision_free will refuse x1; list pairs that may touch in an SRDF, or move x1"
    return Finding(NOTE, "collision at x1", f"{hit[0]} and {hit[1]}", hint)


def _arm(problem: Problem) -> Iterator[Finding]:
    """Whether the arm, if there is one, brings the hand to x1."""
    if problem.arm is None:
        return
    what = f"{problem.arm.name}, {len(problem.arm.joints)} joints up to {problem.arm.flange}"
    try:
        Grasps(problem, problem.x1_array)[0].arm_positions()
    except GraspAtlasError as error:
        hint = "not forbidden, but reachable will refuse x1; other grasps may be reached"
        yield Finding(NOTE, "arm at x1", f"{what}: {error}", hint)
        return
    yield Finding(OK, "arm at x1", f"{what}: a posture was found", "of other grasps none may be: require reachable")


def _defaults(problem: Problem) -> Finding:
    missing = [name for name in ("dimension", "radius", "epsilon", "quality") if name not in problem.defaults]
    if missing:
        hint = "say them under defaults, or to optimize each time"
        return Finding(NOTE, "defaults", f"none for {', '.join(missing)}", hint)
    stated = ", ".join(f"{name} {value}" for name, value in problem.defaults.items())
    required = " ".join(map(str, problem.requirements)) or "none"
    return Finding(OK, "defaults", f"{stated}; requirements: {required}", "options replace them")


def _charts(problem: Problem, k: int, r: float) -> Finding:
    """Traces with r, and then with twice r and so on, until an atlas is complete; its charts grow as r to the -k.

    Source: a chart of radius r covers about r^k of a k-dimensional manifold, so N is about (r0 / r)^k N0.
    """
    epsilon = problem.defaults.get("epsilon", 0.5)
    rate = 0.0
    for doubling in range(DOUBLINGS + 1):
        tried, start = r * 2**doubling, time.perf_counter()
        try:
            system = problem.system(k)
            atlas = build_atlas(
                system, problem.x1_array, radius=tried, epsilon=epsilon, max_seconds=ESTIMATE_SECONDS, progress=False
            )
        except GraspAtlasError as error:
            if doubling == 0:
                return Finding(PROBLEM, "charts", str(error), "choose another radius or epsilon")
            break
        rate = rate or atlas.n_charts / (time.perf_counter() - start)
        if atlas.status in (Status.COMPLETE, Status.BLOCKED):
            return _counted(atlas.n_charts, k, r, tried, rate)
        if atlas.status is not Status.TIME_LIMIT:
            break
    text = f"more than {ESTIMATE_SECONDS * rate:.2g} for r = {r:g}, at about {rate:.2g} charts/s"
    return Finding(NOTE, "charts", text, "that may take long: use a larger r, a smaller k, or --max-charts")


def _counted(found: int, k: int, r: float, tried: float, rate: float) -> Finding:
    if tried == r:
        hint = f"half the radius takes about {2**k} times as many"
        return Finding(OK, "charts", f"{found} for k = {k}, r = {r:g}; they are traced already", hint)
    estimate = found * (tried / r) ** k
    text = f"about {estimate:.2g} for k = {k}, r = {r:g}: {estimate / rate:.2g} s (an estimate from r = {tried:g})"
    return Finding(OK, "charts", text, f"half the radius takes about {2**k} times as many")


def report(findings: Sequence[Finding]) -> str:
    """The findings as aligned text, each with its hint below."""
    marks, subjects = (max(len(getattr(f, name)) for f in findings) for name in ("mark", "subject"))
    lines = []
    for f in findings:
        lines += [f"{f.mark:{marks}}  {f.subject:{subjects}}  {f.text}", f"{'':{marks + subjects + 4}}({f.hint})"]
    counts = ", ".join(f"{sum(f.mark == mark for f in findings)} {mark}" for mark in (OK, NOTE, PROBLEM))
    return "\n".join([*lines, counts])
