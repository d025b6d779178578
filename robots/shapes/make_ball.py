"""Write the ball of radius 1 that hands in MJCF stretch to ellipsoids: an icosahedron, its faces parted in 64."""

from pathlib import Path

import numpy as np

GOLDEN = (1.0 + 5.0**0.5) / 2.0
SPLITS = 3


def icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Corners (12, 3) at distance 1, and triangles (20, 3) counterclockwise seen from outside."""
    a, b = 1.0, GOLDEN
    signs = [(s, t) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    corners = np.array([np.roll([0.0, s * a, t * b], turn) for turn in range(3) for s, t in signs])
    corners /= np.linalg.norm(corners[0])
    gaps = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    edge = np.sort(gaps, axis=1)[0, 1]
    near = np.abs(gaps - edge) < 1e-9
    triples = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    turned = [
        (i, j, k) if np.dot(np.cross(corners[j] - corners[i], corners[k] - corners[i]), corners[i]) > 0.0 else (i, k, j)
        for i, j, k in triples
    ]
    return corners, np.array(turned)


def parted(corners: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle in four, with the new corners moved out to the ball."""
    points, numbers = [*corners], {}

    def middle(i: int, j: int) -> int:
        key = (min(i, j), max(i, j))
        if key not in numbers:
            numbers[key] = len(points)
            point = points[i] + points[j]
            points.append(point / np.linalg.norm(point))
        return numbers[key]

    found = []
    for i, j, k in faces.tolist():
        a, b, c = middle(i, j), middle(j, k), middle(k, i)
        found += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
    return np.array(points), np.array(found)


if __name__ == "__main__":
    corners, faces = icosahedron()
    for _ in range(SPLITS):
        corners, faces = parted(corners, faces)
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    Path(__file__).with_name("ball.obj").write_text("\n".join(lines) + "\n")
