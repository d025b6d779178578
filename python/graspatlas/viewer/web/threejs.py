"""Meshes, lamps, cameras and text in the object format of three.js, packed as meshcat reads it."""

from __future__ import annotations

import base64
import uuid
from typing import Literal, TypedDict

import numpy as np

from graspatlas.support.arrays import AnyArray, Array
from graspatlas.viewer.scene.meshes import Mesh
from graspatlas.viewer.scene.scene import Colour

__all__ = ["Content", "ground", "group", "light", "mesh", "perspective_camera", "sprite"]

Item = dict[str, object]
Kind = Literal["geometries", "materials", "textures", "images"]


class Content(TypedDict, total=False):
    """An object with the geometries, materials, textures and images that it needs."""

    metadata: Item
    geometries: list[Item]
    materials: list[Item]
    textures: list[Item]
    images: list[Item]
    object: Item


#: Names and MessagePack codes of the arrays that meshcat reads.
ARRAYS = {"int16": ("Int16Array", 0x13), "uint32": ("Uint32Array", 0x16), "float32": ("Float32Array", 0x17)}
#: Names of the lists that stand beside an object.
LISTS: tuple[Kind, ...] = ("geometries", "materials", "textures", "images")
#: Half the side of the cube in which the first lamp throws shadows [m].
SHADOW_REACH = 0.45


def mesh(shape: Mesh, T: Array, colour: Colour, *, through: float = 0.0) -> Content:
    """A mesh at placement T [4, 4].

    Args:
        shape: The mesh; one that stands in several contents of a group is sent once.
        T: Its placement.
        colour: Its colour.
        through: Opacity of an image of it that is seen through everything; 0 for the mesh itself.
    """
    opacity = through or colour[3]
    clear = opacity < 1.0
    material: Item = {
        "uuid": _name(),
        "type": "MeshPhongMaterial",
        "color": _number(colour),
        "specular": 0x3A3A3A,
        "shininess": 55,
        "side": 0 if through else 2,
        "opacity": opacity,
        "transparent": clear,
        "depthWrite": not clear,
        "depthTest": not through,
    }
    geometry = _geometry(shape)
    solid = not clear
    body = {"type": "Mesh", "geometry": geometry["uuid"], "material": material["uuid"]}
    shadows = {"castShadow": solid, "receiveShadow": solid, "renderOrder": 2 if through else int(clear)}
    return {
        "geometries": [geometry],
        "materials": [material],
        "object": {"uuid": _name(), **body, **shadows, "matrix": T.T.ravel().tolist()},
    }


def group(members: list[Content]) -> Content:
    """Several contents as one; what they share is kept once."""
    content: Content = {"metadata": {"version": 4.5, "type": "Object"}}
    for key in LISTS:
        items = {item["uuid"]: item for member in members for item in member.get(key, [])}
        content[key] = list(items.values())
    content["object"] = {"uuid": _name(), "type": "Group", "children": [member["object"] for member in members]}
    return content


def sprite(png: bytes, place: Array, width: float, height: float) -> Content:
    """A picture that faces the camera from wherever it is seen.

    Args:
        png: The picture, as a PNG file.
        place: Its middle [3], metres.
        width: Its width in metres.
        height: Its height in metres.
    """
    image, texture, material = _name(), _name(), _name()
    T = np.diag([width, height, 1.0, 1.0])
    T[:3, 3] = place
    return {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": [],
        "images": [_image(image, png)],
        "textures": [_texture(texture, image)],
        "materials": [{"uuid": material, "type": "SpriteMaterial", "map": texture, "transparent": True}],
        "object": {"uuid": _name(), "type": "Sprite", "material": material, "matrix": T.T.ravel().tolist()},
    }


def ground(png: bytes, low: Array, high: Array) -> Content:
    """A picture that lies on the floor.

    Args:
        png: The picture, as a PNG file; its first row lies along the least y.
        low: Its corner with the least x and y [3], metres.
        high: The opposite corner [3].
    """
    image, texture, material, geometry = _name(), _name(), _name(), _name()
    x, y = (np.array([low[k], high[k]]) for k in range(2))
    corners = np.array([[x[0], y[0], low[2]], [x[1], y[0], low[2]], [x[1], y[1], low[2]], [x[0], y[1], low[2]]])
    attributes = {
        "position": _packed(corners.astype(np.float32)),
        "normal": _packed(np.tile(np.array([0, 0, 1], np.float32), (4, 1))),
        "uv": _packed(np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)),
    }
    index = _packed(np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    look = {"type": "MeshBasicMaterial", "map": texture, "transparent": True, "depthWrite": False, "side": 0}
    content: Content = {
        "geometries": [
            {"uuid": geometry, "type": "BufferGeometry", "data": {"attributes": attributes, "index": index}}
        ],
        "images": [_image(image, png)],
        "textures": [_texture(texture, image)],
        "materials": [{"uuid": material, **look}],
        "object": {"uuid": _name(), "type": "Mesh", "geometry": geometry, "material": material},
    }
    return group([content])


def light(place: Array, intensity: float) -> Content:
    """A lamp that shines from a place [3] towards the origin, everywhere with the same intensity."""
    T = np.eye(4)
    T[:3, 3] = place
    edges = {"left": -SHADOW_REACH, "right": SHADOW_REACH, "top": SHADOW_REACH, "bottom": -SHADOW_REACH}
    camera = {"uuid": _name(), "type": "OrthographicCamera", "near": 0.1, "far": 3.0, "zoom": 1, **edges}
    shadow = {"camera": camera, "mapSize": [2048, 2048], "bias": -0.0004, "normalBias": 0.0012, "radius": 3}
    return {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": [],
        "materials": [],
        "object": {
            "uuid": _name(),
            "type": "DirectionalLight",
            "color": 0xFFFFFF,
            "intensity": intensity,
            "shadow": shadow,
            "matrix": T.T.ravel().tolist(),
        },
    }


def perspective_camera(field_of_view: float) -> Content:
    """A camera with this angle between top and bottom of its picture [rad]."""
    lens = {"fov": float(np.degrees(field_of_view)), "aspect": 1, "near": 0.01, "far": 100, "zoom": 1}
    return {"object": {"uuid": _name(), "type": "PerspectiveCamera", **lens}}


def _image(name: str, png: bytes) -> Item:
    return {"uuid": name, "url": "data:image/png;base64," + base64.b64encode(png).decode("ascii")}


def _texture(name: str, image: str) -> Item:
    return {"uuid": name, "image": image, "wrap": [1001, 1001], "repeat": [1, 1], "anisotropy": 4}


def _geometry(shape: Mesh) -> Item:
    normals = np.round(32767.0 * shape.normals).astype(np.int16)
    return {
        "uuid": str(uuid.uuid5(uuid.NAMESPACE_OID, str(id(shape)))),
        "type": "BufferGeometry",
        "data": {
            "attributes": {
                "position": _packed(shape.vertices.astype(np.float32)),
                "normal": {**_packed(normals), "normalized": True},
            },
            "index": _packed(shape.faces.astype(np.uint32)),
        },
    }


def _packed(rows: AnyArray) -> Item:
    import umsgpack

    kind, code = ARRAYS[rows.dtype.name]
    data = umsgpack.Ext(code, np.ascontiguousarray(rows).tobytes())
    return {"itemSize": rows.shape[1], "type": kind, "array": data, "normalized": False}


def _number(colour: Colour) -> int:
    red, green, blue = (round(255.0 * c) for c in colour[:3])
    return (red << 16) | (green << 8) | blue


def _name() -> str:
    return str(uuid.uuid4())
