"""Paths that are no files, links and rights of what is written."""

from __future__ import annotations

import os
import socket
import stat
import time
from pathlib import Path

import pytest

import graspatlas as ga
from graspatlas.cli import main
from graspatlas.storage.files import replaced
from graspatlas.viewer import export_html, save_picture


def special(kind: str, path: Path) -> None:
    """Put something at a path that is no file."""
    if kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a socket":
        here = os.getcwd()
        os.chdir(path.parent)  # names of sockets are short
        try:
            with socket.socket(socket.AF_UNIX) as one:
                one.bind(path.name)
        finally:
            os.chdir(here)
    else:
        try:
            os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 3))
        except OSError:
            pytest.skip("making a device is not permitted here")


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device"])
@pytest.mark.parametrize("through_a_link", [False, True])
def test_what_is_no_file_is_never_replaced(
    kind: str, through_a_link: bool, small_result: ga.Result, saved: Path, tmp_path: Path
) -> None:
    problem = ga.load_problem("planar_hand")
    ways = {
        "npz": small_result.save,
        "html": lambda path: export_html(small_result, path),
        "png": lambda path: save_picture(small_result, path),
        "json": small_result.save_grasps,
        "csv": small_result.save_grasps,
        "out.csv": ga.shortest_path(small_result, 0, 0).save_csv,
    }
    for ending, write in ways.items():
        real, path = tmp_path / f"real.{ending}", tmp_path / f"file.{ending}"
        special(kind, real if through_a_link else path)
        if through_a_link:
            path.symlink_to(real)
        before = os.stat(path)
        with pytest.raises(ga.GraspAtlasError, match=f"it is {kind}, not a file"):
            write(path)
        assert os.stat(path) == before
    folder = tmp_path / "checkpoint"
    folder.mkdir()
    special(kind, folder / "000000.npz")
    with pytest.raises(ga.GraspAtlasError, match=f"it is {kind}"):
        ga.optimize(problem, radius=0.4, max_charts=10, checkpoint=folder)
    assert not stat.S_ISREG(os.stat(folder / "000000.npz").st_mode)


@pytest.mark.parametrize(
    "words",
    [
        ["schema", "--output"],
        ["new", "example_robot_data:allegro_right_hand", "--output"],
        ["export", "RESULT", "--grasps"],
        ["pareto", "RESULT", "smallest_semi_axis", "inverse_condition_number", "--picture"],
        ["view", "RESULT", "--html"],
        ["path", "RESULT", "--csv"],
    ],
    ids=lambda words: words[0],
)
def test_commands_write_to_no_pipe(
    words: list[str], saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pipe = tmp_path / ("pipe.png" if words[0] == "pareto" else "pipe.csv")
    os.mkfifo(pipe)
    assert main([str(saved) if word == "RESULT" else word for word in [*words, str(pipe)]]) == 2
    assert stat.S_ISFIFO(os.stat(pipe).st_mode)
    errors = capsys.readouterr().err.splitlines()
    assert [line for line in errors if "error" in line] == errors[-1:]
    assert "a pipe" in errors[-1] or "exists" in errors[-1]


def test_symbolic_links_stay_and_what_they_point_to_is_replaced(small_result: ga.Result, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    target, link = tmp_path / "elsewhere" / "result.npz", tmp_path / "link.npz"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    small_result.save(link)
    assert link.is_symlink()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640, "the rights that the file had"
    assert ga.load_result(target).atlas.n_charts == small_result.atlas.n_charts
    (tmp_path / "dangling").symlink_to(tmp_path / "elsewhere" / "new.npz")
    small_result.save(tmp_path / "dangling")
    assert (tmp_path / "elsewhere" / "new.npz").is_file()
    (tmp_path / "ring").symlink_to(tmp_path / "ring")
    with pytest.raises(ga.GraspAtlasError, match="cannot write"):
        small_result.save(tmp_path / "ring")
    assert sorted(path.name for path in (tmp_path / "elsewhere").iterdir()) == ["new.npz", "result.npz"]


def test_new_files_have_the_rights_that_the_user_gives_files(tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        with replaced(tmp_path / "file") as stream:
            stream.write(b"x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o600


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device"])
def test_results_are_read_from_files_alone(kind: str, tmp_path: Path) -> None:
    special(kind, tmp_path / "result.npz")
    start = time.monotonic()
    for path in (tmp_path, tmp_path / "result.npz"):
        with pytest.raises(ga.GraspAtlasError, match=f"it is {kind}"):
            ga.load_result(path)
    assert time.monotonic() - start < 5.0
