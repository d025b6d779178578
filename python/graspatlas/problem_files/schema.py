"""The schema of problem files."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Union, get_type_hints

from pydantic import BeforeValidator, Field, create_model, model_validator

import graspatlas.requirements.collision_free
import graspatlas.requirements.force_closure
import graspatlas.requirements.holding_force
import graspatlas.requirements.joint_margin  # noqa: F401
from graspatlas.patches.base import Patch
from graspatlas.patches.registry import patch_types
from graspatlas.problem.requirement import REQUIREMENTS
from graspatlas.problem_files.schema_tables import Finite, Table, exactly_one, known_name, table_of
from graspatlas.quality.evaluation import INDICES
from graspatlas.support.validation import PlainTable

__all__ = ["ProblemTable", "json_schema"]

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Scale = Annotated[list[Positive], Field(min_length=3, max_length=3)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Postures = dict[str, Finite]

HAND_SOURCES = ("urdf", "example_robot_data", "robot_descriptions")
OBJECT_SOURCES = ("urdf", "mesh", "sphere", "box", "cylinder")


class BodyTable(Table):
    """What hand and object have in common."""

    name: str | None = None
    """Name for people; that of the file by default."""
    urdf: str | None = None
    """Path of a URDF file: absolute, relative to this file, or package://..."""
    package_paths: list[str] = Field(default_factory=list)
    """Folders in which package:// paths are looked up, relative to this file."""
    srdf: str | None = None
    """Path of an SRDF file with pairs of links that may touch."""
    urdf_text: str | None = None
    """Text of the URDF, as stored problems carry it; urdf is then only a name."""
    srdf_text: str | None = None
    """Text of the SRDF, as stored problems carry it."""


class HandTable(BodyTable):
    """The hand. The root of its URDF is the palm, and the world."""

    example_robot_data: str | None = None
    """Name of a URDF in example-robot-data, such as allegro_right_hand."""
    robot_descriptions: str | None = None
    """Name of a robot in robot_descriptions, such as allegro_hand_description; needs graspatlas[hands]."""
    joints: Annotated[list[str], Field(min_length=1)] | None = None
    """Joints that move; all others are locked. All move by default, those in `locked` excepted."""
    locked: Postures = Field(default_factory=dict)
    """Positions of locked joints [rad or m]; 0 where nothing is said."""
    limits: dict[str, Pair] = Field(default_factory=dict)
    """Limits [lower, upper] that replace the URDF's [rad or m]."""
    enlarge_limits: Finite = 0.0
    """Added to both ends of the limits of all revolute joints [rad], those in `limits` excepted."""

    @model_validator(mode="after")
    def _one_source(self) -> HandTable:
        exactly_one(self, HAND_SOURCES, "the hand")
        return self


class SphereShape(Table):
    """A sphere about the object's origin."""

    radius: Positive
    """Radius [m]."""


class BoxShape(Table):
    """A box about the object's origin."""

    size: Scale
    """Edges along x, y and z [m]."""


class CylinderShape(Table):
    """A cylinder about the object's origin, its axis along z."""

    radius: Positive
    """Radius [m]."""
    length: Positive
    """Length along z [m]."""


class PoseGuessTable(Table):
    """About where the object is when it is held."""

    xyz: Vector
    """Position in the palm's frame [m]."""
    quat_xyzw: Quaternion | None = None
    """Rotation; it is normalised. Without it any rotation will do."""


class ObjectTable(BodyTable):
    """The object."""

    mesh: str | None = None
    """Path of a mesh file (OBJ, STL, DAE), absolute or relative to this file."""
    scale: Positive | Scale | None = None
    """From the mesh's unit to metres, such as 0.001; 1 by default."""
    sphere: SphereShape | None = None
    """A sphere."""
    box: BoxShape | None = None
    """A box."""
    cylinder: CylinderShape | None = None
    """A cylinder along z."""
    joint: Literal["free_flyer", "planar"] = "free_flyer"
    """How it moves: in space, or in the palm's x-y plane."""
    pose_guess: PoseGuessTable | None = None
    """Where the search for a first grasp starts when x1 is left out."""

    @model_validator(mode="after")
    def _one_source(self) -> ObjectTable:
        exactly_one(self, OBJECT_SOURCES, "the object")
        return self


class MotionsTable(Table):
    """Principal hand motions: recorded postures, or their mean and covariance; and couplings of joints."""

    samples: str | None = None
    """Postures: a CSV file with joint names in the first row, or an NPZ file with `samples` [z, h] and `joints` [h]."""
    joints: list[str] | None = None
    """Joint names, in the order of mean and covariance."""
    mean: list[Finite] | None = None
    """Mean posture [rad or m]."""
    covariance: list[list[Finite]] | None = None
    """Covariance of the postures."""
    couplings: list[Postures] = Field(default_factory=list)
    """Sums of joints that keep their value, such as {index_dip: 1, index_pip: -0.7}; they count among the s frozen."""


