"""Hands by one word: a file's path, or a name among those that come with the package, example-robot-data and others."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.hand import Hand
from graspatlas.hand.robot_files import (
    MJCF_ENDINGS,
    bundled_hands,
    described_names,
    described_robot,
    example_names,
    example_robot,
    find_file,
    is_mjcf,
)
from graspatlas.storage.files import is_file

__all__ = ["NamedHand", "described_hand", "named_hand"]

EXAMPLE, DESCRIBED = "example_robot_data", "robot_descriptions"


@dataclass(frozen=True)
class NamedHand:
    """A hand, and how a problem file names it.

    Attributes:
        hand: The hand.
        source: The fields of ``hand`` in a problem file: ``{"urdf": path}``, ``{"example_robot_data": name}``, ...;
            paths are those of the files, absolute where these were found.
    """

    hand: Hand
    source: Mapping[str, str]


def named_hand(word: str, root: str | None = None) -> NamedHand:
    """The hand that a word names.

    Args:
        word: Path of a URDF or an MJCF; ``example_robot_data:NAME``; ``robot_descriptions:NAME``; or a bare name of a
            hand that comes with the package, or of one of these two.
        root: The body of an MJCF that is the palm.

    Raises:
        GraspAtlasError: If there is no such hand, or it cannot be read.
    """
    found = _found(word, root)
    if root and "root" not in found.source:
        raise GraspAtlasError(f"root names the palm of an MJCF, and '{word}' is a URDF, which has its own: drop it")
    return found


def _found(word: str, root: str | None) -> NamedHand:
    """The hand that a word names; the root counts where it is an MJCF."""
    kind, _, name = word.partition(":")
    if kind in (EXAMPLE, DESCRIBED) and name:
        return _of_library(kind, name, root)
    if is_file(word):
        path = str(Path(word).resolve())
        return _of_file(path, root)
    looks_like_path = os.sep in word or Path(word).suffix.lower() in (*MJCF_ENDINGS, ".urdf")
    if looks_like_path:
        raise GraspAtlasError(f"file '{word}' does not exist; give a URDF, an MJCF, {EXAMPLE}:NAME or {DESCRIBED}:NAME")
    return _of_name(word, root)


def described_hand(name: str, root: str | None = None) -> Hand:
    """A hand of robot_descriptions, a URDF or an MJCF.

    Raises:
        GraspAtlasError: If there is none, or it cannot be fetched or read.
    """
    path, folders = described_robot(name)
    if is_mjcf(path):
        return Hand.from_mjcf(path, name=name, root=root)
    return Hand.from_urdf(path, name=name, package_paths=folders)


def _of_file(path: str, root: str | None) -> NamedHand:
    if is_mjcf(path):
        return NamedHand(Hand.from_mjcf(path, root=root), {"mjcf": path, **({"root": root} if root else {})})
    return _of_urdf(path)


def _of_urdf(path: str) -> NamedHand:
    """A hand of a URDF, with the SRDF of the same name beside it where there is one."""
    srdf = find_file(path, None).with_suffix(".srdf")
    source = {"urdf": path, **({"srdf": str(Path(path).with_suffix(".srdf"))} if is_file(srdf) else {})}
    return NamedHand(Hand.from_urdf(path, srdf=source.get("srdf")), source)


def _of_library(kind: str, name: str, root: str | None) -> NamedHand:
    if kind == EXAMPLE:
        return NamedHand(Hand.from_urdf(example_robot(name), name=name), {kind: name})
    path = described_robot(name)[0]
    rooted = {"root": root} if root and is_mjcf(path) else {}
    return NamedHand(described_hand(name, root), {kind: name, **rooted})


def _of_name(name: str, root: str | None) -> NamedHand:
    """A hand by its bare name, of the first library that has one."""
    bundled, examples, described = bundled_hands(), example_names(), described_names()
    if name in bundled:
        return _of_urdf(bundled[name])
    if name in examples:
        return _of_library(EXAMPLE, name, root)
    for full in (name, f"{name}_description", f"{name}_mj_description"):
        if full in described:
            return _of_library(DESCRIBED, full, root)
    where = "a file, nor among the hands of the package, example-robot-data and robot_descriptions"
    raise unknown_name("hand", name, {*bundled, *examples, *described}, where)
