"""From a problem file to a problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from graspatlas.errors import GraspAtlasError, unknown_name
from graspatlas.hand.body import Body
from graspatlas.hand.hand import Hand
from graspatlas.hand.motions import HandMotions, coupling_rows
from graspatlas.hand.robot_files import described_robot, example_robot, find_file, is_mjcf
from graspatlas.hand.urdf import moving_joints
from graspatlas.problem.contacts import Contact
from graspatlas.problem.first_grasp import FirstGrasp
from graspatlas.problem.pose_guess import PoseGuess
from graspatlas.problem.problem import Problem
from graspatlas.problem.requirement import StatedRequirement
from graspatlas.problem_files import documents
from graspatlas.problem_files.faults import ProblemFileError, faults_of_validation, narrowed, one_line
from graspatlas.problem_files.mesh_patches import PatchesOfMeshes
from graspatlas.problem_files.postures import read_postures
from graspatlas.problem_files.schema import (
    ArmTable,
    ContactTable,
    HandTable,
    MotionsTable,
    ObstacleTable,
    ProblemTable,
    ShapedTable,
    SurroundingsTable,
)
from graspatlas.problem_files.schema_tables import Table
from graspatlas.requirements.named import requirement_from_dict
from graspatlas.world.arm import POSES, Arm
from graspatlas.world.obstacle import Obstacle, mesh_body
from graspatlas.world.pose import Pose

__all__ = ["FILL_IN", "read_obstacles", "read_problem"]

#: What stands in a template where the user has to fill in something.
FILL_IN = "FILL_IN"


def read_obstacles(text: str, file: str = "obstacles.yaml", folder: Path | None = None) -> tuple[Obstacle, ...]:
    """The obstacles that a text states as a problem file does, whatever else it states.

    Args and errors are those of :func:`read_problem`.
    """
    document = _document(text, file)
    try:
        stated = document.data if isinstance(document.data, dict) else {}
        table = SurroundingsTable.model_validate({key: stated[key] for key in stated if key == "obstacles"})
    except ValidationError as error:
        raise ProblemFileError(faults_of_validation(file, document, error)) from None
    return _Reading(file, document, folder).obstacles(table.obstacles)


def read_problem(text: str, file: str = "problem.yaml", folder: Path | None = None) -> Problem:
    """The problem that the text of a problem file states.

    Args:
        text: YAML, of which JSON is a part; see ``docs/problem_files.md``.
        file: The file's name, for messages and as the problem's name when it states none.
        folder: Where relative paths start; the current folder by default.

    Raises:
        ProblemFileError: If anything is wrong: file, line, field, what came and what is allowed.
    """
    document = _document(text, file)
    _check_filled_in(file, document)
    try:
        table = ProblemTable.model_validate(document.data)
    except ValidationError as error:
        raise ProblemFileError(faults_of_validation(file, document, error)) from None
    return _Reading(file, document, folder).problem(table)


def _document(text: str, file: str) -> documents.Document:
    try:
        return documents.parse(text)
    except documents.DocumentError as error:
        raise ProblemFileError([f"{file}:{error.line}: {error}"]) from None


def _check_filled_in(file: str, document: documents.Document) -> None:
    """Name what a template leaves to the user."""
    blanks = [path for path in document.lines if document.at(path) == FILL_IN]
    if blanks:
        message = "is still to be filled in; the comment beside it says with what"
        raise ProblemFileError([one_line(file, document, path, message) for path in blanks])


@dataclass(frozen=True)
class _Reading:
    """A file that agrees with the schema, on its way to a problem."""

    file: str
    document: documents.Document
    folder: Path | None

    @contextmanager
    def _within(self, *path: str | int) -> Iterator[None]:
        """Errors in this block are about this field, or one inside it."""
        try:
            yield
        except ProblemFileError:
            raise
        except GraspAtlasError as error:
            inner, message = narrowed(self.document, path, str(error))
            raise ProblemFileError([one_line(self.file, self.document, inner, message)]) from None

    def problem(self, table: ProblemTable) -> Problem:
        """The problem itself."""
        with self._within("hand"):
            full, hand = self._hand(table.hand, "hand")
        with self._within("object"):
            body = self._object(table.object)
        meshes = PatchesOfMeshes(self.folder, tuple(table.object.package_paths), body, table.object.scale is not None)
        contacts = tuple(self._contact(i, contact, hand, meshes) for i, contact in enumerate(table.contacts))
        guess = motions = x1 = None
        if table.object.pose_guess is not None:
            with self._within("object", "pose_guess"):
                guess = PoseGuess.from_dict(table.object.pose_guess.model_dump(exclude_none=True))
        if table.hand_motions is not None:
            with self._within("hand_motions"):
                motions = self._motions(table.hand_motions, hand, moving_joints(full.urdf))
        requirements = tuple(self._requirement(i, requirement) for i, requirement in enumerate(table.requirements))
        obstacles = self.obstacles(table.obstacles)
        arm = self._arm(table.arm) if table.arm is not None else None
        stated = self.document.data
        if stated.get("x1") is not None:
            with self._within("x1"):
                x1 = FirstGrasp.from_dict(stated["x1"])
        with self._within():
            return Problem(
                name=table.name or Path(self.file).stem,
                hand=hand,
                object=body,
                contacts=contacts,
                x1=x1,
                motions=motions,
                reference=stated.get("reference"),
                object_joint=table.object.joint,
                length_scale=table.length_scale,
                defaults=table.defaults.model_dump(exclude_none=True),
                requirements=requirements,
                description=table.description,
                source=table.source,
                pose_guess=guess,
                torque_length=stated.get("torque_length"),
                obstacles=obstacles,
                arm=arm,
            )

    def obstacles(self, tables: Sequence[ObstacleTable]) -> tuple[Obstacle, ...]:
        """The obstacles."""
        return tuple(self._obstacle(i, table) for i, table in enumerate(tables))

    def _hand(self, table: HandTable, field: str) -> tuple[Hand, Hand]:
        """The hand as its URDF has it, and the one with only those joints that move."""
        full = self._whole_hand(table, field)
        hand = full.with_joints(table.joints, table.locked)
        if table.enlarge_limits:
            hand = hand.with_limits_enlarged(table.enlarge_limits)
        _ = hand.mechanism
        return full, hand

    def _arm(self, table: ArmTable) -> Arm:
        poses = {}
        for name in POSES:
            with self._within("arm", name):
                poses[name] = Pose(**getattr(table, name).model_dump())
        with self._within("arm"):
            return Arm(self._hand(table, "arm")[1], table.flange, **poses)

    def _contact(self, i: int, table: ContactTable, hand: Hand, meshes: PatchesOfMeshes) -> Contact:
        stated = self.document.data["contacts"][i]
        with self._within("contacts", i, "hand"):
            on_hand = meshes.patch(stated["hand"], on_object=False)
        with self._within("contacts", i, "object"):
            on_object = meshes.patch(stated["object"], on_object=True)
        with self._within("contacts", i):
            contact = Contact(table.frame, on_hand, on_object, table.frozen, table.hand_frozen)
            hand.frame(contact.frame)
            return contact

    def _requirement(self, i: int, table: Table) -> StatedRequirement:
        with self._within("requirements", i):
            return requirement_from_dict(table.model_dump(exclude_none=True))

    def _obstacle(self, i: int, table: ObstacleTable) -> Obstacle:
        with self._within("obstacles", i):
            pose = Pose(table.xyz, table.quat_xyzw)
            if table.plane is not None:
                return Obstacle(table.name, None, table.plane.normal, table.frame, pose)
            return Obstacle(table.name, self._object(table), None, table.frame, pose)

    def _whole_hand(self, table: HandTable, field: str) -> Hand:
        """The hand as its URDF has it, with the limits that are stated."""
        plain = table.model_dump(
            include={"name", "urdf", "srdf", "urdf_text", "srdf_text", "package_paths", "limits"}, exclude_none=True
        )
        if table.mjcf is not None:
            return self._from_mjcf(table.mjcf, table)
        if table.example_robot_data is not None:
            with self._within(field, "example_robot_data"):
                plain["urdf"] = example_robot(table.example_robot_data)
        if table.robot_descriptions is not None:
            with self._within(field, "robot_descriptions"):
                path, folders = described_robot(table.robot_descriptions)
            if is_mjcf(path):
                return self._from_mjcf(path, table)
            plain |= {"urdf": path, "package_paths": [*folders, *table.package_paths]}
        return Hand.from_dict(plain, self.folder)

    def _from_mjcf(self, path: str, table: HandTable) -> Hand:
        for field in ("package_paths", "urdf_text", "srdf_text"):
            if getattr(table, field):
                raise GraspAtlasError(f"{field} is for hands in URDF; leave it out")
        given = {"mjcf": path, "root": table.root, "name": table.name, "srdf": table.srdf}
        return Hand.from_dict({**given, "limits": table.limits}, self.folder)

    def _object(self, table: ShapedTable) -> Body:
        name = table.name
        if table.sphere is not None:
            return Body.sphere(name or "sphere", table.sphere.radius)
        if table.box is not None:
            return Body.box(name or "box", table.box.size)
        if table.cylinder is not None:
            return Body.cylinder(name or "cylinder", table.cylinder.radius, table.cylinder.length)
        if table.mesh is not None:
            return self._mesh(table.mesh, table)
        plain = table.model_dump(
            include={"name", "urdf", "srdf", "urdf_text", "srdf_text", "package_paths"}, exclude_none=True
        )
        return Body.from_dict(plain, self.folder)

    def _mesh(self, mesh: str, table: ShapedTable) -> Body:
        path = find_file(mesh, self.folder, tuple(table.package_paths)).resolve()
        return mesh_body(table.name or path.stem, path, 1.0 if table.scale is None else table.scale)

    def _motions(self, table: MotionsTable, hand: Hand, known: tuple[str, ...]) -> HandMotions:
        """Hand motions of the joints that move; what is said of locked ones is left out."""
        joints = hand.joints
        if table.samples is None and table.mean is None and table.covariance is None and table.couplings:
            return HandMotions.from_couplings(table.couplings, joints)
        motions = hand.mechanism.completed_motions(self._statistics(table, joints))
        for name in motions.joints:
            if name not in known:
                raise unknown_name("joint", name, known, "one of the hand's that move")
        for name in joints:
            if name not in motions.joints:
                raise GraspAtlasError(f"no values of joint '{name}', which moves: add it, or lock it under hand")
        if len(motions.joints) > len(joints):
            motions = motions.reordered([name for name in motions.joints if name in joints])
        return replace(motions, couplings=coupling_rows(table.couplings, motions.joints))

    def _statistics(self, table: MotionsTable, joints: tuple[str, ...]) -> HandMotions:
        """Mean and covariance, stated or from samples."""
        if table.samples is not None:
            if table.mean is not None or table.covariance is not None:
                raise GraspAtlasError("samples already give mean and covariance: drop these")
            samples, names = read_postures(find_file(table.samples, self.folder), table.samples)
            return HandMotions.from_samples(samples, names)
        if table.mean is None or table.covariance is None:
            raise GraspAtlasError("need samples, or mean and covariance, or couplings")
        for i, row in enumerate(table.covariance):
            if len(row) != (h := len(table.covariance)):
                raise GraspAtlasError(f"row {i} of the covariance holds {len(row)} numbers, not {h}")
        return HandMotions(tuple(table.joints or joints), np.array(table.mean), np.array(table.covariance))
