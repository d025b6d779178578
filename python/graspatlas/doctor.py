"""What a bug report needs: what is installed, missing or in the way. It works where the compiled core does not load.

Only Python's own library is imported here, and nothing is told that names a user or a computer.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

from graspatlas.libraries import PINS, in_the_way, other_versions
from graspatlas.version import __version__

__all__ = ["NOTE", "OK", "PROBLEM", "Finding", "as_json", "examine", "main", "report", "status", "versions"]

OK, NOTE, PROBLEM = "ok", "note", "problem"
#: Distributions that the package needs, besides the pinned libraries.
NEEDED = (
    *("numpy", "scipy", "pydantic", "PyYAML", "pillow", "matplotlib", "meshcat", "tqdm", "typing_extensions"),
    *("pin", "coal", "example-robot-data"),
)
#: Distributions of the extras, and the extra that brings each.
EXTRAS = {
    "mujoco": "mujoco",
    "trimesh": "mesh",
    "dask": "sweep",
    "pyarrow": "sweep",
    "pandas": "tables",
    "jupyterlab": "notebook",
    "robot_descriptions": "hands",
}
#: Variables of the environment that change what is loaded, and how many threads work.
VARIABLES = (
    *("LD_LIBRARY_PATH", "LD_PRELOAD", "DYLD_LIBRARY_PATH", "PYTHONPATH", "CONDA_PREFIX", "ROS_DISTRO"),
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"),
)


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        mark: ``"ok"``, ``"note"`` or ``"problem"``.
        subject: What it is about.
        text: What was found, and what to do about it.
    """

    mark: str
    subject: str
    text: str


def versions() -> str:
    """Versions of the package and of what it stands on, in one line."""
    stands_on = [f"Python {platform.python_version()}"]
    stands_on += [f"{name} {_version(name) or 'not found'}" for name in (*PINS, "numpy", "scipy")]
    return f"graspatlas {__version__} ({', '.join(stands_on)}; {platform.system()} {platform.machine()})"


def examine(error: ImportError | None = None) -> list[Finding]:
    """Look at everything.

    Args:
        error: Why the compiled core could not be loaded, if it could not.
    """
    return [*_system(), *_libraries(error), *_packages(), *_surroundings(), *_resources()]


def report(findings: Sequence[Finding]) -> str:
    """The findings as text, one line each."""
    width = max(len(finding.subject) for finding in findings)
    return "\n".join(f"{f.mark:8}{f.subject:{width}}  {f.text}" for f in findings)


def as_json(findings: Sequence[Finding]) -> str:
    """The findings as a list of JSON objects."""
    return json.dumps([asdict(finding) for finding in findings])


def status(findings: Sequence[Finding]) -> int:
    """Exit status: 1 if anything is wrong."""
    return int(any(finding.mark == PROBLEM for finding in findings))


def main(error: ImportError) -> int:
    """Print what was found where the compiled core could not be loaded; the exit status."""
    findings = examine(error)
    print(as_json(findings) if "--json" in sys.argv[2:] else report(findings))
    return status(findings)


def _system() -> Iterator[Finding]:
    yield Finding(OK, "graspatlas", f"{__version__} in {_homeless(Path(__file__).parent)}")
    python = f"{platform.python_implementation()} {platform.python_version()}"
    kind = "a virtual environment" if sys.prefix != sys.base_prefix else "no virtual environment"
    yield Finding(OK, "Python", f"{python} in {_homeless(sys.prefix)}, {kind}")
    libc = " ".join(platform.libc_ver())
    yield Finding(OK, "system", f"{platform.system()} {platform.release()}, {platform.machine()}, {libc}".rstrip(", "))


def _libraries(error: ImportError | None) -> Iterator[Finding]:
    """The compiled core and the libraries that it is linked with."""
    if error is None:
        yield Finding(OK, "compiled core", "it loads")
    else:
        yield Finding(PROBLEM, "compiled core", " ".join(str(error).split()))
    others = other_versions()
    for name, pin in PINS.items():
        if name in others:
            yield Finding(PROBLEM, name, f"{others[name]}, but {pin} is needed: pip install {name}=={pin}")
        elif _version(name):
            yield Finding(OK, name, f"{pin}, as the core was compiled with")
        else:
            yield Finding(NOTE if error is None else PROBLEM, name, f"not installed by pip; {pin} is needed")


def _packages() -> Iterator[Finding]:
    for name in NEEDED:
        version = _version(name)
        yield Finding(OK, name, version) if version else Finding(PROBLEM, name, f"missing: pip install {name}")
    for name, extra in EXTRAS.items():
        version = _version(name)
        missing = f"not installed, which only some things need: pip install 'graspatlas[{extra}]'"
        yield Finding(OK, name, version) if version else Finding(NOTE, name, missing)


def _surroundings() -> Iterator[Finding]:
    """What may be taken for a part of this installation and is not."""
    for path in in_the_way():
        text = f"{_homeless(path)} belongs to another installation; graspatlas takes its own when it is imported first"
        yield Finding(NOTE, "in the way", text)
    for name in VARIABLES:
        value = os.environ.get(name)
        if value:
            yield Finding(NOTE, name, os.pathsep.join(map(_homeless, value.split(os.pathsep))))


def _resources() -> Iterator[Finding]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    yield Finding(OK, "threads", f"{cores} of {os.cpu_count()} processors may be used")
    memory = _memory()
    if memory:
        yield Finding(OK, "memory", memory)


def _memory() -> str:
    """Memory of the machine, and of the container if there is one."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return ""
    kilobytes = {line.split(":")[0]: float(line.split()[1]) for line in lines if len(line.split()) > 1}
    text = f"{kilobytes['MemAvailable'] / 2**20:.1f} of {kilobytes['MemTotal'] / 2**20:.1f} GiB are free"
    try:
        limit = Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii").strip()
    except OSError:
        return text
    return text if limit == "max" else f"{text}; the container may take {float(limit) / 2**30:.1f} GiB"


def _version(distribution: str) -> str:
    """Version of a distribution; nothing where it is not installed."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return ""


def _homeless(path: str | Path) -> str:
    """A path that does not tell whose it is."""
    home = str(Path.home())
    return f"~{str(path)[len(home) :]}" if len(home) > 1 and str(path).startswith(home) else str(path)
