"""Make the meshes of the cup: ``python robots/three_finger_hand/make_meshes.py``.

Our own design: a paper cup with a rolled rim and a sleeve of cardboard, turned about z.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mesh_tools import Mesh, lathe, turned_solid, write_all

FOLDER = Path(__file__).resolve().parent / "meshes"

#: Heights of bottom and top from the middle, and radii there [m].
HEIGHTS, RADII = (-0.045, 0.045), (0.027, 0.036)
SLEEVE = (-0.024, 0.016)
WALL, COFFEE, BEAD = 0.0008, 0.032, 0.0017
SEGMENTS = 56


def radius(z: float) -> float:
    """Outer radius of the wall at a height [m]."""
    return float(np.interp(z, HEIGHTS, RADII))


def cup_wall() -> Mesh:
    """Return the wall, open at the top down to the coffee, with a rolled rim."""
    (bottom, top), rim = HEIGHTS, np.linspace(-0.4, 1.2 * np.pi, 12)
    bead = [(top + BEAD * float(np.sin(a)), RADII[1] + BEAD * float(np.cos(a))) for a in rim]
    inside = [(top - 0.002, RADII[1] - WALL), (COFFEE, radius(COFFEE) - WALL), (COFFEE, 0.0)]
    return lathe([(bottom, 0.0), (bottom, RADII[0]), (top - 0.002, radius(top - 0.002)), *bead, *inside], SEGMENTS, "z")


def cup_coffee() -> Mesh:
    """Return the coffee."""
    level = COFFEE + 0.0006
    return lathe([(COFFEE, 0.0), (COFFEE, radius(COFFEE) - WALL), (level, radius(level) - WALL), (level, 0.0)], 48, "z")


def cup_sleeve() -> Mesh:
    """Return the sleeve, a hair in front of the wall."""
    low, high = SLEEVE
    return lathe([(low, 0.0), (low, radius(low) + 2e-4), (high, radius(high) + 2e-4), (high, 0.0)], SEGMENTS, "z")


def cup_convex() -> Mesh:
    """Return the convex body for collision checks, within 0.01 mm of the cone."""
    return turned_solid(list(zip(HEIGHTS, RADII, strict=True)), 120, "z")


VISUAL = {"cup_wall": cup_wall, "cup_coffee": cup_coffee, "cup_sleeve": cup_sleeve}
COLLISION = {"cup_convex": cup_convex}


def main() -> None:
    """Write every mesh of the cup."""
    write_all(FOLDER, VISUAL, COLLISION)


if __name__ == "__main__":
    main()
