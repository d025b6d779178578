"""The options of the optimizer: what the user chooses, and the problem's defaults for what is left open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict

from graspatlas.atlas.limits import LimitOptions
from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.problem.problem import Problem
from graspatlas.quality.batched import Quality, quality_name
from graspatlas.quality.evaluation import INDICES, find_index
from graspatlas.requirements.base import RequirementLike

__all__ = ["Choices", "OptimizeOptions", "several_indices", "with_defaults"]


class OptimizeOptions(LimitOptions, total=False):
    """The keywords of :func:`graspatlas.optimize` that :func:`graspatlas.find_components` hands on, as told there."""

    dimension: int | None
    radius: float | None
    epsilon: float | None
    quality: Quality | Sequence[Quality] | None
    require: Sequence[RequirementLike] | None
    refine: bool | str
    refine_steps: int


class Choices(TypedDict):
    """What every atlas and its reading need."""

    dimension: int
    radius: float
    epsilon: float
    quality: Quality | Sequence[Quality]


def with_defaults(
    problem: Problem,
    *,
    dimension: int | None = None,
    radius: float | None = None,
    epsilon: float | None = None,
    quality: Quality | Sequence[Quality] | None = None,
) -> Choices:
    """What was chosen, and the problem's defaults for what is None.

    Raises:
        GraspAtlasError: If neither gives one, or there is no such index.
    """
    if not isinstance(problem, Problem):
        raise GraspAtlasError(f"problem must be a graspatlas.Problem, got {type(problem).__name__}; see load_problem")
    chosen = {"dimension": dimension, "radius": radius, "epsilon": epsilon, "quality": quality}
    options: dict[str, Any] = {
        key: problem.defaults.get(key) if value is None else value for key, value in chosen.items()
    }
    missing = [key for key, value in options.items() if value is None]
    if missing:
        raise GraspAtlasError(f"problem '{problem.name}' has no default for {', '.join(missing)}: give optimize these")
    choices: Choices = {
        "dimension": options["dimension"],
        "radius": options["radius"],
        "epsilon": options["epsilon"],
        "quality": options["quality"],
    }
    several_indices(choices["quality"])
    return choices


def several_indices(quality: Quality | Sequence[Quality]) -> list[Quality]:
    """The indices asked for, each once.

    Raises:
        GraspAtlasError: If there is no such index, one is named twice, or none is.
    """
    if isinstance(quality, list | tuple):
        several: list[Quality] = list(quality)
    elif isinstance(quality, str) or callable(quality):
        several = [quality]
    else:
        raise unknown_name("quality index", quality, INDICES)
    for one in several:
        find_index(one)
    names = [quality_name(one) for one in several]
    if not names or len(set(names)) < len(names):
        raise GraspAtlasError(f"quality must name one index or several different ones, got {names}")
    return several
