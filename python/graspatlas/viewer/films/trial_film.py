"""The film of a trial: the hand closes and squeezes, the object is pushed until it is lost; or of two trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspatlas.simulation.recording import CLOSING, PUSH, SQUEEZE, Recording
from graspatlas.support.arrays import Array, IntArray
from graspatlas.viewer.films.animation import LOOKS, MAX_FRAMES, Film, Label, Readout, evenly_chosen
from graspatlas.viewer.scene.bodies import BodyShapes
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.captions import trial_text
from graspatlas.viewer.scene.meshes import arrow, ellipsoid, frame_along
from graspatlas.viewer.scene.scene import (
    COLOURS,
    CONTACT_RADIUS,
    GAP,
    NORMAL_RADIUS,
    Part,
    direction_to,
    grasp_parts,
    size_of,
    subject_of,
    vertices_of,
)
from graspatlas.viewer.scene.viewpoint import Subject

__all__ = ["moments", "trial_film", "trial_strips"]

#: A trial plays so many times slower than it went.
SLOWER = 2.0
#: Length of the arrow of the largest push, radius of its shaft [m], and the force that it stands for at least [N].
PUSH_LENGTH, PUSH_RADIUS, LEAST_PUSH = 0.09, 0.004, 1.0
#: Length of the arrow of a contact force of 10 N [m].
FORCE_LENGTH = 0.06
#: When a strip shows the push: shares of the time until the object is lost.
PUSHED = (0.5, 0.9)
#: Scale of what is not there.
HIDDEN = 1e-4
WORDS = {CLOSING: "closing", SQUEEZE: "squeezing"}


def moments(recording: Recording) -> IntArray:
    """Steps that tell a trial: before closing, squeezed, pushed by half and nearly as hard as it bears, and the end."""
    phases = np.array(recording.phases)
    last = len(recording) - 1
    pushed = np.flatnonzero(phases == PUSH)
    kept = pushed[~recording.lost[pushed]]
    end = (int(kept[-1]) + last) // 2 if len(kept) and recording.lost[-1] else last  # before it is far away
    told = [int(kept[int(share * len(kept))]) for share in PUSHED] if len(kept) else []
    return np.unique([0, int(np.flatnonzero(phases != PUSH)[-1]), *told, end])


def trial_strips(recordings: Sequence[Recording]) -> list[Film]:
    """A film of the moments of each trial, all seen from one direction and with pushes to one scale."""
    whole = trial_film(recordings, LOOKS)
    return [trial_film([one], moments(one), whole.direction, _strongest(recordings)) for one in recordings]


def trial_film(
    recordings: Sequence[Recording],
    frames: int | IntArray = MAX_FRAMES,
    direction: Array | None = None,
    strongest: float | None = None,
) -> Film:
    """Hand, object, contact forces and push of a trial; of several, one beside the other at the same times.

    Args:
        recordings: The trials; each that has ended stands still.
        frames: Largest number of frames, or the steps of the longest trial that are shown.
        direction: Unit vector to the camera (3,); by default where most is seen from.
        strongest: Push that has the longest arrow [N]; by default the largest of these trials.

    Raises:
        GraspAtlasError: If a mesh of the hand or the object cannot be read.
    """
    longest = max(recordings, key=lambda recording: float(recording.times[-1]))
    steps = evenly_chosen(len(longest), frames) if isinstance(frames, int) else frames
    times = longest.times[steps]
    shows = [_Show.of(recording, times, strongest or _strongest(recordings)) for recording in recordings]
    if direction is None:
        joint = recordings[0].grasp.problem.object_joint_model
        direction = direction_to([show.subject() for show in shows], joint)
    axes = Camera(np.zeros(3), direction, 1.0).axes
    places = _side_by_side(shows, axes[0])
    T = np.concatenate([place @ show.T for place, show in zip(places, shows, strict=True)], axis=1)
    parts = [part for show in shows for part in show.parts]
    pushes = longest.pushes[steps]
    return Film(
        name=longest.grasp.problem.name,
        text=trial_text(recordings[0]) if len(recordings) == 1 else _common_text(recordings),
        frames=steps,
        parts=tuple(replace(part, T=T) for part, T in zip(parts, T[0], strict=True)),
        T=T,
        direction=direction,
        readouts=tuple(_readout(recordings, float(t)) for t in times),
        curve=np.column_stack([times, np.linalg.norm(pushes, axis=1)]),
        seconds=SLOWER * float(times[-1]),
        legend=(
            (COLOURS["push"], "push on the object"),
            (COLOURS["force"], "forces of the fingers on it"),
        ),
        course="time of the trial, played at half speed",
        labels=_labels(shows, places, axes) if len(shows) > 1 else (),
    )


def _strongest(recordings: Sequence[Recording]) -> float:
    """The largest push [N]."""
    return max(LEAST_PUSH, *(float(np.linalg.norm(r.pushes, axis=1).max()) for r in recordings))


@dataclass(frozen=True, eq=False)
class _Show:
    """One trial as it is drawn: its parts, their placements in the palm's frame in each frame, and their scale."""

    recording: Recording
    parts: list[Part]
    T: Array
    size: float

    @classmethod
    def of(cls, recording: Recording, times: Array, strongest: float) -> _Show:
        """A trial at some times, which may be later than its end."""
        grasp = recording.grasp
        shapes = BodyShapes(grasp.problem)
        steps = np.minimum(np.searchsorted(recording.times, times - 1e-9), len(recording) - 1)
        ended = times > recording.times[-1] + 1e-9
        bodies = [_bodies(shapes, recording, int(step)) for step in steps]
        size = size_of(bodies[0])
        m, origin = len(grasp.contact_points), np.zeros(3)
        ball = ellipsoid(np.full(3, size * CONTACT_RADIUS), 24)
        needle = arrow(origin, np.array([0.0, 0.0, 1.0]), size * FORCE_LENGTH, 1.6 * size * NORMAL_RADIUS)
        thick = arrow(origin, np.array([0.0, 0.0, 1.0]), size * PUSH_LENGTH, size * PUSH_RADIUS)
        marks = [("contact", ball)] * m + [("force", needle)] * m + [("push", thick)]
        reach = _reach(shapes, grasp.problem.object.center_of_mass)
        T = np.array(
            [
                [part.T for part in body] + _marks(recording, int(step), bool(over), reach, strongest)
                for body, step, over in zip(bodies, steps, ended, strict=True)
            ]
        )
        tops = [Part(group, mesh, np.eye(4), COLOURS[group]) for group, mesh in marks]
        return cls(recording, bodies[0] + tops, T, size)

    def subject(self) -> Subject:
        """What the camera should see of it: the grasp."""
        parts = grasp_parts(BodyShapes(self.recording.grasp.problem), self.recording.grasp, self.size)[0]
        return subject_of(parts, self.size)

    def points(self) -> Array:
        """Vertices of hand and object in some frames (n, 3), in the palm's frame."""
        shots = [
            vertices_of([replace(part, T=T) for part, T in zip(self.parts, self.T[i], strict=True)])
            for i in evenly_chosen(len(self.T), LOOKS)
        ]
        return np.concatenate(shots)


