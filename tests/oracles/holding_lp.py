"""The holding force by linear programmes: round cones between pyramids inside and outside, and SciPy's hulls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

import graspatlas as ga

Array = NDArray[np.float64]


class HoldingProgramme:
    """Contact forces of a grasp as sums of the edges of pyramids, inside the cones or outside.

    Args:
        grasp: The grasp.
        friction: Coefficient of friction.
        budget: The most that normal forces add up to [N].
        efforts: Of the actuated joints [N m].
        torque_length: That divides torques [m]; 0 for forces alone.
        outside: Whether the pyramids are those around the cones.
        edges: Edges of a pyramid.
    """

    def __init__(
        self,
        grasp: ga.Grasp,
        friction: float,
        budget: float,
        efforts: Array | None = None,
        torque_length: float = 0.0,
        outside: bool = False,
        edges: int = 64,
    ) -> None:
        planar = len(grasp.G) == 3
        R, centre = grasp.T_palm_object[:3, :3], grasp.problem.object.center_of_mass
        slope = friction / np.cos(np.pi / edges) if outside and not planar else friction
        forces, torques, shares = [], [], []
        for i, (p, n) in enumerate(zip(grasp.contact_points, -grasp.contact_normals, strict=True)):
            s = np.array([-n[1], n[0], 0.0]) if planar else np.linalg.svd(n[None])[2][1]
            angles = np.array([0.0, np.pi]) if planar else 2.0 * np.pi * np.arange(edges) / edges
            f = n + slope * (np.outer(np.cos(angles), s) + np.outer(np.sin(angles), np.cross(n, s)))
            forces.append(f)
            torques.append(np.cross(p - grasp.object_xyz - R @ centre, f))
            shares.append(f @ grasp.J[3 * i : 3 * i + 3])
        F, T = np.vstack(forces) @ R, np.vstack(torques) @ R
        self.F = F[:, :2].T if planar else F.T
        self.T = T[:, 2:].T if planar else T.T
        self.rows, self.ends = np.ones((1, len(F))), np.array([budget])
        if efforts is not None:
            tau = np.vstack(shares).T
            self.rows, self.ends = np.vstack([self.rows, tau, -tau]), np.r_[budget, efforts, efforts]
        self.reaches = self.F
        if torque_length:
            self.reaches, self.T = np.vstack([self.F, self.T / torque_length]), np.zeros((0, len(F)))

    def furthest(self, direction: Array) -> Array:
        """The disturbance in the object's frame that is furthest in a direction, among those withstood."""
        solution = linprog(
            -direction @ self.reaches, self.rows, self.ends, self.T, np.zeros(len(self.T)), bounds=(0.0, None)
        )
        assert solution.status == 0
        return np.asarray(self.reaches @ solution.x)

    def along(self, direction: Array) -> float:
        """The largest force along a unit vector in the object's frame [N]."""
        cost = np.r_[np.zeros(self.F.shape[1]), -1.0]
        equations = np.block([[self.F, direction[:, None]], [self.T, np.zeros((len(self.T), 1))]])
        rows = np.hstack([self.rows, np.zeros((len(self.rows), 1))])
        solution = linprog(cost, rows, self.ends, equations, np.zeros(len(equations)), bounds=(0.0, None))
        assert solution.status == 0
        return float(-solution.fun)

    def ball_radius(self, gap: float = 1e-4) -> float:
        """Radius of the largest ball in what is withstood: hull and supporting planes, as near as the gap."""
        axes = np.eye(len(self.reaches))
        points = [self.furthest(u) for u in np.vstack([axes, -axes])]
        while True:
            equations = ConvexHull(np.array(points)).equations
            nearest = equations[(-equations[:, -1]).argmin()]
            point = self.furthest(nearest[:-1])
            if nearest[:-1] @ point <= -(1.0 + gap) * nearest[-1]:
                return float(-nearest[-1])
            points.append(point)
