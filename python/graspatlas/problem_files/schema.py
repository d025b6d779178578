"""The schema of problem files."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Union, get_type_hints

from pydantic import BeforeValidator, Field, create_model, model_validator
from pydantic_core import PydanticCustomError

from graspatlas.patches.base import Patch
from graspatlas.patches.registry import patch_types
from graspatlas.problem_files.schema_tables import Finite, Table, exactly_one, known_name, table_of
from graspatlas.quality.evaluation import INDICES
from graspatlas.requirements.named import REQUIREMENTS
from graspatlas.support.validation import PlainTable

__all__ = ["ProblemTable", "json_schema"]

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Scale = Annotated[list[Positive], Field(min_length=3, max_length=3)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Postures = dict[str, Finite]

HAND_SOURCES = ("urdf", "mjcf", "example_robot_data", "robot_descriptions")
OBJECT_SOURCES = ("urdf", "mesh", "sphere", "box", "cylinder")


class BodyTable(Table):
    """What hand and object have in common."""

    name: str | None = Field(None, description="Name for people; that of the file by default.")
    urdf: str | None = Field(None, description="Path of a URDF file: absolute, relative to this file, or package://...")
    package_paths: list[str] = Field(
        default_factory=list, description="Folders in which package:// paths are looked up, relative to this file."
    )
    srdf: str | None = Field(None, description="Path of an SRDF file with pairs of links that may touch.")
    urdf_text: str | None = Field(
        None, description="Text of the URDF, as stored problems carry it; urdf is then only a name."
    )
    srdf_text: str | None = Field(None, description="Text of the SRDF, as stored problems carry it.")


class HandTable(BodyTable):
    """The hand. The root of its URDF is the palm, and the world."""

    what: ClassVar[str] = "the hand"

    mjcf: str | None = Field(
        None, description="Path of an MJCF file, absolute or relative to this file; needs graspatlas[mujoco]."
    )
    root: str | None = Field(
        None,
        description="Body of the MJCF that is the palm, and what it carries the hand; by default the last one "
        "before the fingers part.",
    )
    example_robot_data: str | None = Field(
        None, description="Name of a URDF in example-robot-data, such as allegro_right_hand."
    )
    robot_descriptions: str | None = Field(
        None,
        description="Name of a robot in robot_descriptions, such as allegro_hand_description; needs graspatlas[hands].",
    )
    joints: Annotated[list[str], Field(min_length=1)] | None = Field(
        None, description="Joints that move; all others are locked. All move by default, those in `locked` excepted."
    )
    locked: Postures = Field(
        default_factory=dict, description="Positions of locked joints [rad or m]; 0 where nothing is said."
    )
    limits: dict[str, Pair] = Field(
        default_factory=dict, description="Limits [lower, upper] that replace the URDF's [rad or m]."
    )
    enlarge_limits: Finite = Field(
        0.0, description="Added to both ends of the limits of all revolute joints [rad], those in `limits` excepted."
    )

    @model_validator(mode="after")
    def _one_source(self) -> HandTable:
        exactly_one(self, HAND_SOURCES, self.what)
        if self.root is not None and self.mjcf is None and self.robot_descriptions is None:
            message = "root names the palm of an MJCF; a URDF has its own: lock joints instead"
            raise PydanticCustomError("root_of_urdf", "{message}", {"message": message})
        return self


class SphereShape(Table):
    """A sphere about the object's origin."""

    radius: Positive = Field(description="Radius [m].")


class BoxShape(Table):
    """A box about the object's origin."""

    size: Scale = Field(description="Edges along x, y and z [m].")


class CylinderShape(Table):
    """A cylinder about the object's origin, its axis along z."""

    radius: Positive = Field(description="Radius [m].")
    length: Positive = Field(description="Length along z [m].")


class PoseGuessTable(Table):
    """About where the object is when it is held."""

    xyz: Vector = Field(description="Position in the palm's frame [m].")
    quat_xyzw: Quaternion | None = Field(
        None, description="Rotation; it is normalised. Without it any rotation will do."
    )


class ShapedTable(BodyTable):
    """A body that may be a mesh or a simple shape."""

    mesh: str | None = Field(
        None, description="Path of a mesh file (OBJ, STL, DAE), absolute or relative to this file."
    )
    scale: Positive | Scale | None = Field(
        None, description="From the mesh's unit to metres, such as 0.001; 1 by default."
    )
    sphere: SphereShape | None = Field(None, description="A sphere.")
    box: BoxShape | None = Field(None, description="A box.")
    cylinder: CylinderShape | None = Field(None, description="A cylinder along z.")

    @model_validator(mode="after")
    def _scale_of_mesh(self) -> ShapedTable:
        if self.scale is not None and self.mesh is None:
            message = "scale is for a mesh; state other sizes in metres"
            raise PydanticCustomError("scale_of_shape", "{message}", {"message": message})
        return self


