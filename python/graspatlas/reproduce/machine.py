"""What the numbers were measured on: versions and processors, nothing that names a computer or a user."""

from __future__ import annotations

import platform
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version

from graspatlas._core import available_threads

__all__ = ["describe_machine"]

#: Names of packages, and of the distributions that carry them.
PACKAGES = {name: name for name in ("graspatlas", "numpy", "scipy", "matplotlib")} | {"pinocchio": "pin"}


def describe_machine() -> dict[str, str | int]:
    """Versions, processor architecture, number of processors and the day."""
    found: dict[str, str | int] = {"python": platform.python_version()}
    for name, distribution in PACKAGES.items():
        try:
            found[name] = version(distribution)
        except PackageNotFoundError:
            found[name] = "unknown"
    found["system"] = f"{platform.system()} {platform.machine()}"
    found["processors"] = available_threads()
    found["day"] = datetime.now(timezone.utc).strftime("%Y-%m-%d")
    return found
