"""What has been found in the page, as files beside the result; the result's own file is written only on request."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from graspatlas.analysis.climb import Climb
from graspatlas.analysis.peaks import peaks_of
from graspatlas.quality.batched import quality_name
from graspatlas.result.refinement import Refinement
from graspatlas.result.result import Result
from graspatlas.storage.files import replaced
from graspatlas.viewer.live.additions import Added
from graspatlas.viewer.live.session import Session

__all__ = ["ARRAYS", "WORDS", "save"]

#: Files of what has been found: arrays of all grasps, and climbs and trials in words.
ARRAYS, WORDS = "explored.npz", "explored.json"
#: What `optimize` writes beside its result.
SUMMARY = "summary.json"


def save(session: Session, whole: bool) -> str:
    """Write what has been found.

    Args:
        session: What is saved.
        whole: Write the result's own file anew too, with the indices and the ends of climbs.

    Returns:
        What has been written, in words.

    Raises:
        GraspAtlasError: If a file cannot be written.
    """
    assert session.file is not None
    known = len(session.told)
    folder, written = session.file.parent, [ARRAYS, WORDS]
    with replaced(folder / ARRAYS) as stream:
        np.savez_compressed(stream, **_arrays(session))
    _write(_words(session), folder / WORDS)
    left = ""
    if whole:
        result, left = _with_found(session)
        result.save(session.file)
        written.append(session.file.name)
        if (folder / SUMMARY).exists():
            _write(result.summary(), folder / SUMMARY)
            written.append(SUMMARY)
    session.saved = known
    return f"wrote {', '.join(written)} in {folder}{left}"


def _write(table: Mapping[str, object], path: Path) -> None:
    with replaced(path) as stream:
        stream.write((json.dumps(table, indent=2) + "\n").encode("utf-8"))


def _arrays(session: Session) -> dict[str, Any]:
    """All grasps that have been added, one a row, and the indices at the grasps that the page opened with."""
    size = session.result.atlas.system.configuration_size
    added = session.added
    columns = {
        "x": np.concatenate([np.zeros((0, size)), *(one.grasps.x for one in added)]),
        "charts": np.concatenate([np.zeros(0, np.int64), *(one.grasps.charts for one in added)]),
        "qualities": np.concatenate([np.zeros(0), *(one.qualities for one in added)]),
        "accepted": np.concatenate([np.zeros(0, bool), *(one.accepted for one in added)]),
        "sample": np.concatenate([np.zeros(0, bool), *(np.full(len(one), one.climb is None) for one in added)]),
        "all_motions": np.concatenate([np.zeros(0, bool), *(np.full(len(one), one.all_motions) for one in added)]),
    }
    n = session.result.atlas.n_charts
    return columns | {f"index_{name}": values[:n] for name, values in session.others.items()}


def _words(session: Session) -> dict[str, object]:
    climbs = [
        {
            "chart": int(one.grasps.charts[0]),
            "quality": float(one.qualities[0]),
            "status": one.statuses[0],
            "all_motions": one.all_motions,
            "joints": {name: float(values[0]) for name, values in one.grasps.joint_positions.items()},
            "object_xyz": one.grasps.object_xyz[0].tolist(),
            "object_quat_xyzw": one.grasps.object_quat_xyzw[0].tolist(),
        }
        for one in session.added
        if one.climb is not None
    ]
    return {
        "problem": session.result.problem.name,
        "index": quality_name(session.result.quality),
        "n_samples": sum(len(one) for one in session.added if one.climb is None),
        "indices": list(session.others),
        "climbs": climbs,
        "trials": [{"grasp": number, **trial.summary()} for number, trial in session.trials],
    }


def _with_found(session: Session) -> tuple[Result, str]:
    """The result with the indices and the ends of climbs, and what it cannot take, in words."""
    result = session.result
    n = result.atlas.n_charts
    others = {**result.others, **{name: values[:n] for name, values in session.others.items()}}
    climbs = [one for one in session.added if one.climb is not None]
    free = result.refinement.all_motions if result.refinement else all(one.all_motions for one in climbs)
    fitting = [one for one in climbs if one.all_motions == free]
    refinement = _with_climbs(result, fitting, free) if fitting else result.refinement
    left = len(climbs) - len(fitting)
    where = "in R" if free else "with all motions"
    text = f"; {left} of the climbs, {where}, stand in {ARRAYS} only: a result has one kind" if left else ""
    return replace(result, others=others, refinement=refinement), text


def _with_climbs(result: Result, added: list[Added], free: bool) -> Refinement:
    """The result's refinement with further climbs; those that end in one place count once."""
    old = result.refinement
    ends = [_as_climb(old, i) for i in range(len(old.x))] if old else []
    hits = list(map(int, old.hits)) if old else []
    steps = list(map(int, old.steps)) if old else []
    for one in added:
        assert one.climb is not None
        ends.append(replace(one.climb, chart=int(one.grasps.charts[0])))
        hits.append(1)
        steps.append(one.climb.n_steps)
    peaks = peaks_of(result, ends)
    tops = [max(map(int, peak.climbs), key=lambda i: ends[i].quality) for peak in peaks]
    chosen = [ends[top] for top in tops]
    return Refinement(
        x=np.array([end.x for end in chosen]),
        qualities=np.array([end.quality for end in chosen]),
        starts=np.array([end.chart for end in chosen], np.int64),
        converged=np.array([end.converged for end in chosen], bool),
        stalled=np.array([end.stalled for end in chosen], bool),
        unbounded=np.array([end.unbounded for end in chosen], bool),
        kkt=np.array([end.kkt for end in chosen]),
        hits=np.array([sum(hits[int(i)] for i in peak.climbs) for peak in peaks], np.int64),
        steps=np.array([steps[top] for top in tops], np.int64),
        all_motions=free,
        complete=old.complete if old else False,
        search=old.search if old else None,
    )


def _as_climb(refinement: Refinement, i: int) -> Climb:
    return Climb(
        int(refinement.starts[i]),
        refinement.x[i],
        refinement.qualities[i : i + 1],
        bool(refinement.converged[i]),
        bool(refinement.unbounded[i]),
        float(refinement.kkt[i]),
        bool(refinement.stalled[i]),
    )
