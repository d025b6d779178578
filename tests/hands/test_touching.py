"""What a simulator starts with: at grasps of the bundled problems the shapes touch where the contacts say.

By Pinocchio's reading of the URDFs and coal's Python, with all corners of every mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from oracles.collision_oracle import hull

import graspatlas as ga

#: Depth to which fingertips may be in the object, distance that they may be from it, and that contact points may be
#: from the surfaces [m].
NEAR = 5e-5
#: Accepted grasps to look at, beside x1.
COUNT = 6


def solids(body: Any, urdf: str, model: pin.Model) -> list[tuple[int, Any, pin.SE3]]:
    """Joint, geometry and placement of each collision shape, meshes as their convex hulls."""
    read = pin.buildGeomFromUrdfString(model, urdf, pin.COLLISION, package_dirs=list(body.package_dirs))
    found = []
    for item in read.geometryObjects.tolist():
        mesh = isinstance(item.geometry, coal.BVHModelBase)
        shape = hull(item.geometry) if mesh else item.geometry.clone()
        found.append((int(item.parentJoint), shape, item.placement.copy()))
    return found


def signed_distance(a: Any, A: pin.SE3, b: Any, B: pin.SE3) -> float:
    request, (at, to) = coal.DistanceRequest(), (coal.Transform3s(T.rotation, T.translation) for T in (A, B))
    return float(coal.distance(a, at, b, to, request, coal.DistanceResult()))


def grasps(result: ga.Result) -> Iterator[np.ndarray]:
    yield result.problem.x1_array
    accepted = np.flatnonzero(result.accepted)
    yield from result.atlas.centers[accepted[np.linspace(0, len(accepted) - 1, COUNT).astype(int)]]


@pytest.mark.parametrize("name", ga.bundled_problems())
def test_fingertips_touch_where_the_contacts_say(name: str) -> None:
    problem = ga.load_problem(name)
    model = pin.buildModelFromXML(problem.hand.tree)
    data = model.createData()
    hand = solids(problem.hand, problem.hand.tree, model)
    held = solids(problem.object, problem.object.urdf, pin.buildModelFromXML(problem.object.urdf))
    probe = coal.Sphere(1e-6)
    for x in grasps(ga.optimize(problem)):
        pin.forwardKinematics(model, data, x[: model.nq])
        arrays = problem.full_system.grasp_arrays(x[None])
        T_palm_object = pin.SE3(arrays["T_palm_object"][0])
        for contact, point in zip(problem.contacts, arrays["object_points"][0], strict=True):
            joint = problem.hand.frame(contact.frame)[0]
            tip = [(shape, data.oMi[joint] * T) for j, shape, T in hand if j == joint]
            body = [(shape, T_palm_object * T) for _, shape, T in held]
            assert abs(min(signed_distance(*a, *b) for a in tip for b in body)) < NEAR, contact.frame
            at = pin.SE3(np.eye(3), point)
            for surface in (tip, body):
                assert abs(min(signed_distance(probe, at, *shape) for shape in surface)) < NEAR, contact.frame