def _bodies(shapes: BodyShapes, recording: Recording, step: int) -> list[Part]:
    """Hand and object at a step, in the palm's frame."""
    hand = recording.grasp.problem.hand
    positions = dict(zip(hand.joints, recording.joint_positions[step].tolist(), strict=True))
    parts = [Part("hand", mesh, T, colour) for mesh, T, colour in shapes.hand(hand.configuration(positions))]
    pose = recording.T_palm_object[step]
    return parts + [Part("object", mesh, pose @ T, colour) for mesh, T, colour in shapes.object()]


def _reach(shapes: BodyShapes, center: Array) -> Array:
    """Points of the object about its centre of mass (n, 3), in its own frame."""
    return np.concatenate([mesh.moved(T).vertices for mesh, T, _ in shapes.object()]) - center


def _marks(recording: Recording, step: int, ended: bool, reach: Array, strongest: float) -> list[Array]:
    """Placements of the balls, of the arrows of the forces, and of that of the push (4, 4)."""
    hidden = np.diag([HIDDEN, HIDDEN, HIDDEN, 1.0])
    points, forces = recording.contact_points[step], recording.contact_forces[step]
    balls, needles = [], []
    for point, force in zip(points, forces, strict=True):
        size = float(np.linalg.norm(force))
        shown = size > 0.0 and not np.isnan(point).any() and not ended
        balls.append(_scaled(np.array([0.0, 0.0, 1.0]), point, 1.0) if shown else hidden)
        needles.append(_scaled(force / size, point, max(size / 10.0, HIDDEN)) if shown else hidden)
    push = recording.pushes[step]
    size = float(np.linalg.norm(push))
    if size == 0.0 or ended:
        return [*balls, *needles, hidden]
    along, pose = push / size, recording.T_palm_object[step]
    center = pose[:3, :3] @ recording.grasp.problem.object.center_of_mass + pose[:3, 3]
    start = center + along * float((reach @ pose[:3, :3].T @ along).max())
    return [*balls, *needles, _scaled(along, start, max(size / strongest, HIDDEN))]


