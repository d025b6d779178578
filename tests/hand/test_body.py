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


def test_the_centre_of_mass_is_that_of_all_links():
    """Two links of mass 1 and 3, the second turned by a quarter about z at (0.1, 0, 0)."""
    urdf = (
        '<robot name="two"><link name="a"><inertial><origin xyz="0 0 0.4"/><mass value="1"/></inertial></link>'
        '<link name="b"><inertial><origin xyz="0.2 0 0"/><mass value="3"/></inertial></link><link name="c"/>'
        '<joint name="ab" type="fixed"><parent link="a"/><child link="b"/>'
        '<origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/></joint>'
        '<joint name="bc" type="fixed"><parent link="b"/><child link="c"/></joint></robot>'
    )
    np.testing.assert_allclose(ga.Body("two", urdf).center_of_mass, [0.075, 0.15, 0.1], atol=1e-12)
    assert not ga.Body.box("box", (0.1, 0.2, 0.3)).center_of_mass.any()
    broken = ga.Body("two", urdf.replace('value="3"', 'value="heavy"'))
    with pytest.raises(ga.GraspAtlasError, match="inertial"):
        _ = broken.center_of_mass
