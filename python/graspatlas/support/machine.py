"""What the machine, or the container, has to give: cores and memory."""

from __future__ import annotations

from pathlib import Path

from graspatlas._core import available_threads

__all__ = ["available_bytes", "available_threads"]

#: Share of the free memory that work may take.
_MEMORY_SHARE = 0.8


def available_bytes() -> float:
    """Memory that work may take: a share of what the machine, or the container, has free; inf if unknown."""
    free = [size for size in (_free_in_machine(), _free_in_container()) if size is not None]
    return _MEMORY_SHARE * min(free) if free else float("inf")


def _free_in_machine() -> float | None:
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    except OSError:
        pass
    return None


def _free_in_container() -> float | None:
    folder = Path("/sys/fs/cgroup")
    try:
        limit = float((folder / "memory.max").read_text(encoding="ascii"))  # "max" where there is none
        return limit - float((folder / "memory.current").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None
