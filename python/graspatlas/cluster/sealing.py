"""What tasks on workers are made of, pickled once, with functions of the user, for the same version of the package."""

from __future__ import annotations

from collections.abc import Mapping

from graspatlas.errors import GraspAtlasError
from graspatlas.version import __version__

__all__ = ["check_version", "sealed"]


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


def check_version(version: str) -> None:
    """Make sure, on a worker, that the process that submits has its version of the package.

    Args:
        version: That of the process that submits.

    Raises:
        GraspAtlasError: If they differ.
    """
    if version != __version__:
        raise GraspAtlasError(
            f"a worker has graspatlas {__version__} and this process {version}: install the same version on both"
        )
