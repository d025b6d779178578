"""MuJoCo, where it is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspatlas.errors import GraspAtlasError

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["mujoco_library"]


def mujoco_library() -> ModuleType | Any:
    """The module ``mujoco``, with its rollout.

    Raises:
        GraspAtlasError: If it is not installed.
    """
    try:
        import mujoco
        import mujoco.rollout
    except ImportError:
        raise GraspAtlasError("MuJoCo is not installed: pip install 'graspatlas[mujoco]'") from None
    return mujoco
