"""A folder that is either replaced as a whole or left as it was."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graspatlas.errors import GraspAtlasError

__all__ = ["MARKER", "report_folder"]

#: File that tells a report of ours from a folder of the user's.
MARKER = ".graspatlas-report"


@contextmanager
def report_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A new folder beside a path, which takes its place when everything went well.

    Args:
        path: Where the report shall be: a new folder, an empty one, or one that holds an earlier report.

    Raises:
        GraspAtlasError: If there is something else, or the report cannot be written.
    """
    target = Path(path).absolute()
    _check(target, path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}."))
    except OSError as error:
        raise _unwritable(path, error) from None
    try:
        yield temporary
        (temporary / MARKER).write_text("Written by graspatlas reproduce, which may replace this folder.\n", "utf-8")
        temporary.chmod(0o755)
        _check(target, path)
        _swap(temporary, target)
    except OSError as error:
        raise _unwritable(path, error) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _check(target: Path, path: str | os.PathLike[str]) -> None:
    """Refuse to replace what is not ours."""
    try:
        if target.is_symlink() or (target.exists() and not target.is_dir()):
            raise GraspAtlasError(f"cannot write the report to '{path}': it is not a folder; choose a new name")
        if target.is_dir() and not (target / MARKER).is_file() and any(target.iterdir()):
            raise GraspAtlasError(
                f"folder '{path}' is not empty and holds no earlier report; nothing was changed: choose a new folder"
            )
    except OSError as error:
        raise _unwritable(path, error) from None


def _swap(temporary: Path, target: Path) -> None:
    """Put a folder in the place of another."""
    if not target.exists():
        temporary.rename(target)
        return
    old = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}."))
    try:
        target.rename(old / "old")
        try:
            temporary.rename(target)
        except BaseException:
            (old / "old").rename(target)
            raise
    finally:
        if target.exists():
            shutil.rmtree(old, ignore_errors=True)


def _unwritable(path: str | os.PathLike[str], error: OSError) -> GraspAtlasError:
    return GraspAtlasError(
        f"cannot write the report to '{path}': {error.strerror or error}; choose a folder that can be written"
    )
