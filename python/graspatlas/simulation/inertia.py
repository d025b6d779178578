"""How the mass of an object is spread: as its URDF states it, or as in its collision shapes."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from graspatlas.collision.shapes import Shape
from graspatlas.hand.body import Body
from graspatlas.simulation.mjcf import add_shape
from graspatlas.support.arrays import Array
from graspatlas.support.mujoco_library import mujoco_library

__all__ = ["unit_inertia"]


def unit_inertia(body: Body, shapes: Sequence[Shape]) -> Array:
    """Inertia of a body of mass one about its centre of mass, axes of its frame (3, 3), m^2.

    Args:
        body: The body; what its URDF states under ``<inertial>`` counts.
        shapes: Its collision shapes; where the URDF states no mass, these are evenly filled.
    """
    import pinocchio as pin

    stated = pin.buildModelFromXML(body.urdf, pin.JointModelFreeFlyer()).inertias[1]
    if stated.mass > 0.0:
        return np.asarray(stated.inertia, float) / float(stated.mass)
    return _of_filled(shapes, body.center_of_mass)


def _of_filled(shapes: Sequence[Shape], about: Array) -> Array:
    """The same of shapes that are evenly filled, about a point (3,); where two overlap, twice."""
    root = Element("mujoco")
    assets, body = SubElement(root, "asset"), SubElement(SubElement(root, "worldbody"), "body")
    SubElement(body, "freejoint")
    for shape in shapes:
        add_shape(body, assets, shape, shape.name, shape.placement)
    library = mujoco_library()
    model = library.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    R = np.zeros(9)
    library.mju_quat2Mat(R, model.body_iquat[1])
    axes, away = R.reshape(3, 3), model.body_ipos[1] - about
    inertia = axes @ np.diag(model.body_inertia[1]) @ axes.T / model.body_mass[1]
    return np.asarray(inertia + away @ away * np.eye(3) - np.outer(away, away))
