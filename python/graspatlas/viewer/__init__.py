"""A result to look at: in a browser, as a page and as a picture.

What draws it is imported when it is first used, so that importing the package stays quick.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from graspatlas.errors import GraspAtlasError
from graspatlas.result import Result
from graspatlas.tables import checked_instance

if TYPE_CHECKING:
    import meshcat

__all__ = ["export_html", "save_picture", "view"]


def view(result: Result, *, open_browser: bool = True, wait: bool = True) -> meshcat.Visualizer:
    """Show the best and the worst grasp side by side in a browser.

    The page's address is printed to standard error.

    Args:
        result: The result.
        open_browser: Whether to open the page in the browser.
        wait: Whether to serve the page until Ctrl-C is pressed; otherwise it is served until the program ends.

    Returns:
        Meshcat's visualizer, to add things to; its server has ended if `wait`.

    Raises:
        GraspAtlasError: If a mesh cannot be read, or meshcat's server does not start.
    """
    from graspatlas.viewer.live import show

    checked_instance(result, Result, "result", "graspatlas.optimize")
    return show(result, open_browser=open_browser, wait=wait)


def export_html(result: Result, path: str | os.PathLike[str]) -> None:
    """Write the best and the worst grasp as one page to turn about in a browser.

    The page opens from the disk; it needs neither a server nor the network.

    Args:
        result: The result.
        path: Such as ``"can.html"``; an existing file is replaced.

    Raises:
        GraspAtlasError: If a mesh cannot be read or the file cannot be written.
    """
    from graspatlas.viewer.files import replaced
    from graspatlas.viewer.page import page
    from graspatlas.viewer.scene import Scene

    checked_instance(result, Result, "result", "graspatlas.optimize")
    with replaced(path) as stream:
        stream.write(page(Scene(result)).encode("utf-8"))


def save_picture(result: Result, path: str | os.PathLike[str], *, width: int = 1600, height: int = 900) -> None:
    """Write a picture of the best and the worst grasp as a PNG file; it needs neither browser nor graphics card.

    Args:
        result: The result.
        path: Such as ``"can.png"``; an existing file is replaced.
        width: Width in pixels, at least 320.
        height: Height in pixels, at least 180.

    Raises:
        GraspAtlasError: If the size is too small, a mesh cannot be read or the file cannot be written.
    """
    from graspatlas.viewer.files import replaced
    from graspatlas.viewer.picture import check_size, draw
    from graspatlas.viewer.scene import Scene

    checked_instance(result, Result, "result", "graspatlas.optimize")
    if os.path.splitext(path)[1].lower() != ".png":
        raise GraspAtlasError(f"a picture's name must end in .png, not '{os.fspath(path)}'")
    check_size(width, height)
    with replaced(path) as stream:
        draw(Scene(result), width, height).save(stream, "PNG")
