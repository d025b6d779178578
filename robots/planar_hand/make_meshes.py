"""Make the meshes of the planar hand and its object: ``python robots/planar_hand/make_meshes.py``.

Everything is a flat plate whose outline is the convex hull of discs. The plates lie in layers: the palm's frame at the
back, then the proximal phalanges, and at z = 0 the distal ones and the object, so that no layer is in another's way.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mesh_tools import Array, Mesh, convex_hull, hull_mesh, write_all

FOLDER = Path(__file__).resolve().parent / "meshes"

# Kinematics, as in the URDF and the problem file [m, rad] -------------------------------------------

ANCHORS = np.array([[0.0, 0.1], [-0.0866025, -0.05], [0.0866025, -0.05]])
PROXIMAL = {"first": 0.062, "second": 0.055, "third": 0.060}
DISTAL = {"first": 0.033, "second": 0.038, "third": 0.030}
ARC_CENTERS = np.array([[0.0, 0.015], [-0.0129904, -0.0075], [0.0129904, -0.0075]])
ARC_RADII = np.array([0.020, 0.016, 0.024])
ARCS = {
    "first": (0.7307963267948966, 2.4107963267948964),
    "second": (2.8251914291880924, 4.505191429188092),
    "third": (4.919586531581287, 6.599586531581287),
}

# Shapes, our own design [m] -----------------------------------------------------------------------

#: Heights of the layers.
PALM_Z = (-0.0215, -0.0160)
PROXIMAL_Z = (-0.0140, -0.0075)
DISTAL_Z = (-0.0050, 0.0050)
PAD_Z = (-0.0056, 0.0056)
OBJECT_Z = (-0.0060, 0.0060)
RIM_Z = (-0.0066, 0.0066)
#: Radii of the palm's corners outside and inside, and where the inner corners are as a share of the anchors.
CORNER, HOLE, HOLE_SHARE = 0.013, 0.008, 0.80
#: Half widths of the phalanges at their joints, of a distal one near its tip, and of the pad on it.
BASE, ELBOW, NECK, PAD = 0.0085, 0.0065, 0.0034, 0.0042
#: Length of the pad, depth of the coloured rims and how far the object's body stays behind them.
PAD_LENGTH, RIM_DEPTH, RIM_STEP = 0.0110, 0.0034, 0.0004
#: How far inside its rounded edge a face is flat.
FACE_STEP = 0.0003
#: Angle between the points of a round corner [rad].
ARC_STEP = np.deg2rad(7.5)


def hull_arcs(centers: Array, radii: Array) -> list[tuple[int, float, float]]:
    """Return for each disc, counter-clockwise, the normal angles where its arc of the hull begins and ends."""
    turns = []
    for i in range(len(centers)):
        j = (i + 1) % len(centers)
        along = centers[j] - centers[i]
        lean = np.arccos((radii[i] - radii[j]) / np.linalg.norm(along))
        turns.append(np.arctan2(along[1], along[0]) - lean)
    return [(i, turns[i - 1], turns[i - 1] + (turns[i] - turns[i - 1]) % (2.0 * np.pi)) for i in range(len(centers))]


def outline(centers: Array, radii: Array, inset: float = 0.0, step: float = ARC_STEP) -> Array:
    """Return the hull of discs given counter-clockwise, shape (n, 2); the same n for every inset."""
    points = []
    for i, start, end in hull_arcs(centers, radii):
        # A multiple of 4 intervals puts a vertex on the tip of a symmetric arc.
        angle = np.linspace(start, end, 4 * max(1, round((end - start) / step / 4.0)) + 1)
        points.append(centers[i] + (radii[i] - inset) * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.vstack(points)


def woven(rings: Array, ring_of_rings: bool = False) -> Mesh:
    """Return the surface through closed rings, shape (rows, columns, 3), capped by fans or joined to a ring."""
    rows, columns, _ = rings.shape
    i, j = np.divmod(np.arange((rows if ring_of_rings else rows - 1) * columns), columns)
    k, n = (j + 1) % columns, (i + 1) % rows
    a, b, c, d = i * columns + j, i * columns + k, n * columns + k, n * columns + j
    vertices, faces = rings.reshape(-1, 3), [np.column_stack([a, b, c]), np.column_stack([a, c, d])]
    if not ring_of_rings:
        j = np.arange(columns)
        k, bottom, top = (j + 1) % columns, rows * columns, rows * columns + 1
        vertices = np.vstack([vertices, rings[0].mean(axis=0), rings[-1].mean(axis=0)])
        faces += [
            np.column_stack([np.full(columns, bottom), k, j]),
            np.column_stack([np.full(columns, top), (rows - 1) * columns + j, (rows - 1) * columns + k]),
        ]
    return Mesh(vertices, np.vstack(faces))


def rounded(z_range: tuple[float, float], edge: float) -> list[tuple[float, float]]:
    """Return heights and insets of a rounded edge, from inside the bottom face to inside the top face."""
    angle = np.linspace(0.0, np.pi / 2.0, 3)
    low = [(z_range[0] + edge * (1.0 - np.sin(a)), edge * (1.0 - np.cos(a))) for a in angle[::-1]]
    high = [(z_range[1] - edge * (1.0 - np.sin(a)), edge * (1.0 - np.cos(a))) for a in angle]
    # A row within each face keeps the shading of the edge out of the middle.
    return [(z_range[0], edge + FACE_STEP), *low, *high, (z_range[1], edge + FACE_STEP)]


def level(points: Array, z: float) -> Array:
    """Return points of the plane at a height, shape (n, 3)."""
    return np.column_stack([points, np.full(len(points), z)])


def plate(centers: Array, radii: Array, z_range: tuple[float, float], edge: float = 0.0010) -> Mesh:
    """Return the hull of discs as a plate with rounded edges."""
    return woven(np.stack([level(outline(centers, radii, inset), z) for z, inset in rounded(z_range, edge)]))


def plate_hull(centers: Array, radii: Array, z_range: tuple[float, float], step: float = np.deg2rad(30.0)) -> Mesh:
    """Return the hull of discs as a convex body with few vertices, its facets half a sagitta outside and inside."""
    points = outline(centers, radii, step=step)
    return convex_hull(np.vstack([level(points, z) for z in z_range]))


def palm_outlines(inset: float, step: float = ARC_STEP) -> tuple[Array, Array]:
    """Return the outer and the inner outline of the palm's frame, drawn in by an inset; points correspond."""
    outer = outline(ANCHORS, np.full(3, CORNER), inset, step)
    inner = outline(HOLE_SHARE * ANCHORS, np.full(3, HOLE), -inset, step)
    return outer, inner


