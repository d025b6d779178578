"""A result or a path to look at: in a browser, as a page and as a picture.

What draws it is imported when it is first used, so that importing the package stays quick.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from graspatlas.errors import GraspAtlasError
from graspatlas.paths.path import Path
from graspatlas.result.result import Result

if TYPE_CHECKING:
    import meshcat

__all__ = ["export_html", "save_picture", "view"]


def view(
    shown: Result | Path, *, open_browser: bool = True, wait: bool = True, host: str = "127.0.0.1"
) -> meshcat.Visualizer:
    """Show the best and the worst grasp of a result side by side in a browser; or a path, as a film.

    The page's address is printed to standard error. Meshcat's controls, top right, play a film and have its slider.

    Args:
        shown: The result, or a path of grasps.
        open_browser: Whether to open the page in the browser.
        wait: Whether to serve the page until Ctrl-C is pressed; otherwise it is served until the program ends.
        host: Address on which the page is served. By default only programs of this machine reach it; with
            ``"0.0.0.0"`` everyone who reaches the machine does, and nobody is asked for a password.

    Returns:
        Meshcat's visualizer, to add things to; its server, a thread of this program, has ended if `wait`.

    Raises:
        GraspAtlasError: If a mesh cannot be read, or the page cannot be served on this address.
    """
    from graspatlas.viewer.web.browser import show

    return show(_checked(shown), open_browser=open_browser, wait=wait, host=host)


def export_html(shown: Result | Path, path: str | os.PathLike[str]) -> None:
    """Write the best and the worst grasp of a result as one page to rotate in a browser; or a path, with a slider.

    The page opens from the disk; it needs neither a server nor the network. That of a path opens at the frame that its
    address names, such as ``path.html#frame=30``.

    Args:
        shown: The result, or a path of grasps.
        path: Such as ``"can.html"``; an existing file is replaced.

    Raises:
        GraspAtlasError: If a mesh cannot be read or the file cannot be written.
    """
    from graspatlas.support.files import replaced
    from graspatlas.viewer.scene.animation import Film
    from graspatlas.viewer.scene.scene import Scene
    from graspatlas.viewer.web.animation_page import film_page
    from graspatlas.viewer.web.page import page

    shown = _checked(shown)
    with replaced(path) as stream:
        text = film_page(Film(shown)) if isinstance(shown, Path) else page(Scene(shown))
        stream.write(text.encode("utf-8"))


def save_picture(
    shown: Result | Path,
    path: str | os.PathLike[str],
    *,
    width: int = 1600,
    height: int = 900,
    worst: bool = True,
) -> None:
    """Write a picture of the best and the worst grasp, or six grasps of a path, as a PNG file.

    It needs neither browser nor graphics card.

    Args:
        shown: The result, or a path of grasps.
        path: Such as ``"can.png"``; an existing file is replaced.
        width: Width in pixels, at least 320.
        height: Height in pixels, at least 180.
        worst: Whether the worst grasp stands beside the best; a path's picture has neither.

    Raises:
        GraspAtlasError: If the size is too small, a mesh cannot be read or the file cannot be written.
    """
    from graspatlas.support.files import replaced
    from graspatlas.viewer.render.film_strip import FRAMES, draw_strip
    from graspatlas.viewer.render.picture import check_size, draw
    from graspatlas.viewer.scene.animation import Film
    from graspatlas.viewer.scene.scene import Scene

    if os.path.splitext(path)[1].lower() != ".png":
        raise GraspAtlasError(f"a picture's name must end in .png, not '{os.fspath(path)}'")
    check_size(width, height)
    shown = _checked(shown)
    with replaced(path) as stream:
        if isinstance(shown, Path):
            image = draw_strip(Film(shown, FRAMES), width, height)
        else:
            image = draw(Scene(shown, worst=worst), width, height)
        image.save(stream, "PNG")


def _checked(shown: object) -> Result | Path:
    if isinstance(shown, Result | Path):
        return shown
    raise GraspAtlasError(f"only a graspatlas.Result or a path of grasps can be shown, got {type(shown).__name__}")
