"""The page of an atlas while it grows, which then gives way to the page of the result."""

from __future__ import annotations

import base64
import html
import json
import threading
import time
from importlib import resources
from string import Template

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasps import Grasps
from graspatlas.problem.problem import Problem
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable, StatedTable
from graspatlas.systems.system import AnySystem
from graspatlas.viewer.web.page import meshcat_script

__all__ = ["GrowthPage"]

#: The page's axes are principal ones of the charts that there are, found anew whenever there are so many times more.
AXES_EVERY = 6
#: Between two looks at the builder this passes at least [s], and so many times what a look takes.
LOOK_EVERY, LOOK_SHARE = 0.2, 2.0
#: An index that takes longer at a grasp is not read while the atlas grows [s].
QUICK = 5e-4


class GrowthPage:
    """The page of an atlas in the making.

    Args:
        problem: The problem.
        index: Name of the index that colours the charts.
    """

    def __init__(self, problem: Problem, index: str | None) -> None:
        self.problem = problem
        #: What is done.
        self.phase = "looking for a first grasp"
        self._index = index if index in INDICES else None
        self._lock = threading.Lock()
        self._n_open = self._epoch = 0
        self._axes_at = 1
        self._next = 0.0
        self._images, self._places, self._values = np.zeros((0, 0)), np.zeros((0, 3)), np.zeros(0)

    def watch(self, system: AnySystem, builder: _core.AtlasBuilder) -> None:
        """Look at an atlas between two slices of its growth; not at each. What goes wrong here does not end it."""
        began = time.monotonic()
        if began < self._next and not builder.audited:
            return
        try:
            self._look(system, builder)
        except Exception as error:
            self.phase = f"growing, but it cannot be shown: {error}"
            self._next = float("inf")
        else:
            self._next = time.monotonic() + max(LOOK_EVERY, LOOK_SHARE * (time.monotonic() - began))

    def _look(self, system: AnySystem, builder: _core.AtlasBuilder) -> None:
        if builder.n_charts < len(self._values):  # another one
            self._images, self._values = np.zeros((0, 0)), np.zeros(0)
        new = builder.arrays()["centers"][len(self._values) :]
        values = self._read(system, new)
        with self._lock:
            self.phase = _phase(builder)
            self._n_open = builder.n_open
            if len(new):
                self._place(system, new, values)

    def _place(self, system: AnySystem, new: Array, values: Array) -> None:
        """Give new charts their places; all of them where the axes are found anew."""
        images = np.array([system.embed(x) for x in new])
        self._images = np.concatenate([self._images, images]) if len(self._images) else images
        self._values = np.concatenate([self._values, values])
        if len(self._images) >= self._axes_at:
            self._axes_at = AXES_EVERY * len(self._images)
            self._epoch += 1
            self._middle = self._images.mean(axis=0)
            directions = np.linalg.svd(self._images - self._middle, full_matrices=False)[2][:3]
            self._axes = np.zeros((3, self._images.shape[1]))
            self._axes[: len(directions)] = directions
            self._places = (self._images - self._middle) @ self._axes.T
        else:
            self._places = np.concatenate([self._places, (images - self._middle) @ self._axes.T])

    def _read(self, system: AnySystem, new: Array) -> Array:
        """The index of new charts (n,); NaN where it takes too long, or fails."""
        if self._index is None or not isinstance(system, _core.GraspSystem) or not len(new):
            return np.full(len(new), np.nan)
        began = time.monotonic()
        try:
            values = evaluate(self._index, Grasps(self.problem, new, system))
        except GraspAtlasError:  # told where the atlas is read
            self._index = None
            return np.full(len(new), np.nan)
        if time.monotonic() - began > QUICK * len(new) + 0.05:
            self._index = None
        return values

    def text(self, token: str) -> str:
        """The page, which is to send the token."""
        explorer, live = (resources.files(f"graspatlas.viewer.{name}") for name in ("explorer", "live"))
        shared = [explorer / "scripts" / f"{name}.js" for name in ("data", "colours", "orbit")]
        scripts = [*shared, *(live / "scripts" / f"{name}.js" for name in ("asked", "growth"))]
        return Template((live / "growth.html").read_text(encoding="utf-8")).substitute(
            name=html.escape(self.problem.name),
            style=(explorer / "style.css").read_text(encoding="utf-8"),
            facts=json.dumps({"live": {"token": token}, "numbers": {}}),
            meshcat=meshcat_script(),
            scripts="\n".join(file.read_text(encoding="utf-8") for file in scripts),
        )

    def news(self, since: int, epoch: int) -> PlainTable:
        """Charts that the page does not know: all of them where it knows other axes."""
        with self._lock:
            first = since if epoch == self._epoch else 0
            return {
                "phase": self.phase,
                "n_charts": len(self._places),
                "n_open": self._n_open,
                "epoch": self._epoch,
                "places": _text(self._places[first:]),
                "values": _text(self._values[first : len(self._places)]),
                "index": (self._index or "").replace("_", " "),
            }

    def ask(self, asked: StatedTable) -> PlainTable:
        """Nothing can be asked for yet."""
        raise GraspAtlasError("the atlas is not done yet: wait for it")


def _phase(builder: _core.AtlasBuilder) -> str:
    """What is done."""
    if builder.audited:
        return "complete; reading the index and the requirements"
    return "checking for holes" if builder.complete else "growing"


def _text(numbers: Array) -> str:
    """Numbers in base64, four bytes each."""
    return base64.b64encode(np.ascontiguousarray(numbers, np.float32).tobytes()).decode("ascii")
