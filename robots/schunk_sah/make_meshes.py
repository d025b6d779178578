"""Make the meshes of the Schunk hand: ``python robots/schunk_sah/make_meshes.py``.

The bodies are lofted through tables of cross-sections (source: RSS 2011, experiment data released
by the paper's authors), changed here and there; rounding, joints and covers are our own design.
Finger bodies are in the frame of their link: x along the finger, z to the side it closes to. The
palm's z points to the fingers, its x to the side they close to.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mesh_tools import (
    Array,
    Loft,
    Mesh,
    convex_hull,
    cushion,
    disc,
    hull_mesh,
    lathe,
    merged,
    write_all,
)

FOLDER = Path(__file__).resolve().parent / "meshes"

# Bodies: station, then minimum and maximum of the two other axes [m] ------------------------------

PROXIMAL = Loft(
    axis="x",
    exponent=[3.5, 3.5, 3.5, 3.2, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0],
    rows=np.array(
        [
            [-0.0067, -0.0172, 0.0172, -0.0008, -0.0008],
            [-0.0050, -0.0179, 0.0179, -0.0054, 0.0038],
            [0.0000, -0.0183, 0.0182, -0.0107, 0.0077],
            [0.0100, -0.0185, 0.0184, -0.0195, 0.0133],
            [0.0200, -0.0181, 0.0181, -0.0213, 0.0167],
            [0.0300, -0.0175, 0.0175, -0.0191, 0.0174],
            [0.0400, -0.0166, 0.0166, -0.0173, 0.0168],
            [0.0500, -0.0157, 0.0157, -0.0159, 0.0155],
            [0.0600, -0.0149, 0.0149, -0.0148, 0.0093],
            [0.0640, -0.0138, 0.0138, -0.0110, 0.0060],
            [0.0660, -0.0120, 0.0120, -0.0020, -0.0020],
        ]
    ),
)

PROXIMAL_COVER = Loft(
    axis="x",
    exponent=3.0,
    rows=np.array(
        [
            [0.0100, -0.0185, 0.0184, -0.0195, 0.0143],
            [0.0200, -0.0183, 0.0183, -0.0213, 0.0180],
            [0.0300, -0.0177, 0.0177, -0.0191, 0.0186],
            [0.0400, -0.0168, 0.0168, -0.0173, 0.0180],
            [0.0500, -0.0159, 0.0159, -0.0159, 0.0167],
            [0.0600, -0.0149, 0.0149, -0.0148, 0.0103],
        ]
    ),
)

MEDIAL = Loft(
    axis="x",
    exponent=[3.5, 3.5, 3.5, 3.2, 3.0, 3.0, 3.0],
    rows=np.array(
        [
            [-0.0111, -0.0144, 0.0144, 0.0000, 0.0000],
            [-0.0100, -0.0150, 0.0150, -0.0045, 0.0046],
            [0.0000, -0.0156, 0.0156, -0.0142, 0.0097],
            [0.0100, -0.0145, 0.0144, -0.0151, 0.0126],
            [0.0200, -0.0130, 0.0130, -0.0146, 0.0093],
            [0.0245, -0.0122, 0.0122, -0.0130, 0.0060],
            [0.0270, -0.0110, 0.0110, -0.0030, -0.0030],
        ]
    ),
)

DISTAL = Loft(
    axis="x",
    exponent=[3.2, 3.2, 3.0, 2.8, 2.6, 2.5, 2.4, 2.2, 2.0],
    rows=np.array(
        [
            [-0.0109, -0.0116, 0.0116, 0.0000, 0.0000],
            [-0.0100, -0.0121, 0.0121, -0.0042, 0.0044],
            [-0.0050, -0.0137, 0.0136, -0.0096, 0.0098],
            [0.0000, -0.0141, 0.0141, -0.0136, 0.0111],
            [0.0100, -0.0143, 0.0142, -0.0145, 0.0109],
            [0.0200, -0.0136, 0.0136, -0.0130, 0.0128],
            [0.0300, -0.0120, 0.0120, -0.0118, 0.0109],
            [0.0360, -0.0086, 0.0086, -0.0100, 0.0068],
            [0.0385, 0.0000, 0.0000, -0.0016, -0.0016],
        ]
    ),
)

DISTAL_COVER = Loft(
    axis="x",
    exponent=2.4,
    rows=np.array(
        [
            [0.0080, -0.0144, 0.0144, -0.0145, 0.0123],
            [0.0180, -0.0141, 0.0141, -0.0135, 0.0140],
            [0.0250, -0.0132, 0.0132, -0.0126, 0.0130],
            [0.0285, -0.0126, 0.0126, -0.0121, 0.01265],
            [0.0305, -0.0121, 0.0121, -0.0118, 0.0119],
            [0.0335, -0.0109, 0.0109, -0.0112, 0.0103],
            [0.0355, -0.0098, 0.0098, -0.0106, 0.0087],
            [0.0380, -0.0066, 0.0066, -0.0085, 0.0052],
            [0.0395, 0.0000, 0.0000, -0.0016, -0.0016],
        ]
    ),
)

PALM = Loft(
    axis="z",
    exponent=[3.0, 3.2, 3.5, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0],
    rows=np.array(
        [
            [0.0000, -0.0345, 0.0120, -0.0417, 0.0560],
            [0.0050, -0.0382, 0.0165, -0.0449, 0.0589],
            [0.0200, -0.0418, 0.0200, -0.0515, 0.0593],
            [0.0400, -0.0442, 0.0215, -0.0574, 0.0593],
            [0.0600, -0.0446, 0.0220, -0.0599, 0.0593],
            [0.0800, -0.0431, 0.0222, -0.0596, 0.0593],
            [0.1000, -0.0408, 0.0214, -0.0591, 0.0593],
            [0.1200, -0.0381, 0.0205, -0.0593, 0.0593],
            [0.1300, -0.0368, 0.0185, -0.0585, 0.0585],
            [0.1380, -0.0357, 0.0138, -0.0545, 0.0545],
            [0.1420, -0.0330, 0.0040, -0.0480, 0.0480],
        ]
    ),
)

PALM_RIDGE = Loft(
    axis="z",
    exponent=3.0,
    rows=np.array(
        [
            [0.1180, -0.0350, -0.0290, -0.0330, 0.0330],
            [0.1280, -0.0368, -0.0250, -0.0410, 0.0410],
            [0.1400, -0.0362, -0.0240, -0.0455, 0.0455],
            [0.1500, -0.0340, -0.0238, -0.0440, 0.0440],
            [0.1550, -0.0317, -0.0251, -0.0330, 0.0330],
            [0.1570, -0.0284, -0.0284, 0.0000, 0.0000],
        ]
    ),
)

PALM_PAD = Loft(
    axis="z",
    exponent=2.6,
    rows=np.array(
        [
            [0.0038, -0.0040, 0.0100, -0.0400, -0.0200],
            [0.0090, -0.0100, 0.0310, -0.0480, -0.0110],
            [0.0200, -0.0124, 0.0365, -0.0535, -0.0075],
            [0.0400, -0.0124, 0.0335, -0.0551, -0.0065],
            [0.0600, -0.0124, 0.0272, -0.0540, -0.0080],
            [0.0750, -0.0100, 0.0236, -0.0490, -0.0130],
            [0.0835, 0.0050, 0.0050, -0.0310, -0.0310],
        ]
    ),
)

THUMB_BASE = Loft(
    axis="x",
    exponent=[2.5, 2.6, 2.8, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 2.8, 2.6, 2.5],
    rows=np.array(
        [
            [0.0008, 0.0054, 0.0054, -0.0400, -0.0360],
            [0.0030, -0.0028, 0.0136, -0.0441, -0.0321],
            [0.0100, -0.0134, 0.0191, -0.0638, -0.0321],
            [0.0200, -0.0187, 0.0245, -0.0755, -0.0325],
            [0.0300, -0.0200, 0.0257, -0.0832, -0.0326],
            [0.0400, -0.0194, 0.0266, -0.0896, -0.0327],
            [0.0500, -0.0184, 0.0269, -0.0955, -0.0328],
            [0.0600, -0.0170, 0.0272, -0.1013, -0.0328],
            [0.0700, -0.0155, 0.0267, -0.1069, -0.0328],
            [0.0800, -0.0140, 0.0258, -0.1105, -0.0333],
            [0.0900, -0.0101, 0.0223, -0.1020, -0.0400],
            [0.0960, 0.0061, 0.0061, -0.0760, -0.0660],
        ]
    ),
)


# Where fingertips touch the can and the bottle: points [m] and outward normals, released data ------

TOUCHES = {
    "middle": [
        ([0.0283695628566503, 0.00191290140151999, 0.012603126518669], [0.0085134960924787, 0.0, 0.999963759535456]),
        (
            [0.0302088748323417, -0.0102128336550385, 0.00758324285523667],
            [0.191904288472871, -0.84962054218996, 0.491240957529561],
        ),
    ],
    "index": [
        (
            [0.02904636402922, -1.13620059960939e-05, 0.012101738745285],
            [0.156365247110253, 0.0176636278487548, 0.987541343816739],
        ),
        (
            [0.0332787479046913, -0.00208980427317626, 0.0103517823390985],
            [0.490320972629585, -0.125590057318285, 0.862445639621633],
        ),
    ],
    "thumb": [
        (
            [0.0340555009657166, 0.00572220455526222, 0.00929765852059142],
            [0.638176750393122, 0.125590441355928, 0.759577169415786],
        ),
        (
            [0.0303814305222231, -1.98375193704885e-05, 0.0119782613698001],
            [0.47640191161706, -0.102950871135041, 0.873179441317847],
        ),
    ],
}
#: Radius of the balls through these points that the URDF has as collision shapes [m].
BALL = 0.006
#: How far the meshes for collisions stay behind the planes that touch the balls there [m].
BEHIND = 0.0002
#: Radius of curvature of a pad at such a point, and distance from it where the pad has its own shape again [m].
CURVE, BLEND = 0.012, 0.009


def distal_pad() -> Mesh:
    """Return the rubber of a fingertip."""
    return cushion(DISTAL, DISTAL_COVER, (0.0085, 0.0376), (0.1 * np.pi, 0.9 * np.pi), (26, 24))


def touching_pad(finger: str) -> Mesh:
    """Return the rubber of a fingertip that runs through the points where it touches, with the normals there."""
    pad = distal_pad()
    surface = pad.vertices[:-1]  # the last one closes the pad underneath
    places, normals = (np.array(values) for values in zip(*TOUCHES[finger], strict=True))
    offsets = surface[:, None] - places
    heights = np.einsum("vci,ci->vc", offsets, normals)
    squares = np.maximum((offsets**2).sum(axis=2), 1e-12)
    # Each point has its way near itself, and none at the other.
    shares = np.clip(1.0 - squares / BLEND**2, 0.0, 1.0) ** 2 / squares / (1.0 / squares).sum(axis=1, keepdims=True)
    wanted = (heights**2 - squares) / (2.0 * CURVE)
    surface = surface + np.einsum("vc,ci->vi", shares * (wanted - heights), normals)
    for place in places:
        surface[np.linalg.norm(surface - place, axis=1).argmin()] = place
    return Mesh(np.vstack([surface, pad.vertices[-1]]), pad.faces)


def touching_hull(finger: str) -> Mesh:
    """Return the convex body of a fingertip, cut off behind the planes in which it touches."""
    body = points(DISTAL, touching_pad(finger), axle(DISTAL_AXLE))
    return hull_mesh(_behind(convex_hull(_behind(body, finger)).vertices, finger))


def _behind(cloud: Array, finger: str) -> Array:
    """Return points, moved behind the planes in which a fingertip touches."""
    for place, normal in TOUCHES[finger]:
        height = (cloud - place) @ normal
        cloud = cloud - np.outer(np.maximum(height + BEHIND, 0.0), normal)
    return cloud


def proximal_pad() -> Mesh:
    """Return the rubber on a proximal body."""
    return cushion(PROXIMAL, PROXIMAL_COVER, (0.0174, 0.0560), (0.25 * np.pi, 0.75 * np.pi), (20, 18))


KNUCKLE_TRUNK = Loft(
    axis="x",
    exponent=3.0,
    rows=np.array(
        [
            [-0.0195, -0.0110, 0.0110, -0.0110, 0.0110],
            [-0.0150, -0.0122, 0.0122, -0.0122, 0.0122],
            [0.0020, -0.0122, 0.0122, -0.0122, 0.0122],
        ]
    ),
)


def knuckle() -> Mesh:
    """Return the cross of the universal joint: flexion about y, abduction about z."""
    return merged(
        KNUCKLE_TRUNK.mesh(8, 28),
        disc((0.0, 0.0, 0.0), "y", 0.0125, 0.0125, 0.001),
        disc((0.0, 0.0, 0.0010), "z", 0.0137, 0.0095, 0.001),
    )


# Axles: z of the centre, half length and radius [m].
PROXIMAL_AXLE = (-0.0012, 0.0189, 0.0066)
MEDIAL_AXLE = (0.0, 0.0162, 0.0066)
DISTAL_AXLE = (0.0, 0.0147, 0.0060)


def axle(size: tuple[float, float, float]) -> Mesh:
    """Return the axle of a flexion joint, its ends visible at the sides of the finger."""
    z, half_length, radius = size
    return disc((0.0, 0.0, z), "y", half_length, radius)


def screws(size: tuple[float, float, float]) -> Mesh:
    """Return the bright screw heads at the ends of an axle."""
    z, half_length, radius = size
    return disc((0.0, 0.0, z), "y", half_length + 0.0003, 0.45 * radius, 0.0003, 20)


def proximal_joint() -> Mesh:
    """Return the axle of the MCP joint and the barrel of the PIP joint."""
    return merged(axle(PROXIMAL_AXLE), disc((0.0678, 0.0, 0.0), "y", 0.0124, 0.0120, 0.001))


def medial_joint() -> Mesh:
    """Return the axle of the PIP joint and the barrel of the DIP joint."""
    return merged(axle(MEDIAL_AXLE), disc((0.0300, 0.0, 0.0), "y", 0.0113, 0.0112, 0.001))


def palm_joint() -> Mesh:
    """Return the housing of the thumb's opposition joint in the palm."""
    outline = [(-0.0010, 0.0260), (0.0005, 0.0285), (0.0030, 0.0300)]
    outline += [(0.0995, 0.0300), (0.1020, 0.0285), (0.1035, 0.0260)]
    return lathe(outline, 56, axis="z").moved(np.eye(3), (-0.0030, 0.0271, 0.0))


