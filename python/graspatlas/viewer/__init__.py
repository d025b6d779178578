"""A result, a path or a trial to look at: in a browser, as a page and as a picture.

What draws it is imported when it is first used, so that importing the package stays quick.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

from graspatlas.errors import GraspAtlasError
from graspatlas.paths.path import Path
from graspatlas.result.grasp_atlas import GraspAtlas
from graspatlas.result.result import Result
from graspatlas.simulation.recording import Recording

if TYPE_CHECKING:
    import meshcat

    from graspatlas.hand.hand import Hand
    from graspatlas.pads.pad import Pad
    from graspatlas.problem.problem import Problem
    from graspatlas.viewer.films.animation import Film
    from graspatlas.viewer.scene.marks import Marked
    from graspatlas.viewer.scene.scene import Scene

__all__ = ["Shown", "export_html", "save_pads_picture", "save_picture", "save_problem_picture", "view"]

#: What can be shown: a result; a path of grasps; a recorded trial, or several beside each other.
Shown: TypeAlias = "Result | Path | Recording | Sequence[Recording]"


def view(
    shown: Shown,
    *,
    open_browser: bool = True,
    wait: bool = True,
    host: str = "127.0.0.1",
    chart: int | None = None,
    worst: bool = True,
) -> meshcat.Visualizer:
    """Show the best and the worst grasp of a result side by side in a browser; or a path or trials, as a film.

    Where no grasp of a result is accepted, the one that comes nearest to it is shown, with what it lacks.

    The page's address is printed to standard error. Meshcat's controls, top right, play a film and have its slider.

    Args:
        shown: The result, a path of grasps, or what :func:`graspatlas.record` recorded: one trial, or a list of them.
        open_browser: Whether to open the page in the browser.
        wait: Whether to serve the page until Ctrl-C is pressed; otherwise it is served until the program ends.
        host: Address on which the page is served. By default only programs of this machine reach it; with
            ``"0.0.0.0"`` everyone who reaches the machine does, and nobody is asked for a password.
        chart: The chart of a result whose grasp is shown, beside the best.
        worst: Whether there is a second grasp: the worst beside the best, or the best beside a chart.

    Returns:
        Meshcat's visualizer, to add things to; its server, a thread of this program, has ended if `wait`.

    Raises:
        GraspAtlasError: If a mesh cannot be read, there is no such chart, or the page cannot be served on this address.
    """
    from graspatlas.viewer.scene.scene import Scene
    from graspatlas.viewer.web.browser import show

    shown = _checked(shown)
    _check_chart(shown, chart)
    told = Scene(shown, worst=worst, chart=chart, arm=True) if isinstance(shown, Result) else _film(shown)
    return show(told, open_browser=open_browser, wait=wait, host=host)


def export_html(shown: Shown | Scene, path: str | os.PathLike[str], *, chart: int | None = None) -> None:
    """Write a page: a result's whole atlas with the hand beside it, to look through; or a path or trials, as a film.

    The page opens from the disk; it needs neither a server nor the network. That of a result shows the grasp of any
    chart that is pointed at, coloured by any index that the result has, and opens at the grasps that its address names,
    such as ``can.html#chart=12,40``; by default at the best, the worst beside it. That of a film opens at the frame
    that its address names, such as ``path.html#frame=30``.

    Args:
        shown: The result, a path of grasps, or what :func:`graspatlas.record` recorded: one trial, or a list of them.
            The scene of a result is shown as the result.
        path: Such as ``"can.html"``; an existing file is replaced.
        chart: The chart at which the page of a result opens.

    Raises:
        GraspAtlasError: If a mesh cannot be read, there is no such chart, or the file cannot be written.
    """
    from graspatlas.storage.files import replaced
    from graspatlas.viewer.explorer.page import explorer_page
    from graspatlas.viewer.scene.scene import Scene
    from graspatlas.viewer.web.animation_page import film_page

    told = shown.result if isinstance(shown, Scene) else _checked(shown)
    _check_chart(told, chart)
    with replaced(path) as stream:
        text = explorer_page(told, chart) if isinstance(told, GraspAtlas) else film_page(_film(told))
        stream.write(text.encode("utf-8"))


def save_picture(
    shown: Shown | Scene,
    path: str | os.PathLike[str],
    *,
    width: int = 1600,
    height: int = 900,
    worst: bool = True,
    chart: int | None = None,
) -> None:
    """Write a picture as a PNG file: best and worst grasp, six grasps of a path, or five moments of each trial.

    It needs neither browser nor graphics card. Where no grasp of a result is accepted, it shows the one that comes
    nearest to it, and what that lacks.

    Args:
        shown: The result, a path of grasps, or what :func:`graspatlas.record` recorded: one trial, or a list of them.
            The scene of a result, which takes a moment to set up, can be shown more than once.
        path: Such as ``"can.png"``; an existing file is replaced.
        width: Width in pixels, at least 320.
        height: Height in pixels, at least 180.
        worst: Whether there is a second grasp: the worst beside the best, or the best beside a chart; only of a result.
        chart: The chart of a result whose grasp is shown, beside the best.

    Raises:
        GraspAtlasError: If the size is too small, there is no such chart, a mesh cannot be read or the file cannot be
            written.
    """
    from graspatlas.storage.files import replaced
    from graspatlas.viewer.films.path_film import path_film
    from graspatlas.viewer.films.trial_film import trial_strips
    from graspatlas.viewer.render.film_strip import FRAMES, draw_rows, draw_strip
    from graspatlas.viewer.render.picture import check_size, draw
    from graspatlas.viewer.scene.scene import Scene

    _check_png(path)
    check_size(width, height)
    shown = shown if isinstance(shown, Scene) else _checked(shown)
    _check_chart(shown, chart)
    with replaced(path) as stream:
        shown = Scene(shown, worst=worst, chart=chart) if isinstance(shown, Result) else shown
        if isinstance(shown, Scene):
            image = draw(shown, width, height)
        elif isinstance(shown, Path):
            image = draw_strip(path_film(shown, FRAMES), width, height)
        else:
            films = trial_strips(shown)
            image = draw_strip(films[0], width, height) if len(films) == 1 else draw_rows(films, width, height)
        image.save(stream, "PNG")


def save_pads_picture(
    hand: Hand, pads: Sequence[Pad], path: str | os.PathLike[str], *, width: int = 1600, height: int = 900
) -> None:
    """Write a picture of a hand with its pads, their normals and the names of their frames, from two sides, as PNG.

    Args:
        hand: The hand; it is drawn nearly open.
        pads: Its pads.
        path: Such as ``"pads.png"``; an existing file is replaced.
        width: Width in pixels, at least 320.
        height: Height in pixels, at least 180.

    Raises:
        GraspAtlasError: If the size is too small, a mesh cannot be read or the file cannot be written.
    """
    from graspatlas.viewer.scene.marks import marked_hand

    _save_marked(lambda: marked_hand(hand, pads), path, width, height)


def save_problem_picture(
    problem: Problem, path: str | os.PathLike[str], *, width: int = 1600, height: int = 900
) -> None:
    """Write a picture of a problem before it is solved, from two sides, as PNG: patches, contacts and normals.

    Hand and object are where x1 has them; without it, the hand at the reference, or open, and the object at the pose
    guess.

    Args:
        problem: The problem.
        path: Such as ``"problem.png"``; an existing file is replaced.
        width: Width in pixels, at least 320.
        height: Height in pixels, at least 180.

    Raises:
        GraspAtlasError: If the size is too small, a mesh cannot be read or the file cannot be written.
    """
    from graspatlas.viewer.scene.marks import marked_problem

    _save_marked(lambda: marked_problem(problem), path, width, height)


def _save_marked(make: Callable[[], Marked], path: str | os.PathLike[str], width: int, height: int) -> None:
    from graspatlas.storage.files import replaced
    from graspatlas.viewer.render.labels import draw_marked
    from graspatlas.viewer.render.picture import check_size

    _check_png(path)
    check_size(width, height)
    with replaced(path) as stream:
        draw_marked(make(), width, height).save(stream, "PNG")


def _check_png(path: str | os.PathLike[str]) -> None:
    if os.path.splitext(path)[1].lower() != ".png":
        raise GraspAtlasError(f"a picture's name must end in .png, not '{os.fspath(path)}'")


def _check_chart(shown: object, chart: int | None) -> None:
    """Make sure that a chart is one of a result."""
    if chart is not None and not isinstance(shown, GraspAtlas):
        raise GraspAtlasError(
            "only a result has charts to be shown; a film opens at a frame: path.html#frame=30, and a scene as it is"
        )


def _film(shown: Path | list[Recording]) -> Film:
    from graspatlas.viewer.films.path_film import path_film
    from graspatlas.viewer.films.trial_film import trial_film

    return path_film(shown) if isinstance(shown, Path) else trial_film(shown)


def _checked(shown: object) -> Result | Path | list[Recording]:
    if isinstance(shown, Result | Path):
        return shown
    some = list(shown) if isinstance(shown, list | tuple) else [shown]
    trials = [trial for trial in some if isinstance(trial, Recording)]
    if trials and len(trials) == len(some):
        return trials
    raise GraspAtlasError(
        f"only a graspatlas.Result, a path of grasps or recorded trials can be shown, got {type(shown).__name__}"
    )
