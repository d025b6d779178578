"""Systems and problems that the tests build for themselves."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

import graspatlas as ga
from graspatlas import _core

Array = NDArray[np.float64]
DATA = Path(__file__).parent / "data"


def read_json(name: str) -> Any:
    return json.loads((DATA / name).read_text(encoding="utf-8"))


class PythonSphere(ga.System):
    """The unit sphere in R^n, in Python; with bounds where they are given."""

    def __init__(self, n: int, lower: ArrayLike = -np.inf, upper: ArrayLike = np.inf) -> None:
        super().__init__(n_variables=n, n_equations=1, lower=lower, upper=upper)

    def residual(self, x: Array) -> Array:
        total = -1.0
        for value in x:
            total += value * value
        return np.array([total])

    def jacobian(self, x: Array) -> Array:
        return 2.0 * x[None]


class Written(ga.System):
    """A system of given functions."""

    def __init__(
        self,
        n_variables: int,
        n_equations: int,
        residual: Callable[[Array], Any],
        jacobian: Callable[[Array], Any],
    ) -> None:
        super().__init__(n_variables, n_equations)
        self.functions = (residual, jacobian)

    def residual(self, x: Array) -> Any:
        return self.functions[0](x)

    def jacobian(self, x: Array) -> Any:
        return self.functions[1](x)


def chain(name: str, root_xyz: ArrayLike, axes: list[str], length: float, kinds: str | list[str] = "revolute") -> str:
    """A finger in URDF: joints `name0`, `name1`, ... about the axes given, then a fixed link `name_tip`."""
    parts, parent = [], "palm"
    kinds = [kinds] * len(axes) if isinstance(kinds, str) else kinds
    xyz = " ".join(str(float(c)) for c in np.asarray(root_xyz, float))
    for i, (axis, kind) in enumerate(zip(axes, kinds, strict=True)):
        link = f"{name}_{i}"
        parts.append(f'<link name="{link}"/>')
        parts.append(
            f'<joint name="{name}{i}" type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
            f'<child link="{link}"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        )
        parent, xyz = link, f"{length} 0 0"
    parts.append(f'<link name="{name}_tip"/>')
    parts.append(
        f'<joint name="{name}_fixed" type="fixed"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{name}_tip"/></joint>'
    )
    return "".join(parts)


def robot(*parts: str) -> str:
    return f'<robot name="made"><link name="palm"/>{"".join(parts)}</robot>'


def bare_system(urdf: str, object_joint: str = "none", length_scale: float = 0.01) -> _core.GraspSystem:
    """The system of a kinematic tree without contacts: no equation, so its manifold is the configuration space."""
    model = _core.Model(urdf, object_joint)
    motions = np.eye(model.hand_v_size)
    return _core.GraspSystem(model, [], motions, length_scale, model.lower_limits, model.upper_limits)


TRIPOD_ROOTS = ((0.06, 0.0, 0.0), (-0.03, 0.05, 0.0), (-0.03, -0.05, 0.0))
TRIPOD_AXES = ["0 0 1", "0 1 0", "0.3 1 0.2"]
BENT = {"a0": 0.1, "a1": -0.6, "a2": -0.5, "b0": 2.0, "b1": -0.7, "b2": -0.6, "c0": -2.1, "c1": -0.8, "c2": -0.4}


def tripod_problem(
    joints: dict[str, float] = BENT,
    *,
    axes: list[str] = TRIPOD_AXES,
    kinds: str | list[str] = "revolute",
    rolling: bool = False,
    **options: Any,
) -> ga.Problem:
    """Three fingers; each tip touches a plane of the object, which passes through that very point.

    Args:
        joints: Angles at x1.
        axes: Joint axes of each finger.
        kinds: Joint types of each finger.
        rolling: The tips are planes of which every point may touch, not points; at x1 their origins do.
        **options: Of the problem.
    """
    fingers = [chain(n, root, axes, 0.05, kinds) for n, root in zip("abc", TRIPOD_ROOTS, strict=True)]
    hand = ga.Hand("tripod", robot(*fingers))
    q = [[np.cos(joints[n]), np.sin(joints[n])] if kinds == "continuous" else [joints[n]] for n in hand.joints]
    places = hand.link_placements(np.concatenate(q))
    contacts = []
    for name in "abc":
        T = places[f"{name}_tip"]
        normal = tuple(T[:3, :3].T @ [0.0, 0.0, 1.0])
        origin = (0.0, 0.0, 0.0)
        tip = ga.patches.Plane(origin, normal) if rolling else ga.patches.Point(origin, normal)
        contacts.append(ga.Contact(f"{name}_tip", tip, ga.patches.Plane(tuple(T[:3, 3]), (0.0, 0.0, -1.0))))
    return ga.Problem(
        name="tripod",
        hand=hand,
        object=ga.Body("plate", '<robot name="plate"><link name="plate"/></robot>'),
        contacts=tuple(contacts),
        x1=ga.FirstGrasp({name: joints[name] for name in hand.joints}, parameters=(0.0,) * 12 if rolling else None),
        **options,
    )


def random_rotation(rng: np.random.Generator) -> Array:
    """A random unit quaternion (x, y, z, w)."""
    q = rng.normal(size=4)
    return np.asarray(q / np.linalg.norm(q))


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
