"""What the page says of the indices: their units, and what each counts."""

from __future__ import annotations

from graspatlas.quality.batched import quality_name
from graspatlas.quality.evaluation import INDICES
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.support.validation import PlainTable

__all__ = ["index_tables", "requirement_label"]

#: Units of the indices, what one counts, and how it follows from the ellipsoid's semi-axes, if it does.
EXPLAINED: dict[str, tuple[str, str, str]] = {
    "manipulability_volume": (
        "lengths in mm",
        "The product of all semi-axes of the ellipsoid of object velocities, translations and rotations together, for "
        "joint velocities of norm one.",
        "product",
    ),
    "smallest_semi_axis": (
        "lengths in mm",
        "The smallest of all semi-axes of the ellipsoid of object velocities: the motion that the joints are worst at.",
        "smallest",
    ),
    "inverse_condition_number": (
        "no unit, lengths in mm",
        "The smallest semi-axis of the ellipsoid of object velocities divided by the largest: 1 is a ball.",
        "ratio",
    ),
    "force_closure_margin": (
        "no unit",
        "How far the contact forces can stay inside their friction cones (friction 0.5) while they balance each "
        "other, normal forces adding up to one; 0 is no force closure.",
        "",
    ),
    "ferrari_canny_epsilon": (
        "no unit",
        "The largest push and twist, from the worst side, that contacts with a total normal force of one resist.",
        "",
    ),
    "soft_finger_epsilon": (
        "no unit",
        "The largest push and twist, from the worst side, that soft fingers with a total normal force of one resist.",
        "",
    ),
    "ferrari_canny_volume": (
        "no unit",
        "The volume of all wrenches that contacts with a total normal force of one exert; 0 without force closure.",
        "",
    ),
    "min_weight": (
        "no unit",
        "The least share of any edge of the friction cones in forces that balance and use all edges, from 0 to 1.",
        "",
    ),
    "grasp_isotropy": (
        "no unit",
        "How evenly contact forces act on the object in all directions: 1 is alike, 0 a direction that is lost.",
        "",
    ),
    "joint_centrality": (
        "no unit",
        "How near the joints are to the middle of their ranges: 1 where all are there, 0 where all are at a limit.",
        "",
    ),
    "holding_force": (
        "N",
        "The largest force on the object's centre of mass, from the worst side, that the grasp withstands.",
        "",
    ),
}


def index_tables(result: GraspAtlas, names: list[str]) -> list[PlainTable]:
    """Name, label, unit, explanation and rule of the indices of a page; of those of the user's own no unit is known."""
    own = quality_name(result.quality)
    tables: list[PlainTable] = []
    for name in names:
        stated = name != own or result.quality in (name, INDICES.get(name))
        unit, text, rule = EXPLAINED[name] if stated and name in EXPLAINED else ("", "An index of your own.", "")
        tables.append({"name": name, "label": name.replace("_", " "), "unit": unit, "text": text, "rule": rule})
    return tables


def requirement_label(name: str) -> str:
    """A requirement in words: ``force closure 0.5, 0.02`` for ``force_closure:0.5:0.02``."""
    first, *rest = name.split(":")
    return f"{first.replace('_', ' ')} {', '.join(rest)}".strip()