def wrist() -> Mesh:
    """Return the flange that the hand is mounted by."""
    outline = [(-0.0070, 0.0330), (-0.0064, 0.0340), (-0.0025, 0.0340), (-0.0019, 0.0334)]
    outline += [(-0.0018, 0.0320), (0.0020, 0.0320)]
    return lathe(outline, 56, axis="z")


def thumb_joint() -> Mesh:
    """Return the shaft that joins the thumb base to the palm."""
    return disc((0.0419, 0.0048, -0.0285), "z", 0.0100, 0.0146, 0.001)


def palm_cover() -> Mesh:
    """Return the service cover on the back of the palm."""
    rows = np.array(PALM.rows)
    rows[:, 1] -= 0.0008
    back = Loft(rows, PALM.exponent, PALM.axis)
    return cushion(PALM, back, (0.0260, 0.1020), (0.78 * np.pi, 1.22 * np.pi), (16, 16))


def points(*bodies: Loft | Mesh) -> Array:
    """Return dense points of several bodies [m]."""
    meshes = [body.mesh(48, 48) if isinstance(body, Loft) else body for body in bodies]
    return merged(*meshes).vertices


def between(low: float, high: float, cloud: Array) -> Array:
    """Return the points with low <= z <= high."""
    return cloud[(cloud[:, 2] >= low) & (cloud[:, 2] <= high)]