class FirstGraspTable(Table):
    """A first feasible grasp x1."""

    joints: Postures
    """Position of every joint that moves [rad or m]."""
    object_xyz: Vector
    """Position of the object in the palm's frame [m]."""
    object_quat_xyzw: Quaternion
    """Rotation of the object; it is normalised."""
    parameters: list[Finite] | None = None
    """Free patch parameters; found from the contact points by default."""


class DefaultsTable(Table):
    """Options to use when the caller names none."""

    dimension: int | None = Field(None, ge=1)
    """k, dimension of the set of relevant grasps."""
    radius: Positive | None = None
    """r, of a chart [rad, and lengths in units of length_scale]."""
    epsilon: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """How different neighbouring charts may be."""
    quality: Annotated[str, known_name("quality index", lambda: INDICES)] | None = Field(
        None, json_schema_extra={"enum": list(INDICES)}
    )
    """Quality index."""


def _patch_table() -> object:
    """A patch of any type; those that lie on another patch lie on one that does not."""
    on_patch = {cls for cls in patch_types() if Patch in get_type_hints(cls).values()}
    plain = [_typed(cls, None) for cls in patch_types() if cls not in on_patch]
    tables = plain + [_typed(cls, _one_of(plain)) for cls in patch_types() if cls in on_patch]
    return _one_of(tables)


def _one_of(tables: list[type[Table]]) -> object:
    return Annotated[Union[tuple(tables)], Field(discriminator="type")]  # noqa: UP007


def _typed(cls: type[Patch], patch: object) -> type[Table]:
    return table_of(cls, patch=patch, type=(Literal[cls.kind], ...))


def _with_values(value: object) -> object:
    """A requirement by its name alone has its default values."""
    if isinstance(value, str):
        return {value: {}}
    if isinstance(value, dict):
        return {key: {} if given is None else given for key, given in value.items()}
    return value


def _requirement_table() -> object:
    tables: dict[str, Any] = {
        name: (table_of(requirement) | None, Field(None, description=(requirement.__doc__ or "").partition("\n")[0]))
        for name, requirement in REQUIREMENTS.items()
    }
    table = create_model("RequirementTable", __base__=Table, __doc__="One requirement.", **tables)
    stated = Literal[tuple(REQUIREMENTS)] | table
    return Annotated[table, BeforeValidator(_with_values, json_schema_input_type=stated)]


# Annotations made at run time, which a type checker cannot read.
PatchTable: Any = _patch_table()
RequirementTable: Any = _requirement_table()


class ContactTable(Table):
    """Two patches that touch: their points coincide and their normals oppose."""

    frame: str
    """Link or frame of the hand that carries the hand's patch."""
    hand: PatchTable
    """Patch in that frame; its normal points out of the hand."""
    object: PatchTable
    """Patch in the object's frame; its normal points out of the object."""
    frozen: dict[str, Finite] = Field(default_factory=dict)
    """Parameters of the object's patch that do not move, such as {u: 0.5}."""
    hand_frozen: dict[str, Finite] = Field(default_factory=dict)
    """Parameters of the hand's patch that do not move."""


class ProblemTable(Table):
    """A grasp problem of graspatlas. Lengths are in metres, angles in radians."""

    name: str | None = None
    """Its name; that of the file by default."""
    description: str = ""
    """For people."""
    source: str = ""
    """Where its figures come from."""
    hand: HandTable
    """The hand."""
    object: ObjectTable
    """The object."""
    contacts: Annotated[list[ContactTable], Field(min_length=1)]
    """Which patches of hand and object touch."""
    hand_motions: MotionsTable | None = None
    """Principal hand motions, of which the least important are frozen; without them all dimensions are traced."""
    x1: FirstGraspTable | None = None
    """A first feasible grasp."""
    reference: Postures | None = None
    """Posture through which the hand motions that are kept pass; that of x1 by default."""
    length_scale: Positive = 0.01
    """Length that counts as much as one radian [m]."""
    torque_length: Positive | None = None
    """Length that divides torques in indices such as ferrari_canny_epsilon [m]; the largest arm of a contact by "
    "default."""
    defaults: DefaultsTable = Field(default_factory=lambda: DefaultsTable.model_validate({}))
    """Options to use when the caller names none."""
    requirements: list[RequirementTable] = Field(default_factory=list)
    """What the best grasp must meet when the caller does not say."""


def json_schema() -> PlainTable:
    """JSON Schema of problem files, for editors."""
    schema = ProblemTable.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "graspatlas problem"}
