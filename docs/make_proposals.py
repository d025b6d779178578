"""Make the picture of proposals in gallery.md: the best of each hand with each thing.

First ``python benchmarks/proposals.py --output FOLDER``, then ``python docs/make_proposals.py FOLDER``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

import graspatlas as ga
from graspatlas.viewer.figures.portrait import portrait

PICTURE = Path(__file__).parent / "images" / "proposals.png"
#: Names of the hands, by what their folders are called, and the things.
HANDS = {"allegro_right_hand": "Allegro hand", "schunk_sah": "Schunk hand", "reach": "Shadow hand"}
THINGS = ("mug", "bottle", "drill", "banana", "book")
#: Pixels of a grasp, and of an inch.
PIXELS, DPI = 380, 100


def best_of(folder: Path) -> ga.Result | None:
    """The result with the best grasp of all proposals, as the table ranks them."""
    results = [ga.load_result(path) for path in sorted(folder.glob("*/result.npz"))]
    return max(results, key=lambda each: best_grasp(each).quality or 0.0, default=None)


def best_grasp(result: ga.Result) -> ga.Grasp:
    """Its best grasp."""
    return result.refined_best if result.refinement else result.best


def main() -> None:
    """Draw all of them on one sheet."""
    words = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    words.add_argument("folder", type=Path, help="what benchmarks/proposals.py --output wrote")
    folder = words.parse_args().folder
    size = PIXELS / DPI
    figure = Figure(figsize=(size * len(THINGS), size * 1.1 * len(HANDS)), dpi=DPI, layout="constrained")
    axes = figure.subplots(len(HANDS), len(THINGS))
    for row, (name, hand) in zip(axes, HANDS.items(), strict=True):
        for ax, thing in zip(row, THINGS, strict=True):
            result = best_of(folder / f"{name}-{thing}")
            title = f"{hand}, {thing}"
            if result is not None:
                grasp = best_grasp(result)
                ax.imshow(portrait(result.problem, grasp, width=PIXELS, height=PIXELS))
                title += f": {grasp.quality:.2g} N"
            else:
                ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0), aspect="equal")
                ax.text(0.5, 0.5, "no grasp found", ha="center", va="center", transform=ax.transAxes)
            ax.set_title(title, fontsize=11)
            ax.axis("off")
    figure.savefig(PICTURE)
    Image.open(PICTURE).convert("RGB").quantize(256).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
