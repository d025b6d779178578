"""What a problem file says of its problem, read without making one: for lists of problems."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspatlas.hand.robot_files import example_robot, find_file
from graspatlas.hand.urdf import mimics, moving_joints
from graspatlas.patches.registry import patch_types
from graspatlas.problem.object_joint import FREE_FLYER, object_joint
from graspatlas.problem_files import documents
from graspatlas.problem_files.mesh_patches import MADE_OF_MESHES
from graspatlas.storage.files import read_text

__all__ = ["Outline", "read_outline"]


@dataclass(frozen=True)
class Outline:
    """A problem in short.

    Attributes:
        description: For people.
        freedoms: Unknowns less contact equations: t, the dimension of all feasible grasps, where no equation follows
            from others.
    """

    description: str
    freedoms: int


def read_outline(text: str, folder: Path | None = None) -> Outline:
    """The outline of a problem, from the text of a file that is known to be right.

    Args:
        text: YAML; see ``docs/problem_files.md``.
        folder: Where relative paths start; the current folder by default.
    """
    data = documents.parse(text).data
    joint = object_joint(data["object"].get("joint", FREE_FLYER.name))
    free = sum(_free_parameters(contact) for contact in data["contacts"])
    equations = len(data["contacts"]) * joint.contact_equations
    freedoms = _actuated_joints(data["hand"], folder) + joint.dof + free - equations
    return Outline(data.get("description", ""), freedoms)


def _actuated_joints(hand: Mapping[str, Any], folder: Path | None) -> int:
    """How many joints move and mimic no other."""
    name = hand.get("example_robot_data")
    urdf = read_text(find_file(example_robot(name) if name else hand["urdf"], folder))
    followers = {mimic.joint for mimic in mimics(urdf)}
    moving = hand.get("joints", moving_joints(urdf))
    return len(set(moving) - set(hand.get("locked", ())) - followers)


def _free_parameters(contact: Mapping[str, Any]) -> int:
    """How many patch parameters of a contact move."""
    known = {cls.kind: cls.parameters for cls in patch_types()} | dict.fromkeys(MADE_OF_MESHES, ("u", "v"))
    sides = ((contact[side]["type"], contact.get(frozen, ())) for side, frozen in _SIDES)
    return sum(name not in frozen for kind, frozen in sides for name in known[kind])


#: The patches of a contact, and what is frozen of each.
_SIDES = (("hand", "hand_frozen"), ("object", "frozen"))
