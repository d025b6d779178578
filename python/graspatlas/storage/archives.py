"""Arrays from NPZ archives, whose sizes are looked at before memory is taken. Reading one executes nothing in it."""

from __future__ import annotations

import math
import os
import zipfile
from typing import BinaryIO

import numpy as np

from graspatlas.support.arrays import AnyArray
from graspatlas.support.machine import available_bytes

__all__ = ["DamagedArchive", "read_arrays"]

#: An archive may take this much memory in any case [bytes].
SMALL = 64 * 2**20
#: A larger one may be this many times as large as its file: arrays of measured numbers shrink by a factor below ten.
MOST_RATIO = 50
#: Longest header of an array [bytes].
LONGEST_HEADER = 10_000
#: Most arrays in one archive.
MOST_ARRAYS = 10_000


class DamagedArchive(Exception):
    """What is wrong with an archive, in words."""


def read_arrays(stream: BinaryIO) -> dict[str, AnyArray]:
    """All arrays of an NPZ archive, by name.

    Args:
        stream: The archive; it must be one that can be read from anywhere.

    Raises:
        DamagedArchive: If it is not an archive, is damaged, holds Python objects, or would take more memory than its
            file is worth or than there is.
    """
    try:
        with zipfile.ZipFile(stream) as archive:
            members = archive.infolist()
            _check_sizes(members, os.fstat(stream.fileno()).st_size)
            return {_name(member): _read(archive, member) for member in members}
    except DamagedArchive:
        raise
    except MemoryError:
        raise DamagedArchive("it needs more memory than there is") from None
    except Exception as error:  # a damaged archive fails in many ways
        raise DamagedArchive(f"it is no NPZ archive, or broken ({' '.join(str(error).split())[:100]})") from None


def _check_sizes(members: list[zipfile.ZipInfo], file_size: int) -> None:
    """Refuse archives that are small on the disk alone."""
    if len(members) > MOST_ARRAYS or len({member.filename for member in members}) < len(members):
        raise DamagedArchive(f"it holds more than {MOST_ARRAYS} arrays, or two of one name")
    total = sum(member.file_size for member in members)
    if total > max(SMALL, MOST_RATIO * file_size):
        raise DamagedArchive(
            f"it would unpack to {total / 1e6:,.0f} MB from {file_size / 1e6:,.1f} MB, which no arrays of numbers do"
        )
    if total > max(SMALL, available_bytes()):
        raise DamagedArchive(f"it needs {total / 1e6:,.0f} MB of memory, more than is free")


def _name(member: zipfile.ZipInfo) -> str:
    if not member.filename.endswith(".npy"):
        raise DamagedArchive(f"it holds {member.filename!r:.60}, which is no array")
    return member.filename[: -len(".npy")]


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> AnyArray:
    """One array, once its header fits its size."""
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        if version not in ((1, 0), (2, 0)):
            raise DamagedArchive(f"array {member.filename!r:.60} is written in an unknown way")
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(stream, max_header_size=LONGEST_HEADER)
        header = stream.tell()
    if dtype.hasobject:
        raise DamagedArchive(f"array {member.filename!r:.60} holds Python objects")
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != member.file_size - header:
        raise DamagedArchive(f"array {member.filename!r:.60} is not as large as its header says")
    with archive.open(member) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False, max_header_size=LONGEST_HEADER)
