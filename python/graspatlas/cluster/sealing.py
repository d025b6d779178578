"""What tasks on workers are made of: pickled once, and opened once by a worker of the same version of the package."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from graspatlas.errors import GraspAtlasError
from graspatlas.version import __version__

__all__ = ["opened", "sealed"]

#: What a worker keeps open, with what it has read and computed for it.
KEPT = 2


def sealed(whole: object, functions: Mapping[str, object], instead: str) -> bytes:
    """Anything for other processes, functions of the user by cloudpickle.

    Args:
        whole: What is sent.
        functions: The parts of it that a user may have written, by what messages call them.
        instead: What to do where one cannot be pickled, such as "search without workers".

    Raises:
        GraspAtlasError: If a function cannot be pickled.
    """
    import cloudpickle

    for name, part in functions.items():
        try:
            cloudpickle.dumps(part)
        except Exception as error:
            raise GraspAtlasError(
                f"{name} cannot be sent to workers ({type(error).__name__}: {error}): let it hold plain data alone, "
                f"and open what it needs when it is called; or {instead}"
            ) from None
    return bytes(cloudpickle.dumps(whole))


def opened(version: str, whole: bytes) -> Any:
    """What was sealed, the same object at every call: to read a hand and its meshes takes long.

    Args:
        version: That of the process that sealed it.
        whole: It, sealed.

    Raises:
        GraspAtlasError: If this process, a worker, has another version.
    """
    if version != __version__:
        raise GraspAtlasError(
            f"a worker has graspatlas {__version__} and this process {version}: install the same version on both"
        )
    return _unpickled(whole)


@lru_cache(maxsize=KEPT)
def _unpickled(whole: bytes) -> Any:
    return pickle.loads(whole)
