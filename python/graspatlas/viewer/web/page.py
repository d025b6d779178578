"""The scene as commands of the meshcat viewer, and a page of commands that needs neither server nor network."""

from __future__ import annotations

import base64
import html
import importlib.util
import io
from collections.abc import Iterable, Iterator
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np
from PIL import Image

from graspatlas.errors import GraspAtlasError
from graspatlas.viewer.render.shading import FloorShadow
from graspatlas.viewer.render.text_images import LINE, SMALL, caption_image, legend_image
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.captions import Caption, caption, scene_legend
from graspatlas.viewer.scene.scene import SHOW_THROUGH, Colour, Part, Scene
from graspatlas.viewer.web.threejs import Content, ground, group, light, mesh, perspective_camera, sprite

__all__ = [
    "ASPECT",
    "LETTERS",
    "ROOT",
    "THROUGH",
    "Command",
    "commands",
    "filled_page",
    "floor_shadow",
    "legend_rows",
    "meshcat_script",
    "png_bytes",
    "set_object",
    "studio",
]

Command = dict[str, object]

#: Path of the scene in meshcat's tree.
ROOT = "/graspatlas"
#: Width over height for which the camera is placed, and where the grasps are then: left, right, bottom, top.
ASPECT = 1.6
WINDOW = (-0.88, 0.88, -0.56, 0.90)
#: Colours of the background at the top and at the bottom.
BACKGROUND = ((0.97, 0.975, 0.98), (0.84, 0.855, 0.875))
#: Lamps about the camera (right, up, backwards) and their intensity; the first one throws shadows.
LAMPS = (((-0.55, 0.9, 0.75), 0.62), ((0.9, 0.15, 0.6), 0.22), ((0.35, 0.75, -0.75), 0.20))
#: Screen colours are darker than light for the same shadow.
FLOOR_DARKNESS = 0.6
#: What shows through is drawn over the visible part too, so it is fainter here than in the picture.
THROUGH = 0.6
#: Height of letters in the images that captions are made of [pixels].
LETTERS = 72.0
#: Width of a caption compared with the distance between the grasps, and its height with that of the page.
CAPTION_WIDTH, CAPTION_HEIGHT = 0.9, 0.115
#: A caption of the usual height.
USUAL = Caption("title", "index", "motion")


def filled_page(name: str, commands: Iterable[Command], legend: str, player: str = "", script: str = "") -> str:
    """The page of some commands.

    Args:
        name: What it shows, for the title.
        commands: What meshcat is told.
        legend: HTML of the foot.
        player: HTML of what stands above the foot, if anything.
        script: HTML of what runs after the page's own script.
    """
    import umsgpack

    data = [base64.b64encode(umsgpack.packb(command)).decode("ascii") for command in commands]
    template = Template((resources.files("graspatlas.viewer.web") / "page.html").read_text(encoding="utf-8"))
    return template.substitute(
        title=html.escape(f"graspatlas: {name}"),
        legend=legend,
        player=player,
        script=script,
        meshcat=meshcat_script(),
        commands=",\n".join(f'"{line}"' for line in data),
        aspect=ASPECT,
    )


def meshcat_script() -> str:
    """Text of meshcat's viewer; found without importing meshcat, which would load its server."""
    spec = importlib.util.find_spec("meshcat")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        script = Path(folder) / "viewer" / "dist" / "main.min.js"
        if script.is_file():
            return script.read_text(encoding="utf-8")
    raise GraspAtlasError("meshcat's viewer is not installed; install it with 'pip install meshcat'")


def legend_rows(name: str, texts: list[str], colours: list[tuple[Colour, str]]) -> str:
    """A name, texts, and what colours stand for, as HTML."""
    rows = [f"<b>{html.escape(name)}</b>", *(f"<span>{html.escape(text)}</span>" for text in texts)]
    for colour, text in colours:
        css = ", ".join(str(round(255.0 * c)) for c in colour[:3])
        dot = f'<i style="background: rgba({css}, {1.0 if colour[3] >= 1.0 else 0.6})"></i>'
        rows.append(f"<span>{dot}{html.escape(text)}</span>")
    return "\n".join(rows)


