"""A film as commands of the meshcat viewer, and as one page with a slider that needs neither server nor network."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Iterator
from importlib import resources
from string import Template

import numpy as np

from graspatlas.numerics.rotations import quaternions_from_matrices
from graspatlas.support.validation import PlainTable
from graspatlas.viewer.films.animation import Film
from graspatlas.viewer.render.text_images import DARK, GREY, text_image
from graspatlas.viewer.scene.camera import Camera
from graspatlas.viewer.scene.scene import SHOW_THROUGH
from graspatlas.viewer.web.page import (
    ASPECT,
    LETTERS,
    ROOT,
    THROUGH,
    Command,
    filled_page,
    floor_shadow,
    legend_rows,
    png_bytes,
    set_object,
    studio,
)
from graspatlas.viewer.web.threejs import group, mesh, sprite

__all__ = ["film_animation", "film_caption", "film_commands", "film_page"]


#: Where the grasps are in the page: left, right, bottom, top; each spans -1 to 1.
WINDOW = (-0.85, 0.85, -0.62, 0.90)
#: The same where words stand below them.
LABELLED = (-0.92, 0.92, -0.50, 0.92)
#: Height of the caption, and of a label's, compared with that of the page.
CAPTION_HEIGHT, LABEL_HEIGHT = 0.075, 0.085


def film_page(film: Film) -> str:
    """The page's text."""
    files = resources.files("graspatlas.viewer.web")
    player = Template((files / "player.html").read_text(encoding="utf-8"))
    script = (files / "player.js").read_text(encoding="utf-8").replace("$film", _data(film), 1)
    rows = legend_rows(film.name, [film.text], list(film.legend))
    bar = player.substitute(last=len(film) - 1, course=html.escape(film.course))
    return filled_page(film.name, film_commands(film), rows, bar, script)


def _data(film: Film) -> str:
    """What the player needs, as JSON that may stand inside a script."""
    moving = np.flatnonzero(film.moving)
    rows = film.T[:, moving, :3, :].transpose(0, 1, 3, 2).astype(np.float32)
    data: PlainTable = {
        "frames": len(film),
        "paths": [_place(int(i)) for i in moving],
        "placements": base64.b64encode(np.ascontiguousarray(rows).tobytes()).decode("ascii"),
        "readouts": [[readout.value, readout.alarm, readout.details] for readout in film.readouts],
        "seconds": film.seconds,
        "curve": None if film.curve is None else film.curve.T.tolist(),
    }
    return json.dumps(data).replace("<", "\\u003c")


def _place(part: int) -> str:
    """Path of a part in meshcat's tree."""
    return f"{ROOT}/part_{part}"


def _camera(film: Film) -> Camera:
    return film.camera(ASPECT, LABELLED if film.labels else WINDOW)


def film_commands(film: Film) -> Iterator[Command]:
    """Commands that make meshcat show the first frame, each part at a place of its own."""
    camera = _camera(film)
    yield from studio(camera)
    centred = np.eye(4)
    centred[:3, 3] = -camera.target
    yield {"type": "set_transform", "path": ROOT, "matrix": centred.T.ravel().tolist()}
    for i, part in enumerate(film.parts):
        members = [mesh(part.mesh, np.eye(4), part.colour)]
        if part.group in SHOW_THROUGH:
            members.append(mesh(part.mesh, np.eye(4), part.colour, through=THROUGH * SHOW_THROUGH[part.group]))
        yield set_object(_place(i), group(members))
        yield {"type": "set_transform", "path": _place(i), "matrix": part.T.T.ravel().tolist()}
    yield set_object(f"{ROOT}/floor", floor_shadow(film.frame(len(film) // 2)))
    height = LABEL_HEIGHT * _visible(camera)
    for i, label in enumerate(film.labels):
        image = text_image([(label.title, LETTERS, DARK), (label.text, 0.7 * LETTERS, GREY)])
        place = label.place - 0.6 * height * camera.axes[1]
        content = sprite(png_bytes(image), place, height * image.width / image.height, height)
        yield set_object(f"{ROOT}/label_{i}", content)


def film_caption(film: Film) -> Command:
    """What the film is of, below it; for a view that has no foot."""
    camera = _camera(film)
    rest = f"{film.text}; the controls, top right, play it"
    image = text_image([(film.name, LETTERS, DARK), (rest, 0.6 * LETTERS, GREY)])
    visible = _visible(camera)
    height = CAPTION_HEIGHT * visible
    place = camera.target - 0.44 * visible * camera.axes[1]
    return set_object(f"{ROOT}/caption", sprite(png_bytes(image), place, height * image.width / image.height, height))


def _visible(camera: Camera) -> float:
    """Height of what is seen at the camera's target, metres."""
    return float(2.0 * camera.distance * np.tan(camera.field_of_view / 2.0))


def film_animation(film: Film) -> Command:
    """Command that gives meshcat's controls a slider, and buttons to play and pause."""
    times = np.linspace(0.0, film.seconds, len(film))
    rate = (len(film) - 1) / film.seconds if len(film) > 1 else 1.0
    animations = []
    for i in np.flatnonzero(film.moving):
        T = film.T[:, i]
        scale = np.linalg.norm(T[:, :3, 0], axis=1)[:, None, None]
        tracks = {
            ".position": ("vector3", T[:, :3, 3]),
            ".quaternion": ("quaternion", quaternions_from_matrices(T[:, :3, :3] / scale)),
        }
        if np.ptp(scale) > 0.0:
            tracks[".scale"] = ("vector3", np.repeat(scale[:, :, 0], 3, axis=1))
        keys = [
            {
                "name": name,
                "type": kind,
                "keys": [{"time": float(rate * t), "value": v.tolist()} for t, v in zip(times, values, strict=True)],
            }
            for name, (kind, values) in tracks.items()
        ]
        animations.append({"path": _place(int(i)), "clip": {"fps": rate, "name": "path", "tracks": keys}})
    options = {"play": True, "repetitions": 1}
    return {"type": "set_animation", "animations": animations, "options": options, "path": ""}