def palm() -> Mesh:
    """Return the frame that joins the anchors."""
    rows = rounded(PALM_Z, 0.0012)
    outer = [level(palm_outlines(inset)[0], z) for z, inset in rows]
    inner = [level(palm_outlines(inset)[1], z) for z, inset in rows]
    return woven(np.stack([*outer, *inner[::-1]]), ring_of_rings=True)


def palm_side() -> Mesh:
    """Return the convex body of the frame's lower side; turned, it is any side."""
    outer, inner = palm_outlines(0.0, np.deg2rad(15.0))
    arc = len(outer) // 3
    side = np.arange(arc + arc // 2, 2 * arc + arc // 2 + 1)
    points = np.vstack([outer[side], inner[side]])
    return convex_hull(np.vstack([level(points, z) for z in PALM_Z]))


def phalanx(length: float) -> tuple[Array, Array]:
    """Return the discs of a proximal phalanx."""
    return np.array([[0.0, 0.0], [length, 0.0]]), np.array([BASE, ELBOW])


def fingertip(length: float) -> tuple[Array, Array]:
    """Return the discs of a distal phalanx without its pad."""
    return np.array([[0.0, 0.0], [length - 0.5 * PAD_LENGTH, 0.0]]), np.array([ELBOW, NECK])


def pad_discs(length: float = 0.0) -> tuple[Array, Array]:
    """Return the discs of the pad that ends at `length`."""
    return np.array([[length - PAD_LENGTH + PAD, 0.0], [length - PAD, 0.0]]), np.array([PAD, PAD])


def distal_hull(length: float) -> Mesh:
    """Return the convex body of a distal phalanx and its pad, inside the cylinder that the URDF has at its tip."""
    joint = outline(*fingertip(length), step=np.deg2rad(22.5))
    pad = outline(*pad_discs(length), step=np.deg2rad(15.0))
    return hull_mesh(np.vstack([level(joint, z) for z in DISTAL_Z] + [level(pad, z) for z in PAD_Z]))


def object_hull() -> Mesh:
    """Return the convex body of the object behind its rims; the arcs themselves are cylinders in the URDF."""
    points = outline(ARC_CENTERS, ARC_RADII - RIM_STEP, step=np.deg2rad(12.0))
    return hull_mesh(np.vstack([level(points, z) for z in RIM_Z]))


def rim(finger: str) -> Mesh:
    """Return the band over the arc that a finger may touch; its middle lies on the arc itself."""
    index = list(ARCS).index(finger)
    u = np.linspace(*ARCS[finger], 25)
    rows = rounded(RIM_Z, 0.0006)
    section = [(z, ARC_RADII[index] - inset) for z, inset in reversed(rows)]
    section += [(z, ARC_RADII[index] - RIM_DEPTH) for z in RIM_Z]
    direction = np.column_stack([np.cos(u), np.sin(u)])
    columns = [level(ARC_CENTERS[index] + r * direction, z) for z, r in section]
    return woven(np.stack(columns, axis=1))


VISUAL = {
    "palm": palm,
    **{f"{name}_proximal": partial(plate, *phalanx(length), PROXIMAL_Z) for name, length in PROXIMAL.items()},
    **{f"{name}_distal": partial(plate, *fingertip(length), DISTAL_Z) for name, length in DISTAL.items()},
    "pad": partial(plate, *pad_discs(), PAD_Z, 0.0018),
    "object_body": partial(plate, ARC_CENTERS, ARC_RADII - RIM_STEP, OBJECT_Z),
    **{f"{name}_rim": partial(rim, name) for name in ARCS},
}

COLLISION = {
    "palm_side_convex": palm_side,
    **{f"{n}_proximal_convex": partial(plate_hull, *phalanx(length), PROXIMAL_Z) for n, length in PROXIMAL.items()},
    **{f"{n}_distal_convex": partial(distal_hull, length) for n, length in DISTAL.items()},
    "object_convex": object_hull,
}


def main() -> None:
    """Write every mesh of the planar hand and its object."""
    write_all(FOLDER, VISUAL, COLLISION)


if __name__ == "__main__":
    main()