class ObjectTable(ShapedTable):
    """The object."""

    joint: Literal["free_flyer", "planar"] = Field(
        "free_flyer", description="How it moves: in space, or in the palm's x-y plane."
    )
    pose_guess: PoseGuessTable | None = Field(
        None, description="Where the search for a first grasp starts when x1 is left out."
    )

    @model_validator(mode="after")
    def _one_source(self) -> ObjectTable:
        exactly_one(self, OBJECT_SOURCES, "the object")
        return self


class PlaneShape(Table):
    """All that lies on the one side of a plane."""

    normal: Vector = Field([0.0, 0.0, 1.0], description="Its normal, out of the obstacle.")


class ObstacleTable(ShapedTable):
    """A thing that the hand must not touch beside the object."""

    name: str = Field(description="Its name, such as table.")
    frame: Literal["object", "palm"] = Field(
        "object", description="What it is fixed to: the object, as a table is on which it stands, or the palm."
    )
    xyz: Vector = Field([0.0, 0.0, 0.0], description="Its position there [m]; a plane goes through it.")
    quat_xyzw: Quaternion = Field([0.0, 0.0, 0.0, 1.0], description="Its rotation; it is normalised.")
    plane: PlaneShape | None = Field(None, description="All that lies on the one side of a plane.")

    @model_validator(mode="after")
    def _one_source(self) -> ObstacleTable:
        exactly_one(self, ("plane", *OBJECT_SOURCES), "an obstacle")
        return self


class PoseTable(Table):
    """Where one frame is in another."""

    xyz: Vector = Field([0.0, 0.0, 0.0], description="Its position [m].")
    quat_xyzw: Quaternion = Field([0.0, 0.0, 0.0, 1.0], description="Its rotation; it is normalised.")


class ArmTable(HandTable):
    """The arm that carries the hand, and where it stands. It is read as a hand is; the root of its URDF is the base."""

    what: ClassVar[str] = "the arm"
    flange: str = Field(description="Link of the arm that carries the hand, such as tool0.")
    palm: PoseTable = Field(
        default_factory=lambda: PoseTable.model_validate({}), description="Pose of the palm in the flange's frame."
    )
    base: PoseTable = Field(
        default_factory=lambda: PoseTable.model_validate({}), description="Pose of the arm's base in the world."
    )
    object: PoseTable = Field(
        default_factory=lambda: PoseTable.model_validate({}),
        description="Pose of the object in the world, when it is grasped; by default the world is the object's frame.",
    )


class MotionsTable(Table):
    """Principal hand motions: recorded postures, or their mean and covariance; and couplings of joints."""

    samples: str | None = Field(
        None,
        description="Postures: a CSV file with joint names in the first row, or an NPZ file with `samples` [z, h] and "
        "`joints` [h].",
    )
    joints: list[str] | None = Field(None, description="Joint names, in the order of mean and covariance.")
    mean: list[Finite] | None = Field(None, description="Mean posture [rad or m].")
    covariance: list[list[Finite]] | None = Field(None, description="Covariance of the postures.")
    couplings: list[Postures] = Field(
        default_factory=list,
        description="Sums of joints that keep their value, such as {index_dip: 1, index_pip: -0.7}; they count among "
        "the s frozen.",
    )


class FirstGraspTable(Table):
    """A first feasible grasp x1."""

    joints: Postures = Field(description="Position of every joint that moves [rad or m].")
    object_xyz: Vector = Field(description="Position of the object in the palm's frame [m].")
    object_quat_xyzw: Quaternion = Field(description="Rotation of the object; it is normalised.")
    parameters: list[Finite] | None = Field(
        None, description="Free patch parameters; found from the contact points by default."
    )


class DefaultsTable(Table):
    """Options to use when the caller names none."""

    dimension: int | None = Field(None, ge=1, description="k, dimension of the set of relevant grasps.")
    radius: Positive | None = Field(None, description="r, of a chart [rad, and lengths in units of length_scale].")
    epsilon: Annotated[float, Field(gt=0.0, lt=1.0)] | None = Field(
        None, description="How different neighbouring charts may be."
    )
    quality: Annotated[str, known_name("quality index", lambda: INDICES)] | None = Field(
        None, json_schema_extra={"enum": list(INDICES)}, description="Quality index."
    )


