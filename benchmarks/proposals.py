"""Proposals for three hands and five things, and whether the best of them survive a simulator's pushes.

Prints a row for each; a thing counts where at least one proposal's best grasp is accepted and survives.

    python benchmarks/proposals.py [--hands allegro_right_hand ...] [--things mug ...]
"""

from __future__ import annotations

import argparse
import importlib.util
import tempfile
import time
from pathlib import Path

import graspatlas as ga

THINGS = Path(__file__).parents[1] / "examples" / "things"


def hands() -> list[str]:
    """The Allegro and the Schunk hand, and the Shadow hand where gymnasium-robotics is installed."""
    known = ["allegro_right_hand", "schunk_sah"]
    spec = importlib.util.find_spec("gymnasium_robotics")
    if spec and spec.origin:
        known.append(str(Path(spec.origin).parent / "envs" / "assets" / "hand" / "reach.xml"))
    return known


def survivors(found: ga.Proposals) -> int:
    """How many of the proposals' best grasps survive."""
    count = 0
    for each in found.proposals:
        try:
            count += bool(ga.simulate(each.result, protocol="dexgraspbench").held.any())
        except ga.GraspAtlasError as error:
            print(f"    {each.tried.name}: {error}")
    return count


def main() -> None:
    """Try them all."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    words.add_argument("--hands", nargs="+", default=hands())
    words.add_argument("--things", nargs="+", default=sorted(path.stem for path in THINGS.glob("*.stl")))
    words.add_argument("--max-seconds", type=float, default=90.0)
    options = words.parse_args()
    done = 0
    for hand in options.hands:
        for thing in options.things:
            start = time.perf_counter()
            with tempfile.TemporaryDirectory() as folder:
                found = ga.propose(hand, THINGS / f"{thing}.stl", folder, max_seconds=options.max_seconds)
                seconds = time.perf_counter() - start
                survive = survivors(found)
            done += survive > 0
            print(f"{Path(hand).stem:20} {thing:8} {seconds:5.1f} s  {survive} survive; {found.summary()}", flush=True)
    print(f"{done} of {len(options.hands) * len(options.things)}")


if __name__ == "__main__":
    main()
