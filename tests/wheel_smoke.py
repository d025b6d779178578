"""What an installed wheel must do without this repository, a compiler or the network: `python tests/wheel_smoke.py`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

#: Events of Python's own that ask the network for something.
NETWORK = ("socket.connect", "socket.getaddrinfo", "socket.sendto", "urllib.Request")


def refuse_the_network(event: str, arguments: tuple[object, ...]) -> None:
    """End with an error where something is to be fetched."""
    if event in NETWORK:
        raise RuntimeError(f"the wheel asks the network for something: {event}{arguments}")


sys.addaudithook(refuse_the_network)

import graspatlas as ga  # noqa: E402
from graspatlas.cli import main  # noqa: E402


def run(*words: object) -> None:
    """A command that must succeed."""
    status = main([str(word) for word in words])
    if status != 0:
        raise SystemExit(f"graspatlas {' '.join(map(str, words))} ended with status {status}")


def check(what: str, right: bool) -> None:
    """Something that must be so."""
    if not right:
        raise SystemExit(f"the wheel is wrong: {what}")


def smoke(folder: Path) -> None:
    """The can from end to end, the core against what is known of it, and all bundled problems."""
    run("doctor")
    run("list")
    require = ("--require", "force_closure:0.5:0.02", "--require", "collision_free")
    run("optimize", "schunk_can", *require, "--refine", "--output", folder)
    run("view", folder, "--picture", folder / "can.png", "--html", folder / "can.html")
    run("check-result", folder)
    result = ga.load_result(folder)
    check("the can's atlas is complete", str(result.status) == "complete")
    check("as many of its grasps are accepted as ever", 150 < result.accepted.sum() < 260)
    check("its picture is written", (folder / "can.png").stat().st_size > 100_000)
    sphere = ga.build_atlas(ga.systems.Sphere(3), [0.0, 0.0, 1.0], radius=0.2, epsilon=0.2)
    check("a sphere has the area of a sphere", abs(float(sphere.volumes.sum()) - 12.57) < 0.5)
    for name in ga.bundled_problems():
        problem = ga.load_problem(name)
        check(f"{name} grows", ga.optimize(problem, max_charts=20, require=[]).atlas.n_charts >= 20)
    check("the package is typed", (Path(ga.__file__).parent / "py.typed").is_file())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        smoke(Path(temporary))
    print("the wheel works")
