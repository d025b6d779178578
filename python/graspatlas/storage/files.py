"""Files that are either written completely or not at all, tables in them, folders for them; and files to be read."""

from __future__ import annotations

import csv
import io
import os
import secrets
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from graspatlas.errors import GraspAtlasError

__all__ = [
    "checked_target",
    "is_file",
    "is_folder",
    "opened",
    "read_text",
    "replaced",
    "stated_path",
    "writable_folder",
    "write_csv",
]

#: Longest text that is read [bytes]: those of problems, URDFs and SRDFs are a thousand times shorter.
LONGEST_TEXT = 64 * 2**20
#: What a path may lead to besides a file and a folder.
_KINDS = (
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
)


def stated_path(path: str | os.PathLike[str], verb: str) -> Path:
    """A path that says something.

    Args:
        path: What came.
        verb: What is to be done with it, for the message.

    Raises:
        GraspAtlasError: If it is empty or no path.
    """
    try:
        text = os.fspath(path)
    except TypeError:
        text = None
    if not isinstance(text, str):
        raise GraspAtlasError(f"cannot {verb} {path!r:.60}: a path is a text or a pathlib.Path")
    if not text:
        raise GraspAtlasError(f"cannot {verb} '': the path is empty; name a place")
    return Path(text)


def is_file(path: str | os.PathLike[str]) -> bool:
    """Whether a path leads to a file; one that is too long or holds a null does not."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def is_folder(path: str | os.PathLike[str]) -> bool:
    """Whether a path leads to a folder; one that is too long or holds a null does not."""
    try:
        return stat.S_ISDIR(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def checked_target(path: str | os.PathLike[str]) -> Path:
    """Where a file that is written to a path will stand: at the end of symbolic links, if it is one.

    Args:
        path: The path; there may be a file, or nothing yet.

    Raises:
        GraspAtlasError: If it is empty or not the path of a file: a folder, a device, a pipe, a socket.
    """
    target = stated_path(path, "write")
    try:
        kind = _kind(os.stat(target).st_mode)
    except FileNotFoundError:
        kind = "a file"
    except (OSError, ValueError) as error:
        raise _unwritable(target, error) from None
    if kind == "a folder":
        raise GraspAtlasError(f"cannot write '{target}': it is a folder; add the name of a file")
    if kind != "a file":
        raise GraspAtlasError(f"cannot write '{target}': it is {kind}, not a file; choose the path of a file")
    return Path(os.path.realpath(target))


@contextmanager
def replaced(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A temporary file beside a path, which takes its place when everything went well.

    Symbolic links stay, and what they point to is replaced. A new file has the rights that the user's other files have.

    Args:
        path: The path.

    Raises:
        GraspAtlasError: If it cannot be written, or is a folder, a device, a pipe or a socket.
    """
    target = checked_target(path)
    temporary = target.parent / f".graspatlas-{secrets.token_hex(8)}"
    try:
        descriptor = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0), 0o666)
    except OSError as error:
        raise _unwritable(Path(path), error) from None
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
        if target.exists():
            os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
        os.replace(temporary, target)
    except OSError as error:
        raise _unwritable(Path(path), error) from None
    finally:
        if os.path.exists(temporary):
            os.unlink(temporary)


@contextmanager
def opened(path: str | os.PathLike[str], what: str = "file") -> Iterator[BinaryIO]:
    """A file to be read from anywhere within it.

    Args:
        path: The path.
        what: What it should hold, for messages.

    Raises:
        GraspAtlasError: If it is empty or not the path of a file, such as that of a pipe.
        OSError: If there is none, or it cannot be read.
    """
    source = stated_path(path, "read")
    try:
        kind = _kind(os.stat(source).st_mode)
    except ValueError as error:
        raise GraspAtlasError(f"cannot read {what} '{source}': {error}; correct the path") from None
    if kind not in ("a file", "a folder"):  # a folder says so when it is opened
        raise GraspAtlasError(
            f"cannot read {what} '{source}': it is {kind}, which allows no random access; save it as a regular file"
        )
    with open(source, "rb") as stream:
        yield stream


def read_text(path: str | os.PathLike[str], encoding: str = "utf-8") -> str:
    """The text of a file that is not too long to be one that somebody wrote; pipes are read to their end.

    Args:
        path: The path.
        encoding: Of its letters.

    Raises:
        OSError: If it cannot be read, or is longer than ``LONGEST_TEXT``.
        ValueError: If it holds other bytes, or the path cannot be one.
    """
    with open(path, "rb") as stream:
        content = stream.read(LONGEST_TEXT + 1)
    if len(content) > LONGEST_TEXT:
        raise OSError(f"it is longer than {LONGEST_TEXT // 2**20} MiB")
    return io.TextIOWrapper(io.BytesIO(content), encoding=encoding).read()


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder, and make sure that files can be written there.

    Raises:
        GraspAtlasError: If they cannot.
    """
    folder = stated_path(path, "write to folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise GraspAtlasError(f"cannot write to folder '{folder}': {reason}; choose another") from None
    return folder


def write_csv(path: str | os.PathLike[str], columns: Mapping[str, Iterable[object]]) -> None:
    """Write a table as CSV: a row of names, then one row an entry; UTF-8, commas, a dot in numbers.

    Numbers have as many digits as it takes to read the same ones back; flags are ``true`` and ``false``, and a NaN
    leaves its cell empty.

    Args:
        path: Such as ``"path.csv"``; an existing file is replaced.
        columns: Columns of one length, by name.

    Raises:
        GraspAtlasError: If the file cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    plain = [column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values()]
    table.writerows([_cell(value) for value in row] for row in zip(*plain, strict=True))
    with replaced(path) as stream:
        stream.write(text.getvalue().encode("utf-8"))


def _cell(value: object) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value != value else value


def _kind(mode: int) -> str:
    """What a path leads to."""
    if stat.S_ISREG(mode):
        return "a file"
    if stat.S_ISDIR(mode):
        return "a folder"
    return next((kind for is_kind, kind in _KINDS if is_kind(mode)), "something else")


def _unwritable(target: Path, error: OSError | ValueError) -> GraspAtlasError:
    reason = getattr(error, "strerror", None) or error
    return GraspAtlasError(f"cannot write '{target}': {reason}; choose a path that can be written")
