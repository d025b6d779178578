"""A film: parts that move, seen from one direction, with what is written below each frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from graspatlas.support.arrays import Array, BoolArray, IntArray
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.scene import Colour, Part, fitted_camera, outermost, vertices_of

__all__ = ["MAX_FRAMES", "Film", "Label", "Readout", "evenly_chosen"]

#: Most frames of a film; of what has more points or steps, so many are shown, evenly chosen.
MAX_FRAMES = 300
#: Frames by which the camera is placed.
LOOKS = 6
#: What must be in the picture.
SEEN = ("hand", "object", "push")
#: A part that moves and turns less than this stands still.
STILL = 1e-9


@dataclass(frozen=True)
class Readout:
    """What is written below a frame.

    Attributes:
        name: Which moment it is, in few words.
        value: What counts there, such as the index or the push.
        details: What else there is to say.
        alarm: What is wrong, in red; nothing where all is well.
    """

    name: str
    value: str
    details: str = ""
    alarm: str = ""


@dataclass(frozen=True, eq=False)
class Label:
    """Words that stand in a film: title and text, centred below a point (3,)."""

    title: str
    text: str
    place: Array


@dataclass(frozen=True, eq=False)
class Film:
    """Meshes that move through f frames, scaled to the usual size.

    Attributes:
        name: Name of the problem.
        text: What is shown, in half a sentence.
        frames: Which points of the path, or steps of the trial, are shown (f,).
        parts: Each part as in the first frame.
        T: Placement of each part in each frame (f, parts, 4, 4).
        direction: Unit vector to the camera (3,).
        readouts: What is written below each frame (f,).
        curve: A curve to draw along the slider, (f, 2), or nothing.
        seconds: How long it plays.
        legend: Colours and what they stand for.
        course: What the slider goes along, such as ``along the path``.
        labels: Words that stand below what is shown.
    """

    name: str
    text: str
    frames: IntArray
    parts: tuple[Part, ...]
    T: Array
    direction: Array
    readouts: tuple[Readout, ...]
    curve: Array | None
    seconds: float
    legend: tuple[tuple[Colour, str], ...]
    course: str
    labels: tuple[Label, ...] = ()

    def __len__(self) -> int:
        return len(self.frames)

    @cached_property
    def moving(self) -> BoolArray:
        """Which parts move (parts,)."""
        return np.asarray((np.ptp(self.T, axis=0) > STILL).any(axis=(1, 2)))

    def frame(self, i: int) -> list[Part]:
        """The parts of a frame, placed in the world."""
        return [replace(part, T=T) for part, T in zip(self.parts, self.T[i], strict=True)]

    def camera(self, aspect: float, window: tuple[float, float, float, float]) -> Camera:
        """Camera that shows all frames inside a window of its picture; see :meth:`Scene.camera`."""
        return fitted_camera(self.outline, self.direction, aspect, window)

    @cached_property
    def outline(self) -> Array:
        """Corners of the convex hull of what must be in the picture (n, 3): where these are, all else is."""
        return outermost(
            np.concatenate([vertices_of(self.frame(int(i)), SEEN) for i in evenly_chosen(len(self), LOOKS)])
        )


def evenly_chosen(n: int, most: int) -> IntArray:
    """The first and the last of n, and others between, at most so many."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))
