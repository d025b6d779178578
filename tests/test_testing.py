"""The checks of systems and patches refuse each identity that does not hold, and name it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from helpers import PythonSphere, Written

from graspatlas import GraspAtlasError, patches
from graspatlas.systems import Rotations, Sphere
from graspatlas.testing import check_patch, check_system

AT = [[0.0, 0.6, 0.8], [1.2, -0.4, 0.3]]


class Wrapped:
    """A sphere of which one method is another."""

    def __init__(self, **methods: Any) -> None:
        self._system = PythonSphere(3, lower=[-np.inf, -2.0, -2.0], upper=3.0)
        for name, method in methods.items():
            setattr(self, name, method)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._system, name)


class Forgetful(PythonSphere):
    """The sphere, but what it returns depends on how often it was asked."""

    calls = 0

    def residual(self, x):
        self.calls += 1
        return super().residual(x) + 1e-13 * self.calls


B = PythonSphere(3, lower=[-np.inf, -2.0, -2.0], upper=3.0).bound_normals
SYSTEMS = {
    "factor": (Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [2.002 * x]), "Jacobian is the derivative"),
    "sign": (Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [-2.0 * x]), "Jacobian is the derivative"),
    "one entry": (Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [[2.0 * x[0], 0.0, 2.0 * x[2]]]), "Jacobian is"),
    "NaN": (Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [x * np.nan]), "the jacobian is finite"),
    "infinite": (Written(3, 1, lambda x: [np.inf], lambda x: [2.0 * x]), "the residual is finite"),
    "changing": (Forgetful(3), "same whenever it is asked"),
    "rows": (Wrapped(evaluate_jacobian=lambda x: np.zeros((2, 3))), r"jacobian has the shape \[1, 3\]; got \[2, 3\]"),
    "sizes": (Wrapped(dimension=3), "the dimension is"),
    "difference": (Wrapped(difference=lambda a, b: 1.001 * (b - a)), r"\(x \(\+\) v\) \(-\) x = v"),
    "one-sided": (Wrapped(difference=lambda a, b: b - a + 1e-6 * np.maximum(a - b, 0.0).max()), r"off by"),
    "self": (Wrapped(difference=lambda a, b: b - a + 1e-10), r"x \(-\) x = 0"),
    "embedding too wide": (Wrapped(embed=lambda x: 1.01 * x), "no farther apart"),
    "embedding too narrow": (Wrapped(embed=lambda x: 0.2 * x), "keeps near points apart"),
    "embedding in one place": (Wrapped(embed=lambda x: np.zeros(3)), "keeps near points apart"),
    "slack": (Wrapped(slack=lambda x: 1.001 * (np.r_[-2.0, -2.0, 3.0, 3.0, 3.0] - B @ x)), "bounds are linear"),
    "too few normals": (Wrapped(bound_normals=B[1:]), r"bound normal for each slack"),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_wrong_system_is_refused(name):
    system, words = SYSTEMS[name]
    with pytest.raises(GraspAtlasError, match=words) as caught:
        check_system(system, AT)
    assert "at point 0: violated:" in str(caught.value)


def test_right_systems_pass_and_the_figures_are_told():
    check_system(PythonSphere(3), AT)
    check_system(Wrapped(), AT)
    check_system(Rotations(), [[0.0, 0.6, 0.0, 0.8]])
    # Wrong by 1e-5: too much by default, and allowed where it is asked for.
    rough = Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [2.0 * x + 1e-5])
    with pytest.raises(GraspAtlasError, match=r"Written at point 0: .*; off by 1e-05, at most 1\.6e-06 allowed"):
        check_system(rough, AT)
    check_system(rough, AT, tolerance=2e-5)


def test_a_fault_at_one_point_is_found_there():
    system = Written(3, 1, lambda x: [x @ x - 1.0], lambda x: [2.0 * x * (1.0 + 0.1 * (x[0] > 1.0))])
    with pytest.raises(GraspAtlasError, match="Written at point 1: "):
        check_system(system, AT)


@pytest.mark.parametrize("points", [[], [[1.0, 0.0]], [[[0.0, 0.6, 0.8]]], "abc", [[1.0], [1.0, 2.0]]], ids=str)
def test_points_must_be_points(points):
    with pytest.raises(GraspAtlasError, match="points must"):
        check_system(Sphere(3), points)


class Core:
    """A compiled patch with other values."""

    def __init__(self, patch: Any, **changes: Any) -> None:
        self.patch, self.changes = patch, changes

    def evaluate(self, u, v):
        values = dict(self.patch.evaluate(u, v))
        return values | {name: change(values) for name, change in self.changes.items()}


@dataclass(frozen=True)
class Broken(patches.Cylinder):
    """A cylinder with something wrong."""

    fault: str = ""

    def core(self):
        changes = {
            "skew": {"a": lambda p: p["a"] + 1e-6 * p["m"]},
            "normal": {"o_u": lambda p: p["o_u"] + 1e-6 * p["m"]},
            "rate": {"o_u": lambda p: 1.001 * p["o_u"]},
            "turn": {"m_u": lambda p: p["m_u"] + 2e-6},
            "height": {"b_v": lambda p: p["b_v"] + p["b"]},
        }
        return Core(super().core(), **changes.get(self.fault, {}))

    def point(self, u=0.0, v=0.0):
        return super().point(u, v) + (1e-9 if self.fault == "point" else 0.0)

    def normal_at(self, u=0.0, v=0.0):
        return super().normal_at(u, v) * (-1.0 if self.fault == "inside" else 1.0)

    def locate(self, point):
        u, v = super().locate(point)
        off = np.linalg.norm(np.asarray(point)[[0, 2]]) - self.radius
        return u + {"locate": 1e-4, "above": 2.0 * (off > 1e-6)}.get(self.fault, 0.0), v

    def interval(self, parameter):
        return (0.5, -0.5) if self.fault == "interval" else super().interval(parameter)

    def to_dict(self):
        kept = {name: value for name, value in super().to_dict().items() if name != "fault"}
        return kept | ({"radius": 2.0 * self.radius} if self.fault == "data" else {})


PATCHES = {
    "skew": "are orthonormal",
    "normal": "o_u is normal to the normal m",
    "rate": "o_u is the derivative of o by u",
    "turn": "m_u is the derivative of m by u",
    "height": "b_v is the derivative of b by v",
    "point": r"point\(u, v\) is the point o",
    "inside": r"normal_at\(u, v\) is the normal m",
    "locate": "locate finds the parameters",
    "above": "locate finds a point as near as",
    "interval": "lower end below",
    "data": "plain data",
}


@pytest.mark.parametrize("fault", PATCHES)
def test_a_wrong_patch_is_refused(fault):
    with pytest.raises(GraspAtlasError, match=f"patch cylinder.*violated: .*{PATCHES[fault]}"):
        check_patch(Broken(radius=0.02, fault=fault))


def test_right_patches_pass_and_a_place_is_needed():
    check_patch(Broken(radius=0.02))
    check_patch(patches.Point((0.1, 0.2, 0.3), (0.0, 3.0, 4.0)))
    check_patch(patches.Sphere(radius=0.02), [(0.3, -0.2)])
    with pytest.raises(GraspAtlasError, match="at least one"):
        check_patch(patches.Sphere(radius=0.02), [])
    with pytest.raises(GraspAtlasError, match="at least one"):
        check_patch(patches.Sphere(radius=0.02), count=0)
