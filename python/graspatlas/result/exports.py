"""Grasps in files for other programs: one JSON object with names, frames and units, or one flat CSV row a grasp."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypedDict

import numpy as np
from typing_extensions import Unpack

from graspatlas.errors import GraspAtlasError
from graspatlas.execution.pregrasp import Pregrasp
from graspatlas.grasps.columns import contact_columns, grasp_columns
from graspatlas.grasps.grasps import Grasps
from graspatlas.hand.urdf import root_link
from graspatlas.quality.batched import quality_name
from graspatlas.quality.evaluation import INDICES, evaluate
from graspatlas.requirements.base import requirement_name
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.storage.columns import joined
from graspatlas.storage.files import replaced, write_csv
from graspatlas.support.arrays import AnyArray, Array, BoolArray, IntArray
from graspatlas.support.validation import PlainTable, whole
from graspatlas.version import __version__

__all__ = ["ENDINGS", "FORMAT", "FORMAT_VERSION", "Selection", "identity", "save_grasps", "select"]


#: What a file of grasps may end in.
ENDINGS = (".csv", ".json")
FORMAT = "graspatlas grasps"
FORMAT_VERSION = 2


class Choice(TypedDict, total=False):
    """Arguments of :func:`select`."""

    charts: Sequence[int] | None
    best: int | None
    accepted: bool
    refined: bool


@dataclass(frozen=True, eq=False)
class Selection:
    """Some grasps of a result, with all that is known about each.

    Attributes:
        grasps: The grasps [n].
        charts: Chart of each [n]; of the refined best the one its climb began from.
        refined: True for the refined best, which is no chart's centre [n].
        accepted: Whether each meets the result's requirements [n].
        indices: Values of the result's indices by name, [n] each; NaN where one was not stored.
        pregrasps: The posture before each grasp [n]; None where none was asked for.
    """

    grasps: Grasps
    charts: IntArray
    refined: BoolArray
    accepted: BoolArray
    indices: dict[str, Array]
    pregrasps: Sequence[Pregrasp] | None = None

    def columns(self) -> dict[str, AnyArray]:
        """Columns of a flat table: chart, flags, indices, joints, poses, contacts, and the pregrasp's joints."""
        flags = {"chart": self.charts, "refined": self.refined, "accepted": self.accepted}
        before = {} if self.pregrasps is None else _pregrasp_columns(self.grasps.joints, self.pregrasps)
        return joined(flags, self.indices, grasp_columns(self.grasps), contact_columns(self.grasps), before)

    def records(self) -> list[PlainTable]:
        """One table a grasp, as the JSON file has it."""
        grasps = self.grasps
        joints = np.array(list(grasps.joint_positions.values())).T.tolist()
        object_xyz, object_quat = grasps.object_xyz.tolist(), grasps.object_quat_xyzw.tolist()
        palm_xyz, palm_quat = grasps.palm_xyz.tolist(), grasps.palm_quat_xyzw.tolist()
        points, normals = grasps.contact_points_in_object.tolist(), grasps.contact_normals_in_object.tolist()
        return [
            {
                "chart": int(self.charts[i]),
                "refined": bool(self.refined[i]),
                "accepted": bool(self.accepted[i]),
                "indices": {name: _finite(values[i]) for name, values in self.indices.items()},
                "joints": dict(zip(grasps.joints, joints[i], strict=True)),
                "palm_in_object": {"xyz": palm_xyz[i], "quat_xyzw": palm_quat[i]},
                "object_in_palm": {"xyz": object_xyz[i], "quat_xyzw": object_quat[i]},
                "contacts": [
                    {"frame": frame, "point": point, "normal": normal}
                    for frame, point, normal in zip(grasps.contact_frames, points[i], normals[i], strict=True)
                ],
                **({} if self.pregrasps is None else {"pregrasp": _pregrasp_record(self.pregrasps[i])}),
            }
            for i in range(len(grasps))
        ]


def select(
    result: GraspAtlas,
    *,
    charts: Sequence[int] | None = None,
    best: int | None = None,
    accepted: bool = False,
    refined: bool = False,
) -> Selection:
    """Choose grasps of a result; see :meth:`graspatlas.Result.save_grasps` for the arguments and errors."""
    if charts is not None and (best is not None or accepted):
        raise GraspAtlasError("give either charts, or best and accepted")
    if refined and result.refinement is None:
        raise GraspAtlasError("this result was not refined: give optimize refine=True")
    if charts is not None:
        rows = np.array([result.checked_chart(chart) for chart in charts], np.int64)
        if len(rows) == 0:
            raise GraspAtlasError("charts names none; give some, or leave it out for all")
    elif best is not None:
        rows = _best(result, best)
    else:
        rows = result.accepted_charts() if accepted else np.arange(result.atlas.n_charts)
    names = [quality_name(result.quality), *result.others]
    values = [values[rows] for values in (result.qualities, *result.others.values())]
    X, flags, numbers = result.atlas.centers[rows], result.accepted[rows], rows.astype(np.int64)
    if refined:
        top = result.refined_best
        at_top = [np.array([top.quality]), *(_at(result, top.x, name) for name in result.others)]
        values = [np.concatenate(pair) for pair in zip(at_top, values, strict=True)]
        X, flags, numbers = np.vstack([top.x, X]), np.append(True, flags), np.append(top.chart, numbers)
    return Selection(
        grasps=Grasps(result.problem, X.reshape(-1, result.atlas.centers.shape[1])),
        charts=numbers,
        refined=np.arange(len(numbers)) < refined,
        accepted=flags,
        indices=dict(zip(names, values, strict=True)),
    )