VISUAL = {
    "knuckle": knuckle,
    "proximal": lambda: PROXIMAL.mesh(26, 36),
    "proximal_joint": proximal_joint,
    "proximal_pad": proximal_pad,
    "proximal_screws": lambda: screws(PROXIMAL_AXLE),
    "medial": lambda: MEDIAL.mesh(20, 36),
    "medial_joint": medial_joint,
    "medial_screws": lambda: screws(MEDIAL_AXLE),
    "distal": lambda: DISTAL.mesh(26, 36),
    "distal_joint": lambda: axle(DISTAL_AXLE),
    "distal_pad": distal_pad,
    **{f"{finger}_distal_pad": partial(touching_pad, finger) for finger in TOUCHES},
    "distal_screws": lambda: screws(DISTAL_AXLE),
    "palm": lambda: PALM.mesh(24, 44),
    "palm_ridge": lambda: PALM_RIDGE.mesh(14, 40),
    "palm_pad": lambda: PALM_PAD.mesh(22, 36),
    "palm_joint": palm_joint,
    "palm_cover": palm_cover,
    "wrist": wrist,
    "thumb_base": lambda: THUMB_BASE.mesh(26, 40),
    "thumb_joint": thumb_joint,
}

COLLISION = {
    "knuckle_convex": lambda: convex_hull(points(KNUCKLE_TRUNK), 40),
    "proximal_convex": lambda: convex_hull(points(PROXIMAL, proximal_pad(), axle(PROXIMAL_AXLE))),
    "medial_convex": lambda: convex_hull(points(MEDIAL, axle(MEDIAL_AXLE))),
    "distal_convex": lambda: convex_hull(points(DISTAL, distal_pad(), axle(DISTAL_AXLE))),
    **{f"{finger}_distal_convex": partial(touching_hull, finger) for finger in TOUCHES},
    "palm_lower_convex": lambda: convex_hull(between(0.000, 0.076, points(PALM, palm_cover()))),
    "palm_upper_convex": lambda: convex_hull(between(0.064, 0.150, points(PALM, palm_cover()))),
    "palm_ridge_convex": lambda: convex_hull(points(PALM_RIDGE), 40),
    "palm_pad_convex": lambda: convex_hull(points(PALM_PAD)),
    "thumb_base_convex": lambda: convex_hull(points(THUMB_BASE)),
}


def main() -> None:
    """Write every mesh of the hand."""
    write_all(FOLDER, VISUAL, COLLISION)


if __name__ == "__main__":
    main()
