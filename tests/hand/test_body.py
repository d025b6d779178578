"""Bodies of simple shapes, without a URDF file."""

from __future__ import annotations

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.hand.urdf import box_urdf, cylinder_urdf, sphere_urdf


def test_simple_bodies_have_the_shape_that_is_stated() -> None:
    assert ga.Body.sphere("ball", 0.03).urdf == sphere_urdf("ball", 0.03)
    assert ga.Body.box("brick", (0.1, 0.2, 0.3)).urdf == box_urdf("brick", (0.1, 0.2, 0.3))
    assert ga.Body.cylinder("jar", 0.03, 0.1).urdf == cylinder_urdf("jar", 0.03, 0.1)


@pytest.mark.parametrize(
    "make",
    [
        lambda: ga.Body.sphere("ball", -0.03),
        lambda: ga.Body.box("brick", (0.1, 0.2)),
        lambda: ga.Body.cylinder("jar", 0.03, float("nan")),
    ],
)
def test_sizes_must_be_positive_numbers(make) -> None:
    with pytest.raises(ga.GraspAtlasError, match="must be"):
        make()


def test_earlier_names_of_the_mechanism_still_work() -> None:
    mechanism = ga.load_problem("gripper_skittle").hand.mechanism
    with pytest.warns(DeprecationWarning, match="actuated"):
        assert mechanism.driven == mechanism.actuated
    with pytest.warns(DeprecationWarning, match="transmission"):
        np.testing.assert_array_equal(mechanism.A, mechanism.transmission)
