"""A picture of the regions of a mesh: from two sides, each region in its colour, with a legend."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from PIL import Image

from graspatlas.regions.region import Region
from graspatlas.support.arrays import Array
from graspatlas.viewer.render.picture import painted
from graspatlas.viewer.render.text_images import GREY, legend_image, text_image
from graspatlas.viewer.scene.meshes import smooth
from graspatlas.viewer.scene.scene import Colour, Part, fitted_camera

__all__ = ["draw_regions"]

#: From where the mesh is seen: from above on one side, and from below on the other.
DIRECTIONS = ((0.62, -0.68, 0.40), (-0.62, 0.68, -0.40))
#: Where it is in each picture, which spans -1 to 1: left, right, bottom, top.
WINDOW = (-0.9, 0.9, -0.86, 0.86)
#: What belongs to no region.
REST: Colour = (0.78, 0.79, 0.80, 1.0)
#: Hues follow one another by the golden ratio, so that neighbours in the legend differ.
GOLDEN = 0.618034
#: Regions that have a line in the legend of their own.
MOST_NAMED = 24


def draw_regions(regions: Sequence[Region], rest: Array | None, width: int, height: int) -> Image.Image:
    """The picture of regions.

    Args:
        regions: Regions of one mesh.
        rest: Corners of the triangles that belong to none (n, 3, 3) [m], or None.
        width: Width of the picture in pixels.
        height: Height.
    """
    colours = [_colour(k) for k in range(len(regions))]
    groups = [(region.corners, colour) for region, colour in zip(regions, colours, strict=True)]
    if rest is not None and len(rest):
        groups.append((rest, REST))
    parts = [_part(corners, colour) for corners, colour in groups]
    points = np.concatenate([part.mesh.vertices for part in parts])
    legend = _legend(regions, colours, width, height)
    tall = height - legend.height
    sheet = Image.new("RGB", (width, height), (255, 255, 255))
    for k, direction in enumerate(DIRECTIONS):
        left, right = k * width // 2, (k + 1) * width // 2
        toward = np.array(direction) / np.linalg.norm(direction)
        camera = fitted_camera(points, toward, (right - left) / tall, WINDOW)
        sheet.paste(painted(parts, camera, right - left, tall), (left, 0))
    sheet.paste(legend, (0, tall))
    return sheet


def _colour(k: int) -> Colour:
    """The colour of region k."""
    red, green, blue = colorsys.hls_to_rgb((0.58 + k * GOLDEN) % 1.0, 0.46 + 0.12 * (k % 2), 0.62)
    return (red, green, blue, 1.0)


def _part(corners: Array, colour: Colour) -> Part:
    """Triangles as a part of a scene, whose normals are smooth where they are nearly the same."""
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return Part("object", smooth(vertices, faces.reshape(-1, 3)), np.eye(4), colour)


def _legend(regions: Sequence[Region], colours: Sequence[Colour], width: int, height: int) -> Image.Image:
    """Rows of coloured dots with names, areas and errors."""
    size = max(height / 52.0, 9.0)
    entries = [
        (colour, f"{r.name}  {1e4 * r.area:.3g} cm2, {1e3 * r.error[0]:.2f} mm")
        for r, colour in list(zip(regions, colours, strict=True))[:MOST_NAMED]
    ]
    rows: list[Image.Image] = []
    row: list[tuple[Colour, str]] = []
    for entry in entries:
        if row and legend_image([*row, entry], size).width > 0.96 * width:
            rows.append(legend_image(row, size))
            row = []
        row.append(entry)
    rows.append(legend_image(row, size))
    if len(regions) > MOST_NAMED:
        rows.append(text_image([(f"and {len(regions) - MOST_NAMED} smaller ones", size, GREY)]))
    step = int(1.9 * size)
    foot = Image.new("RGB", (width, step * len(rows) + int(size)), (255, 255, 255))
    for k, image in enumerate(rows):
        foot.paste(image, ((width - image.width) // 2, int(0.5 * size) + k * step), image)
    return foot