def _scaled(direction: Array, origin: Array, scale: float) -> Array:
    T = frame_along(direction, origin)
    T[:3, :3] *= scale
    return T


def _side_by_side(shows: Sequence[_Show], right: Array) -> list[Array]:
    """Where each trial stands (4, 4), from left to right, scaled to the usual size."""
    places, edge = [], 0.0
    for show in shows:
        across = show.points() @ right / show.size
        T = np.diag([1.0 / show.size] * 3 + [1.0])
        if len(shows) > 1:
            T[:3, 3] = (edge - across.min()) * right
        places.append(T)
        edge += float(np.ptp(across)) + GAP
    return places


def _labels(shows: Sequence[_Show], places: Sequence[Array], axes: Array) -> tuple[Label, ...]:
    """Which grasp each trial is of, below it; the axes are those of the camera."""
    clouds = [(show.points() @ T[:3, :3].T + T[:3, 3]) @ axes.T for show, T in zip(shows, places, strict=True)]
    bottom, depth = min(points[:, 1].min() for points in clouds), np.mean([points[:, 2].mean() for points in clouds])
    return tuple(
        Label(
            show.recording.name,
            _outcome(show.recording),
            np.array([(points[:, 0].min() + points[:, 0].max()) / 2.0, bottom, depth]) @ axes,
        )
        for show, points in zip(shows, clouds, strict=True)
    )


def _outcome(recording: Recording) -> str:
    if not recording.lost.any():
        return "held"
    force = recording.breaking_force
    return f"lost at {force:.2f} N" if force > 0.0 else "lost while closing"


def _common_text(recordings: Sequence[Recording]) -> str:
    """What trials have in common."""
    text = trial_text(recordings[0]).split("; ", 1)[1]
    return f"{text}; each along the direction in which it holds least" if recordings[0].growing else text


def _readout(recordings: Sequence[Recording], t: float) -> Readout:
    """What is written below trials at a time."""
    steps = [min(int(np.searchsorted(r.times, t - 1e-9)), len(r) - 1) for r in recordings]
    longest = int(np.argmax([r.times[-1] for r in recordings]))
    first, step = recordings[longest], steps[longest]
    phase, push = first.phases[step], float(np.linalg.norm(first.pushes[step]))
    name = f"push {push:.2f} N" if phase == PUSH else "before closing" if step == 0 else WORDS[phase]
    if len(recordings) > 1:
        states = [f"{r.name} {_outcome(r) if r.lost[i] else 'held'}" for r, i in zip(recordings, steps, strict=True)]
        return Readout(name, name, "; ".join([f"{t:.2f} s", *states]))
    moved = float(np.linalg.norm(_center(first, step) - _center(first, 0)))
    sizes = ", ".join(f"{force:.1f}" for force in np.linalg.norm(first.contact_forces[step], axis=1))
    details = f"{t:.2f} s, moved {1e3 * moved:.1f} mm; fingers {sizes} N"
    return Readout(name, name, details, _outcome(first) if first.lost[step] else "")


def _center(recording: Recording, step: int) -> Array:
    """The object's centre of mass (3,)."""
    T = recording.T_palm_object[step]
    return np.asarray(T[:3, :3] @ recording.grasp.problem.object.center_of_mass + T[:3, 3])