class OnMeshTable(Table):
    """What is stated of a mesh and made a patch when the file is read."""

    mesh: str | None = Field(
        None, description="Path of a mesh file, absolute or relative to this file; that of the object by default."
    )
    scale: Positive | Scale | None = Field(None, description="From that mesh's unit to metres, such as 0.001.")


class MeshPatchTable(OnMeshTable):
    """A B-spline fitted to a mesh around a point."""

    type: Literal["mesh_patch"]
    center: Vector = Field(
        description="Where, in the frame of the object or link [m]; the nearest point of the mesh counts."
    )
    size: Positive | Annotated[list[Positive], Field(min_length=2, max_length=2)] = Field(
        description="How far it reaches from there along u and along v [m]: one number for both, or two."
    )
    u_axis: Vector = Field([1.0, 0.0, 0.0], description="Direction of u, made parallel to the tangent plane.")
    control_points: Annotated[int, Field(ge=4, le=65)] = Field(
        12, description="Number of control points along u and along v."
    )
    tolerance: Positive = Field(
        0.02, description="Largest distance of the mesh from the patch, as a share of the size."
    )


class RegionTable(OnMeshTable):
    """A region of a mesh, as graspatlas regions finds them."""

    type: Literal["region"]
    name: str = Field(description="Its name, such as cylinder_1; graspatlas regions MESH lists them.")
    tolerance: Positive | None = Field(
        None, description="Largest distance of a region from its patch [m]; 0.6 % of the mesh's diagonal by default."
    )
    whole: bool = Field(
        False,
        description="True for the patch that covers the region, whose corners may lie beside it; otherwise the largest "
        "rectangle of u and v that lies on the region is taken.",
    )


def _patch_table() -> object:
    """A patch of any type; those that lie on another patch lie on one that does not."""
    on_patch = {cls for cls in patch_types() if Patch in get_type_hints(cls).values()}
    plain = [_typed(cls, None) for cls in patch_types() if cls not in on_patch]
    tables = plain + [_typed(cls, _one_of(plain)) for cls in patch_types() if cls in on_patch]
    return _one_of([*tables, MeshPatchTable, RegionTable])


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

    frame: str = Field(description="Link or frame of the hand that carries the hand's patch.")
    hand: PatchTable = Field(description="Patch in that frame; its normal points out of the hand.")
    object: PatchTable = Field(description="Patch in the object's frame; its normal points out of the object.")
    frozen: dict[str, Finite] = Field(
        default_factory=dict, description="Parameters of the object's patch that do not move, such as {u: 0.5}."
    )
    hand_frozen: dict[str, Finite] = Field(
        default_factory=dict, description="Parameters of the hand's patch that do not move."
    )


class ProblemTable(Table):
    """A grasp problem of graspatlas. Lengths are in metres, angles in radians."""

    name: str | None = Field(None, description="Its name; that of the file by default.")
    description: str = Field("", description="For people.")
    source: str = Field("", description="Where its figures come from.")
    hand: HandTable = Field(description="The hand.")
    object: ObjectTable = Field(description="The object.")
    contacts: Annotated[list[ContactTable], Field(min_length=1)] = Field(
        description="Which patches of hand and object touch."
    )
    hand_motions: MotionsTable | None = Field(
        None,
        description="Principal hand motions, of which the least important are frozen; without them all dimensions are "
        "traced.",
    )
    x1: FirstGraspTable | None = Field(None, description="A first feasible grasp.")
    reference: Postures | None = Field(
        None, description="Posture through which the hand motions that are kept pass; that of x1 by default."
    )
    length_scale: Positive = Field(0.01, description="Length that counts as much as one radian [m].")
    torque_length: Positive | None = Field(
        None,
        description="Length that divides torques in indices such as ferrari_canny_epsilon [m]; the largest arm of a "
        "contact by default.",
    )
    defaults: DefaultsTable = Field(
        default_factory=lambda: DefaultsTable.model_validate({}),
        description="Options to use when the caller names none.",
    )
    requirements: list[RequirementTable] = Field(
        default_factory=list, description="What the best grasp must meet when the caller does not say."
    )
    obstacles: list[ObstacleTable] = Field(
        default_factory=list, description="What the hand must not touch beside the object, such as a table."
    )
    arm: ArmTable | None = Field(
        None, description="The arm that carries the hand, for the requirement reachable; none by default."
    )


class SurroundingsTable(Table):
    """The part of a problem file that states what is around the object."""

    obstacles: Annotated[list[ObstacleTable], Field(min_length=1)] = Field(
        description="What the hand must not touch beside the object, such as a table."
    )


def json_schema() -> PlainTable:
    """JSON Schema of problem files, for editors."""
    schema = ProblemTable.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "graspatlas problem"}
