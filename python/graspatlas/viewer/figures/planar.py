"""A planar hand and its object, drawn in their plane."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from graspatlas.errors import GraspAtlasError
from graspatlas.grasps.grasp import Grasp
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.viewer.figures.style import COLUMN, INK, Picture, styled

__all__ = ["draw_planar_grasp", "plot_planar_grasp", "require_planar"]


PALM, OBJECT, CONTACT, PHALANX = "#e4e4e4", "#3d6ea5", "#c2182b", "#4a4a4a"
#: Points along an arc.
STEPS = 60


def plot_planar_grasp(problem: Problem, grasp: Grasp) -> Picture:
    """Draw one grasp of a planar problem: phalanges, joints, the arcs that may be touched, contacts and normals.

    Args:
        problem: A planar problem.
        grasp: One of its grasps, such as ``result.best``.

    Returns:
        The figure; lengths in millimetres.

    Raises:
        GraspAtlasError: If the problem is not planar.

    Source: "Global Optimization of Robotic Grasps", Fig. 8.
    """
    require_planar(problem)
    with styled():
        figure = Picture(figsize=(COLUMN, COLUMN))
        axes = figure.add_axes((0.15, 0.13, 0.82, 0.84))
        draw_planar_grasp(axes, problem, grasp)
        axes.set_xlabel("$x$ [mm]")
        axes.set_ylabel("$y$ [mm]")
    return figure


def require_planar(problem: Problem) -> None:
    """Raise a GraspAtlasError for problems that are not planar."""
    if not problem.object_joint_model.planar:
        raise GraspAtlasError(
            f"problem '{problem.name}' is not planar; draw its grasps with plot_best_and_worst or graspatlas.view"
        )


def draw_planar_grasp(axes: Axes, problem: Problem, grasp: Grasp, *, thickness: float = 1.0) -> None:
    """Draw one grasp into axes, in millimetres, to scale.

    Args:
        axes: The axes.
        problem: A planar problem.
        grasp: The grasp.
        thickness: Factor on the widths of lines.
    """
    anchors = []
    for chain in _chains(problem, grasp):
        anchors.append(chain[0])
        axes.plot(*chain.T, color=PHALANX, lw=2.6 * thickness, solid_capstyle="round", zorder=3)
        axes.plot(*chain[:-1].T, ls="", marker="o", ms=3.4 * thickness, mfc="white", mec=INK, mew=0.7, zorder=4)
    axes.add_patch(Polygon(np.array(anchors), closed=True, facecolor=PALM, edgecolor="#b5b5b5", lw=0.6, zorder=0))
    for arc in _arcs(problem, grasp):
        axes.plot(*arc.T, color=OBJECT, lw=1.7 * thickness, zorder=2)
    points, normals = 1e3 * grasp.contact_points[:, :2], grasp.contact_normals[:, :2]
    size = 0.11 * float(np.ptp(np.array(anchors), axis=0).max())
    axes.quiver(
        *points.T, *(size * normals).T, angles="xy", scale_units="xy", scale=1.0, color="#e08a1e", width=0.007, zorder=5
    )
    axes.plot(*points.T, ls="", marker="o", ms=2.6 * thickness, color=CONTACT, zorder=6)
    axes.set_aspect("equal")


def _chains(problem: Problem, grasp: Grasp) -> list[Array]:
    """Joints and fingertip of each finger, from the palm outwards [j, 2], millimetres."""
    import pinocchio as pin

    model = pin.buildModelFromXML(problem.hand.tree)
    data = model.createData()
    pin.forwardKinematics(model, data, np.asarray(grasp.q, float))
    chains = []
    for contact in problem.contacts:
        joint, T = problem.hand.frame(contact.frame)
        points = [np.asarray(data.oMi[joint].act(T[:3, :3] @ contact.hand.point() + T[:3, 3]))]
        while joint > 0:
            points.append(np.asarray(data.oMi[joint].translation))
            joint = model.parents[joint]
        chains.append(1e3 * np.array(points[::-1])[:, :2])
    return chains


def _arcs(problem: Problem, grasp: Grasp) -> list[Array]:
    """The curves of the object that may be touched [n, 2], millimetres."""
    T = grasp.T_palm_object
    arcs = []
    for contact in problem.contacts:
        ends = contact.object.interval("u") or (-np.pi, np.pi)
        v = float(contact.frozen.get("v", 0.0))
        points = np.array([contact.object.point(u, v) for u in np.linspace(*ends, STEPS)])
        arcs.append(1e3 * (points @ T[:3, :3].T + T[:3, 3])[:, :2])
    return arcs
