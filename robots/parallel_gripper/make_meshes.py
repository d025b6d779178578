"""Make the meshes of the skittle: ``python robots/parallel_gripper/make_meshes.py``.

Its outline is the cubic spline of the patch that the gripper touches, so that what is seen is what is held. Our own
design, with about the proportions of a bowling pin.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from graspatlas.patches import Revolution

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mesh_tools import Mesh, lathe, merged, turned_solid, write_all

FOLDER = Path(__file__).resolve().parent / "meshes"

#: Outline: heights along y from the centre of mass, and radii there [m].
HEIGHTS = (-0.046, -0.030, -0.010, 0.010, 0.022, 0.034, 0.048, 0.062, 0.070)
RADII = (0.0098, 0.0160, 0.0191, 0.0155, 0.0109, 0.0076, 0.0088, 0.0106, 0.0089)
#: Half way down the waist the outline turns from convex to hollow, and back [m].
HOLLOW = (0.014, 0.054)

SKITTLE = Revolution(heights=HEIGHTS, radii=RADII)
SEGMENTS = 44


def outline(low: float, high: float, count: int) -> list[tuple[float, float]]:
    """Stations and radii of the spline between two heights [m]."""
    return [(float(v), float(SKITTLE.point(0.0, v)[0])) for v in np.linspace(low, high, count)]


def band(low: float, high: float, lift: float = 0.0) -> Mesh:
    """Return a closed body between two heights, perhaps a hair in front of the surface [m]."""
    side = [(y, radius + lift) for y, radius in outline(low, high, max(3, round((high - low) / 0.003)))]
    return lathe([(low, 0.0), *side, (high, 0.0)], SEGMENTS)


def skittle_body() -> Mesh:
    """Return the skittle: its side, a chamfered foot and a round crown."""
    side, crown = outline(HEIGHTS[0], HEIGHTS[-1], 40), np.linspace(0.0, 0.5 * np.pi, 12)[1:]
    radius = side[-1][1]
    top = [(HEIGHTS[-1] + 0.0052 * float(np.sin(a)), radius * float(np.cos(a))) for a in crown]
    foot = [(HEIGHTS[0] - 0.0012, 0.0), (HEIGHTS[0] - 0.0012, side[0][1] - 0.0012)]
    return lathe([*foot, *side, *top], SEGMENTS)


def skittle_stripes() -> Mesh:
    """Return the two stripes about the neck."""
    return merged(band(0.0265, 0.0305, 0.0002), band(0.0375, 0.0415, 0.0002))


def convex(low: float, high: float, count: int = 2) -> Mesh:
    """Return the convex solid over rings of the side, for collision checks."""
    return turned_solid(outline(low, high, count), SIDES)


def slices(name: str, low: float, high: float, count: int, rings: int) -> dict[str, Callable[[], Mesh]]:
    """Return convex solids between two heights, by name."""
    ends = np.linspace(low, high, count + 1)
    return {
        f"skittle_{name}_{i}_convex": partial(convex, float(ends[i]), float(ends[i + 1]), rings) for i in range(count)
    }


VISUAL = {"skittle_body": skittle_body, "skittle_stripes": skittle_stripes}
#: Belly and head, which flat pads can touch, are within 0.025 mm of the spline. A solid has at most 250 corners.
SIDES = 60
COLLISION = {
    **slices("belly", HEIGHTS[0], HOLLOW[0], 7, 4),
    **slices("neck", *HOLLOW, 5, 2),
    **slices("head", HOLLOW[1], HEIGHTS[-1], 3, 4),
}


def main() -> None:
    """Write every mesh of the skittle."""
    write_all(FOLDER, VISUAL, COLLISION)


if __name__ == "__main__":
    main()
