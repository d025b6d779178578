"""Force closure by linear programming."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

import graspatlas as ga


def margin_by_linear_programming(grasp: ga.Grasp, friction: float, faces: int = 240) -> float:
    """The force-closure margin with every cone replaced by a pyramid round it: a little larger than it."""
    m = len(grasp.contact_points)
    rows = []
    for i, n in enumerate(-grasp.contact_normals):
        a = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        a /= np.linalg.norm(a)
        b = np.cross(n, a)
        for angle in np.linspace(0.0, 2.0 * np.pi, faces, endpoint=False):
            row = np.zeros(3 * m + 1)
            row[3 * i : 3 * i + 3] = np.cos(angle) * a + np.sin(angle) * b - friction * n
            row[-1] = np.sqrt(1.0 + friction**2)
            rows.append(row)
    equalities = np.zeros((7, 3 * m + 1))
    equalities[:6, :-1] = grasp.G
    equalities[6, :-1] = -grasp.contact_normals.ravel()
    cost = np.r_[np.zeros(3 * m), -1.0]
    right = np.r_[np.zeros(6), 1.0]
    free = [(None, None)] * (3 * m + 1)
    solution = linprog(cost, A_ub=np.array(rows), b_ub=np.zeros(len(rows)), A_eq=equalities, b_eq=right, bounds=free)
    assert solution.status == 0
    return float(-solution.fun)
