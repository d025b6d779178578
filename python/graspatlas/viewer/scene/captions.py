"""What is written beside the grasps: the same words in the picture, in the page and in the live view."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from graspatlas.paths.path import GraspPath
from graspatlas.quality.batched import quality_name
from graspatlas.quality.evaluation import INDICES
from graspatlas.requirements.base import requirement_name
from graspatlas.requirements.rejections import Rejection
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.simulation.recording import Recording
from graspatlas.viewer.scene.clashing import RED
from graspatlas.viewer.scene.scene import COLOURS, Colour, Exhibit, Scene

__all__ = [
    "Caption",
    "caption",
    "index_name",
    "legend",
    "path_text",
    "rejected_by",
    "scene_legend",
    "subtitle",
    "trial_text",
]

#: Motions below this are rounding [mm per rad].
ROUNDING = 1e-6
#: Letters in a line of what requirements have against a grasp.
LETTERS_A_LINE = 46


@dataclass(frozen=True)
class Caption:
    """What is written beside one grasp.

    Attributes:
        title: Such as ``Best grasp``.
        quality: The quality index in words, and its value.
        motion: How far the object moves when the joints turn by one radian (root of the sum of squares): semi-axes.
            Nothing where shapes that collide are drawn in place of that.
        alarms: What requirements have against it, in lines.
    """

    title: str
    quality: str
    motion: str = ""
    alarms: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Lines below the title and the index."""
        return len(self.alarms) + bool(self.motion)


def caption(result: GraspAtlas, exhibit: Exhibit) -> Caption:
    """What is written beside one of the grasps."""
    axes = [1000.0 * axis for axis in exhibit.semi_axes[: result.problem.object_joint_model.translations]]
    reach = ", ".join(f"{axis if axis > ROUNDING else 0.0:.3g}" for axis in axes)
    motion = f"object moves {reach} mm per rad" if max(axes) > ROUNDING else "the joints do not move the object"
    return Caption(
        title=_title(result, exhibit),
        quality=f"{index_name(result)} {exhibit.grasp.quality:.3g}",
        motion="" if exhibit.clash else motion,
        alarms=tuple(line for text in rejected_by(exhibit.rejections) for line in textwrap.wrap(text, LETTERS_A_LINE)),
    )


def rejected_by(rejections: Sequence[Rejection]) -> list[str]:
    """What requirements have against a grasp, in words, one text each."""
    texts = []
    for rejection in rejections:
        name = rejection.requirement.split(":")[0].replace("_", " ")
        texts.append(f"rejected by {name}: {rejection.why}" if rejection.why else f"rejected by {name}")
    return texts


def _title(result: GraspAtlas, exhibit: Exhibit) -> str:
    if exhibit.name == "nearest":
        return f"No grasp is accepted; nearest is chart {exhibit.grasp.chart}"
    if exhibit.name == "chart":
        return f"Chart {exhibit.grasp.chart}" + (", rejected" if exhibit.rejections else "")
    free = result.refinement is not None and result.refinement.all_motions
    return f"{exhibit.name.capitalize()} grasp" + (", all motions free" if free and exhibit.name == "best" else "")


def index_name(result: GraspAtlas) -> str:
    """Name of the quality index, in words."""
    return quality_name(result.quality).replace("_", " ")


def subtitle(result: GraspAtlas) -> str:
    """The problem, the size of its atlas, whether that is complete, and the unit."""
    name = quality_name(result.quality)
    known = name in INDICES and result.quality in (name, INDICES[name])
    unit = "; lengths in mm" if known else ""
    those = ""
    if result.requirements:
        names = ", ".join(requirement_name(r).split(":")[0].replace("_", " ") for r in result.requirements)
        those = f"; {result.accepted.sum()} meet {names}"
    return f"{result.problem.name}: atlas of {result.atlas.n_charts} charts, {result.status}{those}{unit}"


def scene_legend(scene: Scene) -> list[tuple[Colour, str]]:
    """Colours of a scene and what they stand for, those that are in it."""
    groups = {part.group for exhibit in scene.exhibits for part in exhibit.parts}
    entries = [
        (colour, text) for colour, text in legend() if any(COLOURS[group] == colour for group in groups & {*COLOURS})
    ]
    if any(exhibit.clash for exhibit in scene.exhibits):
        entries.append((RED, "striped: shapes that collide"))
    return entries + ([(COLOURS["clash"], "where they are deepest, or nearest")] if "clash" in groups else [])


def path_text(path: GraspPath) -> str:
    """How long a path is, and whether it meets the requirements."""
    those = ""
    if path.result.requirements and path.knows_requirements:
        met = int(path.accepted.sum())
        those = "; all of them meet the requirements" if met == len(path) else f"; {met} of them meet the requirements"
    return f"path of length {path.length:.3g} through {len(path)} grasps{those}"


def trial_text(recording: Recording) -> str:
    """What is tried, and how."""
    protocol = recording.protocol
    index = recording.index.replace("_", " ")
    quality = f", {index} {recording.grasp.quality:.3g}" if index else ""
    push = "a growing push" if recording.growing else f"a push of {protocol.force:g} N"
    return (
        f"{recording.name}{quality}; fingers that squeeze with {recording.normal_force:g} N each in the mean, "
        f"friction {protocol.friction:g}, object of {1e3 * protocol.mass:g} g, {push}"
    )


def legend() -> list[tuple[Colour, str]]:
    """Colours and what they stand for."""
    return [
        (COLOURS["contact"], "contact point"),
        (COLOURS["normal"], "normal, out of the object"),
        (COLOURS["ellipsoid"], "velocities that the joints give the object, not to a common scale"),
    ]