def commands(scene: Scene, *, with_legend: bool = False) -> Iterator[Command]:
    """Commands that make meshcat show a scene.

    Args:
        scene: The scene.
        with_legend: Whether the colours are explained below the captions.
    """
    words = [caption(scene.result, exhibit) for exhibit in scene.exhibits]
    more = (max(w.rows for w in words) - 1) * LINE * SMALL * LETTERS / caption_image(USUAL, LETTERS).height
    left, right, bottom, top = WINDOW
    camera = scene.camera(ASPECT, (left, right, bottom + 2.0 * CAPTION_HEIGHT * more, top))
    yield from studio(camera)
    centred = np.eye(4)
    centred[:3, 3] = -camera.target
    yield {"type": "set_transform", "path": ROOT, "matrix": centred.T.ravel().tolist()}
    for exhibit in scene.exhibits:
        for name in ("hand", "object", "obstacle", "arm", "contact", "normal", "ellipsoid", "clash"):
            parts = [part for part in exhibit.parts if part.group == name]
            members = [mesh(part.mesh, part.T, part.colour) for part in parts]
            if name in SHOW_THROUGH:
                through = THROUGH * SHOW_THROUGH[name]
                members += [mesh(part.mesh, part.T, part.colour, through=through) for part in parts]
            if members:
                yield set_object(f"{ROOT}/{exhibit.name}/{name}", group(members))
    yield set_object(f"{ROOT}/floor", floor_shadow(part for exhibit in scene.exhibits for part in exhibit.parts))
    yield from _captions(scene, camera, [caption_image(w, LETTERS) for w in words], with_legend)


def set_object(path: str, content: Content) -> Command:
    """Command that shows an object at a path of meshcat's tree."""
    return {"type": "set_object", "path": path, "object": content}


def set_property(path: str, name: str, value: object) -> Command:
    return {"type": "set_property", "path": path, "property": name, "value": value}


def studio(camera: Camera) -> Iterator[Command]:
    """Background, lamps and camera."""
    for path in ("Grid", "Axes", "Lights/SpotLight", "Lights/PointLightNegativeX", "Lights/PointLightPositiveX"):
        yield set_property(f"/{path}", "visible", False)
    yield set_property("/Lights/FillLight", "visible", False)
    yield set_property("/Lights/AmbientLight/<object>", "intensity", 0.42)
    for name, colour in zip(("top_color", "bottom_color"), BACKGROUND, strict=True):
        yield set_property("/Background", name, list(colour))
    for i, (place, intensity) in enumerate(LAMPS):
        path = f"/Lights/lamp_{i}"
        yield set_object(path, light(np.asarray(place) @ camera.axes, intensity))
        yield set_property(f"{path}/<object>", "castShadow", i == 0)
    x, y, z = (float(c) for c in camera.distance * camera.direction)
    yield set_object("/Cameras/default/rotated", perspective_camera(camera.field_of_view))
    yield set_property("/Cameras/default/rotated/<object>", "position", [x, z, -y])


def floor_shadow(parts: Iterable[Part]) -> Content:
    """The shadow of hands and objects on the floor, as a see-through picture."""
    placed = [part.mesh.moved(part.T) for part in parts if part.group in ("hand", "object")]
    floor = FloorShadow(np.concatenate([shape.vertices[shape.faces] for shape in placed]))
    pixels = np.zeros((*floor.dark.shape, 4), np.uint8)
    pixels[..., 3] = np.round(255.0 * np.clip(FLOOR_DARKNESS * floor.dark, 0.0, 1.0))
    return ground(png_bytes(Image.fromarray(pixels)), *floor.corners)


def _captions(scene: Scene, camera: Camera, images: list[Image.Image], with_legend: bool) -> Iterator[Command]:
    """Captions below the grasps, and the legend below those; they turn with the camera and stay readable."""
    half = camera.distance * np.tan(camera.field_of_view / 2.0) * np.array([ASPECT, 1.0])
    seen = [camera.project(exhibit.points, ASPECT)[:, :2] * half for exhibit in scene.exhibits]
    middles = [float(points[:, 0].min() + points[:, 0].max()) / 2.0 for points in seen]
    bottom = min(float(points[:, 1].min()) for points in seen)
    widest = CAPTION_WIDTH * (middles[1] - middles[0] if len(middles) > 1 else 2.0 * half[0])
    visible = 2.0 * camera.distance * np.tan(camera.field_of_view / 2.0)
    usual = caption_image(USUAL, LETTERS).height
    pixel = min(widest / max(image.width for image in images), CAPTION_HEIGHT * visible / usual)
    under = bottom - 0.15 * pixel * usual
    for exhibit, middle, image in zip(scene.exhibits, middles, images, strict=True):
        height = pixel * image.height
        place = camera.target + np.array([middle, under - 0.5 * height]) @ camera.axes[:2]
        yield set_object(f"{ROOT}/{exhibit.name}/caption", sprite(png_bytes(image), place, pixel * image.width, height))
    if with_legend:
        image = legend_image(scene_legend(scene), 0.5 * LETTERS)
        tallest = pixel * max(shown.height for shown in images)
        middle = sum(middles) / len(middles)
        place = camera.target + np.array([middle, under - tallest - 0.25 * pixel * usual]) @ camera.axes[:2]
        size = min(pixel, 0.96 * 2.0 * half[0] / image.width)
        yield set_object(f"{ROOT}/legend", sprite(png_bytes(image), place, size * image.width, size * image.height))


def png_bytes(image: Image.Image) -> bytes:
    """A picture as a PNG file."""
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()
