"""Fuzzing of patches."""

from __future__ import annotations

import numpy as np
from drawn import anything, few, odd_numbers, tried, vectors
from hypothesis import given
from hypothesis import strategies as st

from graspatlas import patches


def check_patch(patch: patches.Patch, u: float, v: float, point: tuple[float, float, float]) -> None:
    """The identities of a patch, at (u, v) and at what `locate` gives."""
    low, high = patch.interval("v") if "v" in patch.parameters else (-1.0, 1.0)
    places = [(u, min(max(v, low), high))]
    if np.abs(point).max() < 1e3:
        places.append(patch.locate(point))
    for place in places:
        values = patch.core().evaluate(*place)
        frame = np.array([values["a"], values["m"], values["b"]])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
        assert np.isfinite(values["o"]).all()
        scale = 1.0 + np.abs(values["o_v"]).max()
        assert abs(values["o_u"] @ values["m"]) <= 1e-9 * (1.0 + np.abs(values["o_u"]).max())
        assert abs(values["o_v"] @ values["m"]) <= 1e-9 * scale


intervals = st.none() | st.tuples(odd_numbers, odd_numbers) | anything
axes = vectors | anything
lengths = st.floats(1e-3, 1.0) | odd_numbers
pairs = st.tuples(lengths, lengths) | anything


@given(
    kind=st.sampled_from(["point", "plane", "cylinder", "cone", "revolution", "ball", None]),
    values=st.fixed_dictionaries(
        {},
        optional={
            "position": axes, "origin": axes, "normal": axes, "axis": axes, "u_axis": axes,
            "u_interval": intervals, "v_interval": intervals,
            "radius": lengths | anything, "heights": pairs, "radii": pairs,
        },
    ),
    u=st.floats(-7.0, 7.0), v=st.floats(-2.0, 2.0), point=vectors,
)  # fmt: skip
@few(400)
def test_patches(kind, values, u, v, point):
    known = {"point": {"position", "normal"}, "plane": {"origin", "normal", "u_axis", "u_interval", "v_interval"}}
    turned = {"origin", "axis", "u_axis", "u_interval", "v_interval"}
    known |= {"cylinder": turned | {"radius"}, "cone": turned | {"heights", "radii"}}
    known["revolution"] = known["cone"]
    chosen = {name: value for name, value in values.items() if name in known.get(kind, values)}
    patch = tried(lambda: patches.patch_from_dict({"type": kind, **chosen}))
    if patch is not None:
        check_patch(patch, u, v, point)


@given(heights=st.lists(st.floats(-0.1, 0.1), min_size=2, max_size=6), radii=st.lists(lengths, min_size=2, max_size=6))
@few(100)
def test_outlines(heights, radii):
    patch = tried(lambda: patches.Revolution(heights=sorted(heights), radii=radii))
    if patch is not None and max(radii) < 10.0:
        check_patch(patch, 0.3, 0.5 * sum(patch.interval("v")), (0.1, 0.0, 0.1))