def _best(result: GraspAtlas, count: int) -> IntArray:
    """The best charts that meet the requirements, the best first; of equals the first."""
    whole(count, "best")
    candidates = result.accepted_charts()
    order = np.argsort(-result.qualities[candidates], kind="stable")
    return np.asarray(candidates[order[:count]], np.int64)


def _at(result: GraspAtlas, x: Array, name: str) -> Array:
    """Value of an index at a refined grasp [1]; NaN when it was a callable, which is not stored."""
    if name not in INDICES:
        return np.array([np.nan])
    refined_in_F = result.refinement is not None and result.refinement.all_motions
    system = result.problem.full_system if refined_in_F else result.system
    return evaluate(name, Grasps(result.problem, x, system))


def save_grasps(
    result: GraspAtlas, path: str | os.PathLike[str], pregrasp: float | None = None, **choice: Unpack[Choice]
) -> int:
    """Write grasps of a result; see :meth:`graspatlas.Result.save_grasps`.

    Args:
        result: The result.
        path: Ends in one of ``ENDINGS``.
        pregrasp: Distance of the postures before the grasps [m]; None for none.
        **choice: Arguments of :func:`select`.

    Returns:
        How many grasps were written.
    """
    target = Path(path)
    if target.suffix not in ENDINGS:
        raise GraspAtlasError(f"a file of grasps must end in {' or '.join(ENDINGS)}, got '{target}'")
    selection = select(result, **choice)
    if pregrasp is not None:
        selection = replace(selection, pregrasps=selection.grasps.pregrasps(pregrasp))
    if target.suffix == ".csv":
        write_csv(target, selection.columns())
    else:
        head = json.dumps(_header(result, selection), indent=2)
        rows = ",\n".join(f"    {json.dumps(record, allow_nan=False)}" for record in selection.records())
        with replaced(target) as stream:
            stream.write(f'{head[:-2]},\n  "grasps": [\n{rows}\n  ]\n}}\n'.encode())
    return len(selection.grasps)


def identity(result: GraspAtlas) -> PlainTable:
    """What stands at the top of every file of grasps: format, problem, hand, object, their frames and the index."""
    problem = result.problem
    return {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "graspatlas": __version__,
        "problem": problem.name,
        "hand": problem.hand.name,
        "object": problem.object.name,
        "frames": {"palm": root_link(problem.hand.urdf), "object": root_link(problem.object.urdf)},
        "quality": quality_name(result.quality),
    }


def _header(result: GraspAtlas, selection: Selection) -> PlainTable:
    """What holds for all grasps of a file."""
    problem = result.problem
    return identity(result) | {
        "units": {
            "xyz": "m",
            "point": "m",
            "quat_xyzw": "unit quaternion x y z w",
            **({} if selection.pregrasps is None else {"distance": "m"}),
            "joints": {joint.name: "m" if joint.prismatic else "rad" for joint in problem.hand.model.hand_joints},
        },
        "requirements": [requirement_name(requirement) for requirement in result.requirements],
        "status": str(result.status),
        "n_charts": result.atlas.n_charts,
        "n_grasps": len(selection.grasps),
    }


def _pregrasp_record(pregrasp: Pregrasp) -> PlainTable:
    """A posture before a grasp, as the JSON file has it."""
    return {
        "joints": dict(pregrasp.joint_positions),
        "distance": pregrasp.distances.tolist(),
        "reached": pregrasp.reached,
        "reason": pregrasp.reason,
    }


def _pregrasp_columns(joints: Sequence[str], pregrasps: Sequence[Pregrasp]) -> dict[str, AnyArray]:
    """Columns of the postures before grasps: each joint, the distance of each contact, and whether it was reached."""
    columns: dict[str, AnyArray] = {
        f"pregrasp_{joint}": np.array([pregrasp.joint_positions[joint] for pregrasp in pregrasps]) for joint in joints
    }
    distances = np.array([pregrasp.distances for pregrasp in pregrasps])
    columns |= {f"pregrasp_distance{i}": column for i, column in enumerate(distances.T)}
    return columns | {"pregrasp_reached": np.array([pregrasp.reached for pregrasp in pregrasps])}


def _finite(value: float) -> float | None:
    """A number that JSON knows, or nothing."""
    return float(value) if math.isfinite(value) else None
