"""A problem file to start from: what is known of a hand filled in, what only the user knows marked."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from graspatlas.hand.hand import Hand
from graspatlas.hand.named_hands import named_hand
from graspatlas.hand.robot_files import find_file, robots_folder
from graspatlas.patches.registry import patch_types
from graspatlas.problem_files.mesh_patches import MADE_OF_MESHES
from graspatlas.problem_files.reading import FILL_IN

__all__ = ["problem_template"]

_HEAD = """\
# yaml-language-server: $schema=problem.schema.json
# (graspatlas schema --output problem.schema.json writes it; editors then complete and check this file)
#
# Fill in what says {blank}; graspatlas check names what is left. Lengths are in metres, angles in radians.
name: {name}
description: ""

hand:
  {source}
  # srdf: my_hand.srdf # pairs of links that may touch one another
  # joints: [...] # only these move; or lock some, at these positions:
  # locked: {{{first}: 0.0}}
  # enlarge_limits: 0.0
  # Joints and their limits:
{joints}
  # Frames that a contact can sit on:
{frames}

{object}
  # pose_guess: {{xyz: [0, 0, 0.1], quat_xyzw: [0, 0, 0, 1]}} # about where it is held, in the palm's frame; without x1

# A contact: a patch of the hand touches a patch of the object, and their normals oppose.
contacts:
{contacts}
"""

_CONTACT = """\
  - frame: {blank} # one of the frames above
    hand:
      type: point
      position: {blank} # [x, y, z] in that frame
      normal: {blank} # [x, y, z], out of the finger
    object:
      type: {blank} # {kinds}; then its fields, such as radius and axis of a cylinder
    # frozen: {{u: 0.0, v: 0.0}} # parameters of the object's patch that stay
"""

_TAIL = """
# Hand motions, of which the least important are frozen so that k dimensions stay: recorded postures, or couplings.
# hand_motions:
#   samples: postures.csv # joint names in the first row
#   couplings:
#     - {{{first}: 1, {second}: -0.7}} # this sum keeps its value

# A first grasp. Positions here are in the middle of the limits.
# x1:
#   joints:
{posture}
#   object_xyz: [0, 0, 0.1] # in the palm's frame
#   object_quat_xyzw: [0, 0, 0, 1]

length_scale: 0.01 # a shift of this length counts as much as a turn of one radian

defaults:
  dimension: 2 # k
  radius: 0.2 # r, of a chart [rad, and lengths / length_scale]; halve it until the best grasp no longer changes
  epsilon: 0.5
  quality: manipulability_volume

requirements:
  - force_closure: {{friction: 0.5, margin: 0.02}}
  - collision_free
"""


def problem_template(
    hand: str, object_file: str | None = None, *, folder: Path | None = None, root: str | None = None
) -> str:
    """Text of a problem file for a hand, with joints and frames listed and ``FILL_IN`` where the user must decide.

    Args:
        hand: Path of the hand's URDF or MJCF, ``example_robot_data:NAME``, ``robot_descriptions:NAME``, or a name among
            these and the hands of the package.
        object_file: Path of a URDF or a mesh of the object.
        folder: Where the file will be, so that paths are stated relative to it.
        root: The body of an MJCF that is the palm.

    Raises:
        GraspAtlasError: If the hand cannot be read.
    """
    whole, source = _hand(hand, folder, root)
    joints = list(whole.mechanism.actuated)
    head = _HEAD.format(
        blank=FILL_IN,
        name=f"my_{whole.name}",
        source=source,
        first=joints[0],
        joints="\n".join(_joint_lines(whole)),
        frames="\n".join(f"  #   {line}" for line in _rows(whole.frames)),
        object=_object(object_file, folder),
        contacts="\n".join([_contact()] * 3).rstrip("\n"),
    )
    posture = "\n".join(f"#     {name}: {value:.4g}" for name, value in _middle(whole).items())
    return head + _TAIL.format(first=joints[0], second=joints[-1], posture=posture)


def _contact() -> str:
    return _CONTACT.format(blank=FILL_IN, kinds=", ".join([*(cls.kind for cls in patch_types()), *MADE_OF_MESHES]))


def _hand(word: str, folder: Path | None, root: str | None) -> tuple[Hand, str]:
    """The hand, and the lines of the file that name it."""
    found = named_hand(word, root)
    stated = {
        field: _relative(value, folder) if field in ("urdf", "mjcf") else value for field, value in found.source.items()
    }
    return found.hand, "\n  ".join(f"{field}: {value}" for field, value in stated.items())


def _relative(path: str, folder: Path | None) -> str:
    """A file relative to a folder; those of the package as they are."""
    found = find_file(path, Path())
    bundled = not Path(path).is_absolute() and found == robots_folder() / path
    return path if bundled else os.path.relpath(found, folder or Path())


def _object(path: str | None, folder: Path | None) -> str:
    if path is None:
        return (
            "# The object: one of urdf, mesh, sphere, box and cylinder (along z).\n"
            f"object:\n  urdf: {FILL_IN} # path of a URDF; or instead\n"
            "  # mesh: my_object.stl\n  # scale: 0.001 # from millimetres\n"
            "  # cylinder: {radius: 0.03, length: 0.1}"
        )
    if path.endswith(".urdf"):
        return f"object:\n  urdf: {_relative(path, folder)}"
    return f"object:\n  mesh: {_relative(path, folder)}\n  scale: 1.0 # from the mesh's unit to metres"


def _joint_lines(hand: Hand) -> list[str]:
    width, followers = max(map(len, hand.joints)), hand.mechanism.followers
    lines = []
    for name, (lower, upper) in hand.limits_by_name.items():
        mimic = followers.get(name)
        follows = f", mimics: {mimic}" if mimic else ""
        lines.append(f"  #   {name:{width}}  [{lower:.4g}, {upper:.4g}]{follows}")
    if followers:
        lines.append("  # Joints that mimic others follow them by themselves: x1 and hand_motions may leave them out.")
    return lines


def _middle(hand: Hand) -> dict[str, float]:
    """The middle of where each joint can be that mimics no other, 0 where that has no two ends."""
    ranges = hand.mechanism.ranges(hand.limits_by_name)
    return {name: 0.5 * (low + high) if np.isfinite(high - low) else 0.0 for name, (low, high) in ranges.items()}


def _rows(names: Iterable[str], width: int = 100) -> list[str]:
    """Names in lines of about this many characters."""
    rows, row = [], ""
    for name in names:
        if row and len(row) + len(name) > width:
            rows.append(row + ",")
            row = ""
        row += (", " if row else "") + name
    return [*rows, row]
