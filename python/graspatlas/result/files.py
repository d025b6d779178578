"""Results in files: an NPZ archive of arrays, and a header in JSON. Reading one executes nothing in it."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, fields, replace
from typing import Any, BinaryIO, TypedDict

import numpy as np

from graspatlas.atlas.atlas import LARGEST, Atlas
from graspatlas.atlas.status import Audit, Status
from graspatlas.errors import GraspAtlasError
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import quality_name
from graspatlas.requirements.base import RequirementLike, requirement_name
from graspatlas.requirements.lost import Lost
from graspatlas.requirements.named import parse_requirement
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.result.refinement import Refinement, SearchEnd, SearchReport
from graspatlas.storage.archives import DamagedArchive, read_arrays
from graspatlas.storage.files import is_folder, opened, replaced, stated_path
from graspatlas.support.arrays import AnyArray, Array, BoolArray
from graspatlas.support.validation import StatedTable, number, shown, whole

__all__ = ["read_result", "save_result"]

FORMAT = "graspatlas result"
FORMAT_VERSION = 2
#: How far a stored quaternion may be from length one.
UNIT_TOLERANCE = 1e-6

_REFINEMENT_FLAGS = ("all_motions", "complete")
#: Arrays that files of version 0.1 do not hold, and what stands for each of their numbers.
_NEW_ARRAYS = {"stalled": False, "kkt": np.nan, "hits": 1}
_REFINEMENT_ARRAYS = tuple(f.name for f in fields(Refinement) if f.name not in (*_REFINEMENT_FLAGS, "search"))


class Parts(TypedDict):
    """The attributes of a result."""

    problem: Problem
    atlas: Atlas
    quality: str
    qualities: Array
    quality_seconds: float
    requirements: tuple[RequirementLike, ...]
    accepted: BoolArray
    rejected: dict[str, int]
    others: dict[str, Array]
    refinement: Refinement | None


def save_result(result: GraspAtlas, path: str | os.PathLike[str]) -> None:
    """Write a result to one file; see :meth:`graspatlas.Result.save`.

    Args:
        result: The result.
        path: The file.

    Raises:
        GraspAtlasError: If it cannot be written.
    """
    header = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "problem": result.problem.to_dict(),
        "torque_length": result.problem.torque_arm,
        "dimension": result.dimension,
        "radius": result.atlas.radius,
        "epsilon": result.atlas.epsilon,
        "status": result.status.name,
        "seconds": result.atlas.seconds,
        "n_projections": result.atlas.n_projections,
        "audit": asdict(result.atlas.audit),
        "quality": quality_name(result.quality),
        "quality_seconds": result.quality_seconds,
        "requirements": [requirement_name(r) for r in result.requirements],
        "rejected": dict(result.rejected),
        "others": list(result.others),
    }
    extra: dict[str, AnyArray] = {f"other_{i}": values for i, values in enumerate(result.others.values())}
    if result.refinement is not None:
        flags = {name: getattr(result.refinement, name) for name in _REFINEMENT_FLAGS}
        search = result.refinement.search
        header["refinement"] = flags if search is None else {**flags, "search": asdict(search)}
        extra |= {f"refined_{name}": getattr(result.refinement, name) for name in _REFINEMENT_ARRAYS}
    arrays: dict[str, Any] = {"qualities": result.qualities, "accepted": result.accepted, **extra}
    arrays |= result.atlas.to_arrays()
    with replaced(path) as stream:
        np.savez(  # compression would take longer than the atlas
            stream,
            header=json.dumps(header),
            **arrays,
        )


def read_result(path: str | os.PathLike[str]) -> Parts:
    """The attributes of a result that was saved; see :func:`graspatlas.load_result`.

    Args:
        path: The file, or a folder that holds ``result.npz``.

    Raises:
        GraspAtlasError: If the file is missing, damaged, or of another version.
    """
    source = stated_path(path, "read result")
    if is_folder(source):
        source = source / "result.npz"
    try:
        with opened(source, "result") as stream:
            header, arrays = _read(stream)
    except FileNotFoundError:
        raise GraspAtlasError(
            f"result '{source}' does not exist; 'graspatlas optimize ... --output FOLDER' writes one"
        ) from None
    except OSError as error:
        raise GraspAtlasError(f"cannot read result '{source}': {error.strerror or error}") from None
    except GraspAtlasError:
        raise
    except (DamagedArchive, KeyError, ValueError, RecursionError) as error:
        reason = f" ({error})" if isinstance(error, DamagedArchive) else ""
        raise GraspAtlasError(f"'{source}' is damaged or not a graspatlas result{reason}; compute it again") from None
    if header.get("version") != FORMAT_VERSION:
        version = shown(header.get("version"))
        raise GraspAtlasError(
            f"result '{source}' has version {version}, this graspatlas reads {FORMAT_VERSION}: compute it again"
        )
    return _parts(header, arrays, source)


def _read(stream: BinaryIO) -> tuple[StatedTable, dict[str, AnyArray]]:
    """Header and arrays of a result file."""
    arrays = read_arrays(stream)
    header = json.loads(str(arrays.pop("header")))
    json.dumps(header, ensure_ascii=False).encode("utf-8")  # a name may hold half of a letter, which nothing can write
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError("its header is another one")
    return header, arrays


def _parts(header: StatedTable, arrays: dict[str, AnyArray], source: os.PathLike[str]) -> Parts:
    """Attributes of a result, once all of them are sound."""
    try:
        problem = _with_torque_length(Problem.from_dict(header["problem"]), header)
        qualities, accepted = arrays.pop("qualities"), arrays.pop("accepted")
        others = {str(name): arrays.pop(f"other_{i}") for i, name in enumerate(header.get("others", []))}
        refinement = _refinement(header.get("refinement"), arrays, problem)
        atlas = Atlas(
            system=problem.system(header["dimension"]),
            radius=number(header["radius"], "radius"),
            epsilon=number(header["epsilon"], "epsilon"),
            status=Status[header["status"]],
            seconds=number(header["seconds"], "seconds"),
            n_projections=int(number(header.get("n_projections", 0), "n_projections")),  # older files have none
            audit=_audit(header["audit"]),
            **arrays,
        )
        atlas.check_arrays()
        if qualities.shape != (atlas.n_charts,) or accepted.shape != qualities.shape or accepted.dtype != bool:
            raise GraspAtlasError("qualities and accepted need one entry a chart")
        for values in (qualities, *others.values()):
            if values.shape != qualities.shape or values.dtype.kind != "f" or np.isnan(values).any():
                raise GraspAtlasError("qualities must be numbers, one a chart")
        _check_header(header, atlas)
        check_configurations(problem, atlas.centers, "the centre of chart")
        return {
            "problem": problem,
            "atlas": atlas,
            "quality": header["quality"],
            "qualities": qualities,
            "quality_seconds": number(header["quality_seconds"], "quality_seconds"),
            "requirements": tuple(_stored_requirement(str(text)) for text in header["requirements"]),
            "accepted": accepted,
            "rejected": {str(name): int(count) for name, count in header["rejected"].items()},
            "others": others,
            "refinement": refinement,
        }
    except GraspAtlasError as error:
        raise GraspAtlasError(f"result '{source}' is damaged: {error}; compute it again") from None
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, ArithmeticError, RecursionError) as error:
        raise GraspAtlasError(f"result '{source}' is damaged ({shown(error)}); compute it again") from None


def _audit(table: StatedTable) -> Audit:
    """The audit of an atlas."""
    points, holes = (int(number(table[name], name)) for name in ("points", "holes"))
    seconds = number(table["seconds"], "seconds")
    if min(points, holes) < 0 or not 0.0 <= seconds < np.inf:
        raise GraspAtlasError("the audit must have counts and a time that are not negative")
    return Audit(points, holes, seconds)


def _check_header(header: StatedTable, atlas: Atlas) -> None:
    """Make sure that numbers and names of a header are ones that a result can have.

    Raises:
        GraspAtlasError: If one is not.
    """
    seconds = number(header["quality_seconds"], "quality_seconds")
    if not 0.0 < atlas.radius < LARGEST:
        raise GraspAtlasError(f"radius must be positive and below {LARGEST:g}, got {atlas.radius:g}")
    if not 0.0 < atlas.epsilon < 1.0:
        raise GraspAtlasError(f"epsilon must lie between 0 and 1, got {atlas.epsilon:g}")
    if not (0.0 <= atlas.seconds < np.inf and 0.0 <= seconds < np.inf):
        raise GraspAtlasError("seconds must be finite and not negative")
    if not isinstance(header["quality"], str):
        raise GraspAtlasError(f"quality must be the name of an index, got {shown(header['quality'])}")


def check_configurations(problem: Problem, X: Array, what: str) -> None:
    """Make sure that configurations name one each: quaternions, cosines and sines have length one.

    Args:
        problem: The problem.
        X: Configurations [n, configuration_size].
        what: What they are, for the message.

    Raises:
        GraspAtlasError: If one is off.
    """
    n_hand = problem.hand.model.hand_q_size
    turning = [joint.q_index for joint in problem.hand.model.hand_joints if joint.q_size == 2]
    parts = [("the cosine and sine of a continuous joint", slice(at, at + 2)) for at in turning]
    joint = problem.object_joint_model
    at, size = n_hand + joint.translations, joint.size - joint.translations
    parts.append(("the object's rotation", slice(at, at + size)))
    for name, columns in parts:
        lengths = np.linalg.norm(X[:, columns], axis=1)
        off = np.flatnonzero(~(np.abs(lengths - 1.0) < UNIT_TOLERANCE))
        if len(off):
            raise GraspAtlasError(f"{name} has length {lengths[off[0]]:g}, not 1, at {what} {off[0]}")


def _with_torque_length(problem: Problem, header: StatedTable) -> Problem:
    """The problem with the torque length that the result was computed with, should another one be found today."""
    length = number(header["torque_length"], "torque_length")
    return problem if length in (problem.torque_arm, 0.0) else replace(problem, torque_length=length)


def _refinement(flags: StatedTable | None, arrays: dict[str, AnyArray], problem: Problem) -> Refinement | None:
    """The refinement of a result file, taken out of its arrays."""
    if flags is None:
        return None
    p = len(arrays["refined_x"])
    for name, stand_in in _NEW_ARRAYS.items():
        arrays.setdefault(f"refined_{name}", np.full(p, stand_in))
    parts = {name: arrays.pop(f"refined_{name}") for name in _REFINEMENT_ARRAYS}
    kinds = {**dict.fromkeys(("x", "qualities", "kkt"), "f"), **dict.fromkeys(("starts", "steps", "hits"), "i")}
    kinds |= dict.fromkeys(("converged", "stalled", "unbounded"), "b")
    shapes = {**dict.fromkeys(kinds, (p,)), "x": (p, problem.full_system.configuration_size)}
    for name, array in parts.items():
        if p == 0 or array.shape != shapes[name] or array.dtype.kind != kinds[name] or not _sound(name, array):
            raise GraspAtlasError(f"the refined {name} have shape {array.shape} and type {array.dtype}")
    check_configurations(problem, parts["x"], "refined grasp")
    search = flags.get("search")
    return Refinement(
        **parts,
        all_motions=bool(flags["all_motions"]),
        complete=bool(flags["complete"]),
        search=None if search is None else _search_report(search),
    )


def _search_report(stated: StatedTable) -> SearchReport:
    """The report of a search, each number of its type."""
    values = {name: stated[name] for name in (f.name for f in fields(SearchReport))}
    counts = ("rounds", "climbs", "met", "peaks", "best_hits", "tries", "seed")
    return SearchReport(
        status=SearchEnd(values.pop("status")),
        share_missing=number(values.pop("share_missing"), "share_missing"),
        seconds=number(values.pop("seconds"), "seconds"),
        **{name: whole(values[name], name, 0) for name in counts},
    )


def _sound(name: str, array: AnyArray) -> bool:
    """Whether all numbers are finite; qualities that run away may be infinite."""
    if name == "kkt":
        return True  # not known where a climb had no slope
    return bool((~np.isnan(array) if name == "qualities" else np.isfinite(array)).all())


def _stored_requirement(text: str) -> RequirementLike:
    """The requirement of a name; of a function, which is not stored, what stands for it."""
    try:
        return parse_requirement(text)
    except GraspAtlasError:
        return Lost(text)
