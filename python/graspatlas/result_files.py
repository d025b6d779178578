"""Results in files: an NPZ archive of arrays, and a header in JSON. Reading one executes nothing in it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from graspatlas.atlas import Atlas, Status
from graspatlas.errors import GraspAtlasError
from graspatlas.files import replaced
from graspatlas.problem import Problem
from graspatlas.quality import quality_name
from graspatlas.refinement import Refinement
from graspatlas.requirements import Require, parse_requirement, requirement_name
from graspatlas.tables import number

if TYPE_CHECKING:
    from graspatlas.result import Result

__all__ = ["read_result", "save_result"]

FORMAT = "graspatlas result"
FORMAT_VERSION = 1

_REFINEMENT_FLAGS = ("all_motions", "complete")
_REFINEMENT_ARRAYS = tuple(f.name for f in fields(Refinement) if f.name not in _REFINEMENT_FLAGS)


def save_result(result: Result, path: str | os.PathLike[str]) -> None:
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
        "quality": quality_name(result.quality),
        "quality_seconds": result.quality_seconds,
        "requirements": [requirement_name(r) for r in result.requirements],
        "refused": dict(result.refused),
        "others": list(result.others),
    }
    extra: dict[str, Any] = {f"other_{i}": values for i, values in enumerate(result.others.values())}
    if result.refinement is not None:
        header["refinement"] = {name: getattr(result.refinement, name) for name in _REFINEMENT_FLAGS}
        extra |= {f"refined_{name}": getattr(result.refinement, name) for name in _REFINEMENT_ARRAYS}
    with replaced(path) as stream:
        np.savez(  # compression would take longer than the atlas
            stream,
            header=json.dumps(header),
            qualities=result.qualities,
            feasible=result.feasible,
            **extra,
            **result.atlas.to_arrays(),
        )


def read_result(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The attributes of a result that was saved; see :func:`graspatlas.load_result`.

    Args:
        path: The file, or a folder that holds ``result.npz``.

    Raises:
        GraspAtlasError: If the file is missing, damaged, or of another version.
    """
    source = Path(path)
    if source.is_dir():
        source = source / "result.npz"
    try:
        with open(source, "rb") as stream:
            header, arrays = _read(stream)
    except FileNotFoundError:
        raise GraspAtlasError(
            f"result '{source}' does not exist; 'graspatlas optimize ... --output FOLDER' writes one"
        ) from None
    except OSError as error:
        raise GraspAtlasError(f"cannot read result '{source}': {error.strerror or error}") from None
    except Exception:  # a damaged archive fails in many ways, none of which executes anything
        raise GraspAtlasError(f"'{source}' is damaged or not a graspatlas result; compute it again") from None
    if header.get("version") != FORMAT_VERSION:
        raise GraspAtlasError(
            f"result '{source}' has version {header.get('version')}, this graspatlas reads {FORMAT_VERSION}"
        )
    return _parts(header, arrays, source)


def _read(stream: BinaryIO) -> tuple[dict[str, Any], dict[str, Any]]:
    """Header and arrays of a result file."""
    with np.load(stream, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    header = json.loads(str(arrays.pop("header")))
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError("its header is another one")
    return header, arrays


def _parts(header: Mapping[str, Any], arrays: dict[str, Any], source: Path) -> dict[str, Any]:
    """Attributes of a result, once all of them are sound."""
    try:
        problem = _with_torque_length(Problem.from_dict(header["problem"]), header)
        qualities, feasible = arrays.pop("qualities"), arrays.pop("feasible")
        others = {str(name): arrays.pop(f"other_{i}") for i, name in enumerate(header.get("others", []))}
        refinement = _refinement(header.get("refinement"), arrays, problem)
        atlas = Atlas(
            system=problem.system(header["dimension"]),
            radius=number(header["radius"], "radius"),
            epsilon=number(header["epsilon"], "epsilon"),
            status=Status[header["status"]],
            seconds=number(header["seconds"], "seconds"),
            **arrays,
        )
        atlas.check_arrays()
        if qualities.shape != (atlas.n_charts,) or feasible.shape != qualities.shape or feasible.dtype != bool:
            raise GraspAtlasError("qualities and feasible need one entry a chart")
        for values in (qualities, *others.values()):
            if values.shape != qualities.shape or values.dtype.kind != "f" or np.isnan(values).any():
                raise GraspAtlasError("qualities must be numbers, one a chart")
        if not atlas.radius > 0.0 or not 0.0 < atlas.epsilon < 1.0 or not isinstance(header["quality"], str):
            raise GraspAtlasError("its header holds a value that cannot be")
        return {
            "problem": problem,
            "atlas": atlas,
            "quality": header["quality"],
            "qualities": qualities,
            "quality_seconds": number(header["quality_seconds"], "quality_seconds"),
            "requirements": tuple(_stored_requirement(str(text)) for text in header["requirements"]),
            "feasible": feasible,
            "refused": {str(name): int(count) for name, count in header["refused"].items()},
            "others": others,
            "refinement": refinement,
        }
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise GraspAtlasError(f"result '{source}' is damaged ({error}); compute it again") from None


def _with_torque_length(problem: Problem, header: Mapping[str, Any]) -> Problem:
    """The problem with the torque length that the result was computed with, should another one be found today."""
    length = number(header["torque_length"], "torque_length")
    return problem if length in (problem.torque_arm, 0.0) else replace(problem, torque_length=length)


def _refinement(flags: Mapping[str, Any] | None, arrays: dict[str, Any], problem: Problem) -> Refinement | None:
    """The refinement of a result file, taken out of its arrays."""
    if flags is None:
        return None
    parts = {name: arrays.pop(f"refined_{name}") for name in _REFINEMENT_ARRAYS}
    p = len(parts["x"])
    kinds = {"x": "f", "qualities": "f", "starts": "i", "converged": "b", "unbounded": "b", "steps": "i"}
    shapes = {**dict.fromkeys(kinds, (p,)), "x": (p, problem.full_system.configuration_size)}
    for name, array in parts.items():
        if p == 0 or array.shape != shapes[name] or array.dtype.kind != kinds[name] or not _sound(name, array):
            raise GraspAtlasError(f"the refined {name} have shape {array.shape} and type {array.dtype}")
    return Refinement(**parts, all_motions=bool(flags["all_motions"]), complete=bool(flags["complete"]))


def _sound(name: str, array: Any) -> bool:
    """Whether all numbers are finite; qualities that run away may be infinite."""
    return bool((~np.isnan(array) if name == "qualities" else np.isfinite(array)).all())


def _stored_requirement(text: str) -> Require | str:
    """The requirement of a name; the name alone of a callable, which is not stored."""
    try:
        return parse_requirement(text)
    except GraspAtlasError:
        return text
