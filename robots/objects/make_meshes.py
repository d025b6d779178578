"""Make the meshes of the can and of the oil bottle: ``python robots/objects/make_meshes.py``.

Both are turned about y from their outlines (source: RSS 2011, experiment data released by the
paper's authors), from which the spout's place is too. Where fingers may touch, the outlines follow
the contact surfaces of the same data, from which they differ by up to 0.5 mm. The recesses of the
can, its label and tab and the oil are our own decoration.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mesh_tools import Array, Loft, Mesh, disc, lathe, merged, turned_solid, write_all

FOLDER = Path(__file__).resolve().parent / "meshes"

# Outlines: station y and radius [m] ---------------------------------------------------------------

#: Where fingers touch, the outlines are those of the released contact surfaces: a cylinder and three cones.
CAN_WALL, CAN_BOTTOM_Y, CAN_TOP_Y = 0.02224, -0.03753, 0.0272
CAN_BOTTOM = [(-0.04552, 0.01696), (-0.04283, 0.01740), (-0.04046, 0.02119), (CAN_BOTTOM_Y, CAN_WALL)]
CAN_TOP = [(CAN_TOP_Y, CAN_WALL), (0.02904, 0.02154), (0.03454, 0.01784), (0.03899, 0.01778)]

BOTTLE_FOOT = [(-0.1000, 0.0426), (-0.0978, 0.0468), (-0.0955, 0.0476), (-0.0931, 0.04724)]
BOTTLE_CONE = [(-0.0931, 0.04724), (0.0000, 0.0100)]
BOTTLE_NECK = [(0.0010, 0.0100), (0.0185, 0.0100)]
BOTTLE_COLLAR = [(0.0200, 0.0100), (0.0400, 0.0230), (0.0408, 0.0217)]
BOTTLE_TUBE = [(0.04081, 0.0085), (0.0915, 0.0085)]
BOTTLE_TIP = [(0.0915, 0.0085), (0.1000, 0.0000)]

SEGMENTS = 72


def can_label() -> Mesh:
    """Return the coloured wall of the can."""
    return lathe([(CAN_BOTTOM_Y, 0.0), CAN_BOTTOM[-1], CAN_TOP[0], (CAN_TOP_Y, 0.0)], SEGMENTS)


def can_wave() -> Mesh:
    """Return a wavy band a hair in front of the label."""
    u = np.linspace(-np.pi, np.pi, 96, endpoint=False)
    middle = -0.0060 + 0.0060 * np.sin(2.0 * u)
    half = 0.0045 + 0.0020 * np.cos(2.0 * u + 0.6)
    return merged(
        _band(u, middle - half, middle + half),
        _band(u, middle + half + 0.0016, middle + half + 0.0026),
    )


def _band(u: Array, low: Array, high: Array, radius: float = CAN_WALL + 0.00005) -> Mesh:
    """Return a closed band around y between two heights given over the angle u."""
    inside = radius - 0.0003
    levels = [(low, inside), (low, radius), (high, radius), (high, inside)]
    ring = np.stack([np.column_stack([r * np.sin(u), y, r * np.cos(u)]) for y, r in levels])
    rows, columns = 4, len(u)
    i, j = np.divmod(np.arange(rows * columns), columns)
    k, n = (j + 1) % columns, (i + 1) % rows
    a, b, c, d = i * columns + j, i * columns + k, n * columns + k, n * columns + j
    return Mesh(ring.reshape(-1, 3), np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))


def can_bottom() -> Mesh:
    """Return the aluminium foot with its dome."""
    dome = [
        (-0.0440, 0.0),
        (-0.0441, 0.0070),
        (-0.0446, 0.0120),
        (-0.0451, 0.0155),
        (-0.04552, 0.0162),
    ]
    return lathe([*dome, *CAN_BOTTOM, (-0.0375, 0.0)], SEGMENTS)


def can_top() -> Mesh:
    """Return the aluminium shoulder, the rim and the recessed lid."""
    lid = [
        (0.03899, 0.01700),
        (0.03740, 0.01670),
        (0.03720, 0.01600),
        (0.03750, 0.01500),
        (0.0375, 0.0),
    ]
    return lathe([(CAN_TOP_Y, 0.0), *CAN_TOP, *lid], SEGMENTS)


def can_tab() -> Mesh:
    """Return the pull tab: a rounded plate and its rivet."""
    plate = Loft(
        axis="y",
        exponent=2.6,
        rows=np.array(
            [
                [0.0376, -0.0040, 0.0040, -0.0050, 0.0090],
                [0.0382, -0.0040, 0.0040, -0.0050, 0.0090],
            ]
        ),
    )
    return merged(plate.mesh(3, 36), disc((0.0, 0.0382, 0.0), "y", 0.0005, 0.0016, 0.0003))


def can_hole() -> Mesh:
    """Return the scored opening and the finger hole of the tab, dark against the lid."""
    mouth = Loft(
        axis="y",
        exponent=2.0,
        rows=np.array(
            [
                [0.0373, -0.0060, 0.0060, -0.0130, -0.0030],
                [0.0376, -0.0060, 0.0060, -0.0130, -0.0030],
            ]
        ),
    )
    return merged(mouth.mesh(3, 36), disc((0.0055, 0.0379, 0.0), "y", 0.0004, 0.0024, 0.0001))


def bottle_glass() -> Mesh:
    """Return the glass: base cone, neck and collar."""
    outline = [(-0.1, 0.0), *BOTTLE_FOOT, BOTTLE_CONE[1], *BOTTLE_NECK, *BOTTLE_COLLAR, (0.0408, 0.0)]
    return lathe(outline, SEGMENTS)


def bottle_oil() -> Mesh:
    """Return the oil in the bottle, up to a level below the neck."""
    return lathe(
        [(-0.0975, 0.0), (-0.0975, 0.0440), (-0.0940, 0.0456), (-0.0350, 0.0222), (-0.0350, 0.0)],
        48,
    )


def bottle_tube() -> Mesh:
    """Return the steel pourer: the tube, its conical tip and the spout to the side."""
    tube = lathe([(0.0405, 0.0), (0.0405, 0.0085), *BOTTLE_TUBE, *BOTTLE_TIP[1:]], 56)
    pipe = [
        (0.0040, 0.0030),
        (0.0183, 0.0030),
        (0.0187, 0.0027),
        (0.0187, 0.0022),
        (0.0172, 0.0020),
    ]
    spout = lathe([*pipe, (0.0172, 0.0)], 28, axis="x")
    return merged(tube, spout.moved(np.eye(3), (0.0, 0.0945, 0.0)))


VISUAL = {
    "can_label": can_label,
    "can_wave": can_wave,
    "can_bottom": can_bottom,
    "can_top": can_top,
    "can_tab": can_tab,
    "can_hole": can_hole,
    "bottle_glass": bottle_glass,
    "bottle_oil": bottle_oil,
    "bottle_tube": bottle_tube,
}

#: The wall of the can, and neck, tube and spout of the bottle are cylinders in the URDFs. Neighbours overlap.
COLLISION = {
    "can_bottom_convex": lambda: turned_solid([CAN_BOTTOM[0], *CAN_BOTTOM[2:]], 60),
    "can_top_convex": lambda: turned_solid([*CAN_TOP[:2], CAN_TOP[3]], 60),
    "bottle_foot_convex": lambda: turned_solid([BOTTLE_FOOT[0], *BOTTLE_FOOT[2:], (-0.0915, 0.0460)], 60),
    "bottle_cone_convex": lambda: turned_solid(BOTTLE_CONE, 120),
    "bottle_collar_convex": lambda: turned_solid(BOTTLE_COLLAR, 80),
    "bottle_tip_convex": lambda: turned_solid([(0.0905, BOTTLE_TIP[0][1]), *BOTTLE_TIP], 60),
}


def main() -> None:
    """Write every mesh of the two objects."""
    write_all(FOLDER, VISUAL, COLLISION)


if __name__ == "__main__":
    main()
