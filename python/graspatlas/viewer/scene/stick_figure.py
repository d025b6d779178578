"""What is drawn of bodies that have no shapes: a hand's bones, and the patches that an object is touched on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.scene.meshes import Mesh, capsule, ellipsoid, frame_along, smooth, tube

__all__ = ["Shape", "bones", "outlines", "sticks"]

#: A mesh, its placement (4, 4) and its colour (red, green, blue, opacity).
Shape = tuple[Mesh, Array, tuple[float, float, float, float]]

BONE = (0.80, 0.81, 0.83, 1.0)
JOINT = (0.20, 0.21, 0.23, 1.0)
OBJECT = (0.16, 0.42, 0.80, 1.0)
#: Thickness of bones, joints and outlines, compared with the mean length of a bone.
BONE_RADIUS, JOINT_RADIUS, OUTLINE_RADIUS = 0.07, 0.11, 0.05
#: Points along each parameter of a patch, and where a patch without bounds is cut off [m].
STEPS = 40
CUT = 0.03


def bones(problem: Problem, q: Array) -> Iterator[Shape]:
    """A hand's joints, and the lines between them and to the fingertips, in the palm's frame.

    Args:
        problem: The problem.
        q: The hand's joint configuration (nq,).
    """
    joints, lines = _skeleton(problem, q)
    size = bone_length(problem)
    ball = ellipsoid(np.full(3, JOINT_RADIUS * size), 24)
    for joint in joints:
        T = np.eye(4)
        T[:3, 3] = joint
        yield ball, T, JOINT
    for start, end in lines:
        length = float(np.linalg.norm(end - start))
        if length > 1e-9:
            T = frame_along((end - start) / length, (start + end) / 2.0)
            yield capsule(BONE_RADIUS * size, length / 2.0), T, BONE


def sticks(problem: Problem) -> PlainTable:
    """The bones of :func:`bones` for whoever moves the joints: what they join, and how thick they are.

    Returns:
        ``bones``, each from joint ``a`` to point ``at`` (3,) of joint ``b``; the other joints' origins are where they
        begin; ``joints`` that have a ball; radii [m] and colours.
    """
    import pinocchio as pin  # slow to import

    model = pin.buildModelFromXML(problem.hand.tree)
    joined = [(model.parents[j], j, np.zeros(3)) for j in range(1, model.njoints) if model.parents[j] > 0]
    for contact in problem.contacts:
        joint, T = problem.hand.frame(contact.frame)
        joined.append((joint, joint, T[:3, :3] @ contact.hand.point() + T[:3, 3]))
    size = bone_length(problem)
    return {
        "bones": [{"a": int(a), "b": int(b), "at": at.tolist()} for a, b, at in joined],
        "joints": list(range(1, model.njoints)),
        "radii": [BONE_RADIUS * size, JOINT_RADIUS * size],
        "colours": [list(BONE), list(JOINT)],
    }


def bone_length(problem: Problem) -> float:
    """Mean length of the hand's bones at x1, or with all joints at 0 where there is none, metres."""
    n = problem.hand.model.hand_q_size
    lines = _skeleton(problem, (problem.x1_array if problem.x1 else np.asarray(problem.hand.model.neutral))[:n])[1]
    return float(np.mean([np.linalg.norm(end - start) for start, end in lines]))


def _skeleton(problem: Problem, q: Array) -> tuple[list[Array], list[tuple[Array, Array]]]:
    """Origins of the joints, and both ends of the bones."""
    import pinocchio as pin  # slow to import

    model = pin.buildModelFromXML(problem.hand.tree)
    data = model.createData()
    pin.forwardKinematics(model, data, np.asarray(q, float))
    joints = [np.array(placement.translation) for placement in data.oMi]
    parents = list(model.parents)
    lines = [(joints[parents[j]], joints[j]) for j in range(1, model.njoints) if parents[j] > 0]
    for contact in problem.contacts:
        joint, T = problem.hand.frame(contact.frame)
        tip = T[:3, :3] @ contact.hand.point() + T[:3, 3]
        lines.append((joints[joint], data.oMi[joint].act(tip)))
    return joints[1:], lines


def outlines(problem: Problem) -> Iterator[Shape]:
    """Curves and surfaces that the object may be touched on, in its own frame."""
    radius = OUTLINE_RADIUS * bone_length(problem)
    for contact in problem.contacts:
        side = contact.sides[1]
        patch = side.patch
        ranges = []
        for name in ("u", "v"):
            if name not in side.free:
                ranges.append(np.array([side.frozen.get(name, 0.0)]))
            else:
                low, high = patch.interval(name) or (-np.pi, np.pi)
                ranges.append(
                    np.linspace(max(low, -CUT), min(high, CUT), STEPS)
                    if np.isinf(high - low)
                    else np.linspace(low, high, STEPS)
                )
        grid = np.array([[patch.point(u, v) for v in ranges[1]] for u in ranges[0]])
        if grid.shape[:2] == (STEPS, STEPS):
            yield _sheet(grid), np.eye(4), OBJECT
        elif grid.size > 3:
            yield tube(grid.reshape(-1, 3), radius), np.eye(4), OBJECT


def _sheet(grid: Array) -> Mesh:
    """Surface through a grid of points (n, m, 3)."""
    n, m = grid.shape[:2]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij"))
    a, b = i * m + j, (i + 1) * m + j
    return smooth(
        grid.reshape(-1, 3), np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    )
