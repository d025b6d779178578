"""Systems and problems that the tests build for themselves."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import graspatlas as ga
from graspatlas import _core

Array = NDArray[np.float64]
#: Where a patch is that is turned and moved.
AXIS = {"origin": (0.01, -0.02, 0.03), "axis": (0.3, -0.9, 0.2), "u_axis": (0.1, 0.2, 0.7)}
DATA = Path(__file__).parent / "data"
ROOT = Path(__file__).parents[1]


def read_json(name: str) -> Any:
    return json.loads((DATA / name).read_text(encoding="utf-8"))


def slow_but(values: Iterable[Any], *quick: Any) -> list[Any]:
    """Parameters of a test, of which all but the quick ones are marked slow."""
    return [value if value in quick else pytest.param(value, marks=pytest.mark.slow) for value in values]


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


def assert_same_atlas(first: ga.Atlas, second: ga.Atlas) -> None:
    """All arrays of two atlases are the same, to the bit."""
    ours, theirs = first.to_arrays(), second.to_arrays()
    assert ours.keys() == theirs.keys()
    for name, array in ours.items():
        other = theirs[name]
        assert array.dtype == other.dtype, name
        assert array.shape == other.shape, name
        assert array.tobytes() == other.tobytes(), name


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


def without_x1(name: str) -> ga.Problem:
    """A bundled problem without its x1; the hand motions pass where they did."""
    problem = ga.load_problem(name)
    return replace(problem, x1=None, reference=problem.x1.joints)


def symmetric_planar_problem(turn: float) -> ga.Problem:
    """Three equal fingers round an object of three equal arcs, turned by an angle [rad] in its middle."""
    data: dict[str, Any] = json.loads(json.dumps(ga.load_problem("planar_hand").to_dict()))
    first, second, tip, arc, offset, palm = 0.06, 0.035, 0.035, 0.02, 0.015, 0.1
    urdf = ['<robot name="three"><link name="palm"/>']
    joints = {}
    for i, name in enumerate(("first", "second", "third")):
        angle = np.pi / 2 + i * 2.0 * np.pi / 3.0
        anchor = palm * np.array([np.cos(angle), np.sin(angle)])
        centre = offset * np.array([np.cos(angle + turn), np.sin(angle + turn)])
        d = centre - anchor
        reach = second + arc
        elbow = np.arccos((d @ d - first**2 - reach**2) / (2.0 * first * reach))
        base = np.arctan2(d[1], d[0]) - np.arctan2(reach * np.sin(elbow), first + reach * np.cos(elbow))
        joints |= {f"{name}_base": float(base), f"{name}_elbow": float(elbow)}
        urdf.append(
            f'<link name="{name}_proximal"/><link name="{name}_distal"/>'
            f'<joint name="{name}_base" type="continuous"><parent link="palm"/><child link="{name}_proximal"/>'
            f'<origin xyz="{anchor[0]:.17g} {anchor[1]:.17g} 0"/><axis xyz="0 0 1"/></joint>'
            f'<joint name="{name}_elbow" type="continuous"><parent link="{name}_proximal"/>'
            f'<child link="{name}_distal"/><origin xyz="{first} 0 0"/><axis xyz="0 0 1"/></joint>'
        )
        contact = data["contacts"][i]
        contact["hand"]["position"] = [tip, 0.0, 0.0]
        contact["object"] |= {
            "radius": arc,
            "origin": [offset * np.cos(angle), offset * np.sin(angle), 0.0],
            "u_interval": None,
        }
    data["hand"] = {"name": "three", "urdf": "three.urdf", "urdf_text": "".join(urdf) + "</robot>"}
    quaternion = [0.0, 0.0, float(np.sin(turn / 2)), float(np.cos(turn / 2))]
    data["x1"] = {"joints": joints, "object_xyz": [0.0, 0.0, 0.0], "object_quat_xyzw": quaternion}
    return ga.Problem.from_dict(data)


def load_script(folder: str) -> ModuleType:
    """Import ``make_meshes.py`` of a folder under ``robots``."""
    path = ROOT / "robots" / folder / "make_meshes.py"
    spec = importlib.util.spec_from_file_location(f"make_meshes_{folder}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def changed(array: Array, index: Any, value: Any) -> Array:
    """A copy of an array with other values in one place."""
    out = array.copy()
    out[index] = value
    return out


def assert_complete_and_holding(result: ga.Result) -> None:
    """The atlas is complete, all is verified again, and the best grasp holds and is better than x1."""
    assert result.atlas.complete
    assert result.dimension == 2
    report = result.check()
    assert report, report
    assert {type(r) for r in result.requirements} == {ga.ForceClosure, ga.CollisionFree}
    assert 0.02 < result.accepted.mean() < 0.98
    best = result.refined_best
    assert best.quality >= result.best.quality > 1.5 * result.worst.quality
    assert result.best.quality > 1.2 * result.qualities[0]  # x1 is not the answer


def assert_meshes_are_made_again(folder: str, patch: Any, tmp_path: Path) -> None:
    """The meshes in a folder of robots/ are those of its script, whose outline is that of the patch."""
    script = load_script(folder)
    np.testing.assert_allclose((patch.heights, patch.radii), (script.HEIGHTS, script.RADII), atol=1e-12)
    kept = script.FOLDER
    script.FOLDER = tmp_path
    script.main()
    for path in tmp_path.iterdir():
        assert path.read_text() == (kept / path.name).read_text(), path.name
    assert len(list(tmp_path.iterdir())) == len(list(kept.glob("*.obj")))
