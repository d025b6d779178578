"""Instructions that the same work takes with two installations of graspatlas.

`--new PYTHON` and perhaps `--old PYTHON` name them. Valgrind counts, so the figures are nearly the same on any machine
and however busy it is. Imports are counted apart and taken off; one thread works. Prints a table in Markdown; the exit
status is 1 where something takes a tenth more.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile

#: What is run, by name. The first is part of all others.
START = "import graspatlas as ga; problem = ga.load_problem('schunk_can')"
WORK = {
    "import graspatlas": "import graspatlas",
    "load the can's problem": START,
    "its atlas, one thread": "ga.optimize(problem, require=[], max_charts=1500, threads=1)",
    "force closure of 200 grasps": "ga.quality.force_closure_margin(ga.Grasps(problem, [problem.x1_array] * 200))",
    "collisions of 200 grasps": "ga.CollisionFree().met(ga.Grasps(problem, [problem.x1_array] * 200))",
}
#: More than this share of the old count is too much.
LIMIT = 1.1


def instructions(python: str, code: str) -> int:
    """Instructions that a Python runs for some code.

    Raises:
        RuntimeError: If valgrind or the code fails.
    """
    words = [
        "valgrind",
        "--tool=cachegrind",
        "--cache-sim=no",
        f"--cachegrind-out-file={os.devnull}",
        python,
        "-c",
        code,
    ]
    alike = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as elsewhere:
        done = subprocess.run(words, capture_output=True, text=True, cwd=elsewhere, env={**os.environ, **alike})
    found = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
    if done.returncode != 0 or not found:
        raise RuntimeError(f"{python} -c {code!r}: {done.stderr[-2000:]}")
    return int(found[1].replace(",", ""))


def counts(python: str) -> dict[str, int]:
    """Millions of instructions of all work."""
    found = {}
    for name, code in WORK.items():
        alone = code.startswith("import")
        found[name] = instructions(python, code if alone else f"{START}; {code}")
        if not alone:
            found[name] -= found["load the can's problem"]
    return {name: round(count / 1e6) for name, count in found.items()}


def main() -> int:
    """Count, compare and print; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--new", default=sys.executable, help="a Python that knows the version to look at")
    parser.add_argument("--old", help="a Python that knows the one to compare with; left out where it knows none")
    options = parser.parse_args()
    knows = [options.old, "-c", "import graspatlas"] if options.old else ["false"]
    compared = subprocess.run(knows, capture_output=True).returncode == 0
    new, old = counts(options.new), counts(options.old) if compared else {}
    print("| millions of instructions | new |" + (" old | new / old |" if old else ""))
    print("|---|---|" + ("---|---|" if old else ""))
    for name, count in new.items():
        print(f"| {name} | {count} |" + (f" {old[name]} | {count / old[name]:.3f} |" if old else ""))
    if not old:
        print("\nThere is no last release to compare with.")
    return int(any(count > LIMIT * old[name] for name, count in new.items() if old))


if __name__ == "__main__":
    sys.exit(main())
