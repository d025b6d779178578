"""Meshes of hand and object, read from their URDFs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from graspatlas.errors import GraspAtlasError
from graspatlas.hand.body import Body
from graspatlas.hand.mesh_files import check_meshes
from graspatlas.problem.problem import Problem
from graspatlas.support.arrays import Array
from graspatlas.viewer.scene.meshes import Mesh, from_coal
from graspatlas.viewer.scene.stick_figure import Shape, bones, outlines

if TYPE_CHECKING:
    import pinocchio as pin

__all__ = ["BodyShapes"]


class BodyShapes:
    """Meshes of a problem's hand and object; each file is read once. What has none is sketched.

    Args:
        problem: The problem.

    Raises:
        GraspAtlasError: If a mesh cannot be read.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._files: dict[tuple[str | float, ...], Mesh | None] = {}
        self._hand = self._read(problem.hand)
        self._object = self._read(problem.object)

    def hand(self, q: Array) -> Iterator[Shape]:
        """The hand at joint configuration q (nq,)."""
        if not self._hand[1].ngeoms:
            return bones(self._problem, self._hand[0], q)
        return self._placed(*self._hand, q)

    def object(self) -> Iterator[Shape]:
        """The object in its own frame."""
        if not self._object[1].ngeoms:
            return outlines(self._problem)
        return self._placed(*self._object, None)

    def _read(self, body: Body) -> tuple[pin.Model, pin.GeometryModel, list[Mesh | None]]:
        """Pinocchio's model and geometry, and the meshes; collision shapes where a body has no visual ones."""
        import pinocchio as pin

        check_meshes(body)
        try:
            model = pin.buildModelFromXML(body.tree)
            for kind in (pin.VISUAL, pin.COLLISION):
                geometry = pin.buildGeomFromUrdfString(model, body.urdf, kind, package_dirs=list(body.package_dirs))
                if geometry.ngeoms:
                    break
        except (ValueError, RuntimeError) as error:
            reason = " ".join(str(error).rpartition("message: ")[2].split())
            raise GraspAtlasError(
                f"cannot show '{body.name}' ({body.urdf_path or 'URDF text'}): {reason} "
                f"(package:// paths are looked up in {', '.join(body.package_dirs) or 'no folder'}); "
                "correct the path, or save the mesh as OBJ or STL"
            ) from None
        return model, geometry, [self._mesh(item) for item in geometry.geometryObjects]

    def _mesh(self, item: pin.GeometryObject) -> Mesh | None:
        if not hasattr(item.geometry, "tri_indices"):
            return from_coal(item.geometry)
        key = (item.meshPath, *item.meshScale)
        if key not in self._files:
            self._files[key] = from_coal(item.geometry)
        return self._files[key]

    @staticmethod
    def _placed(
        model: pin.Model, geometry: pin.GeometryModel, meshes: list[Mesh | None], q: Array | None
    ) -> Iterator[Shape]:
        import pinocchio as pin

        data, geometry_data = model.createData(), geometry.createData()
        pin.forwardKinematics(model, data, pin.neutral(model) if q is None else np.asarray(q, float))
        pin.updateGeometryPlacements(model, data, geometry, geometry_data)
        for item, mesh, placement in zip(geometry.geometryObjects, meshes, geometry_data.oMg, strict=True):
            if mesh is not None:
                red, green, blue, opacity = (float(c) for c in item.meshColor)
                yield mesh, np.array(placement.homogeneous), (red, green, blue, opacity)
