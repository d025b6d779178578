"""Files that are either written completely or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from graspatlas.errors import GraspAtlasError

__all__ = ["replaced"]


@contextmanager
def replaced(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A temporary file beside a path, which takes its place when everything went well.

    Args:
        path: The path.

    Raises:
        GraspAtlasError: If it cannot be written.
    """
    target = Path(path)
    if target.is_dir():
        raise GraspAtlasError(f"cannot write '{target}': it is a folder; add the name of a file")
    try:
        descriptor, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise _unwritable(target, error) from None
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
        os.chmod(temporary, 0o644)
        os.replace(temporary, target)
    except OSError as error:
        raise _unwritable(target, error) from None
    finally:
        if os.path.exists(temporary):
            os.unlink(temporary)


def _unwritable(target: Path, error: OSError) -> GraspAtlasError:
    return GraspAtlasError(f"cannot write '{target}': {error.strerror or error}; choose a path that can be written")
