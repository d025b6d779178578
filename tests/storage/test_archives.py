"""Archives of others: nothing is unpacked that is more than it says."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

import graspatlas as ga
from graspatlas.storage.archives import DamagedArchive, read_arrays


def rewritten(saved: Path, path: Path, **arrays: object) -> Path:
    with np.load(saved) as file:
        whole = dict(file)
    np.savez_compressed(path, **{**whole, **arrays})  # type: ignore[arg-type]
    return path


def test_archives_that_unpack_to_much_are_refused_before_they_do(saved: Path, tmp_path: Path) -> None:
    bomb = rewritten(saved, tmp_path / "bomb.npz", residuals=np.zeros(40_000_000))
    assert bomb.stat().st_size < 2_000_000
    import tracemalloc

    tracemalloc.start()
    with pytest.raises(ga.GraspAtlasError, match="would unpack to 32"):
        ga.load_result(bomb)
    assert tracemalloc.get_traced_memory()[1] < 50_000_000
    tracemalloc.stop()


def npz(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return path


def npy(header: str, content: bytes = b"") -> bytes:
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + content


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000,), }\n", bytes(80)), "not as large as"),
        (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }\n", bytes(8)), "not as large as|broken"),
        (npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }\n", b"\x80\x04N."), "Python objects"),
        (npy("__import__('os').abort()\n"), "broken"),
        (npy("(" * 5000), "broken"),
        (b"", "broken"),
    ],
)
def test_arrays_that_are_not_what_they_say(content: bytes, reason: str, tmp_path: Path) -> None:
    with npz(tmp_path / "a.npz", x=content).open("rb") as stream, pytest.raises(DamagedArchive, match=reason):
        read_arrays(stream)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_archives_with_one_name_twice(tmp_path: Path) -> None:
    whole = npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }\n", bytes(8))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("x.npy", whole)
        archive.writestr("x.npy", whole)
    with (tmp_path / "a.npz").open("rb") as stream, pytest.raises(DamagedArchive, match="two of one name"):
        read_arrays(stream)


def checkpoint_arrays(folder: Path) -> tuple[Path, dict[str, np.ndarray]]:
    ga.optimize(ga.load_problem("gripper_skittle"), max_charts=60, checkpoint=folder)
    (path,) = folder.glob("*.npz")
    with np.load(path) as file:
        return path, dict(file)


def test_checkpoints_hold_what_an_atlas_has(tmp_path: Path) -> None:
    path, arrays = checkpoint_arrays(tmp_path / "c")

    def changed(name: str, at: int, value: float) -> np.ndarray:
        array = arrays[name].copy()
        array.reshape(-1)[at] = value
        return array

    twice = arrays["keys"].copy()
    twice[5] = twice[4]
    cases = [  # a NaN, a long vector, no vectors; an infinite and an empty place; charts twice; other kinds of numbers
        {"bases": changed("bases", 7, np.nan)},
        {"bases": changed("bases", 7, 3.0)},
        {"bases": 0.0 * arrays["bases"]},
        {"centers": changed("centers", 9, np.inf)},
        {"centers": 0.0 * arrays["centers"]},
        {"residuals": changed("residuals", 3, np.nan)},
        {"keys": twice},
        {"bases": arrays["bases"] + 0j},
        {"keys": arrays["keys"].astype(float)},
        {"more": np.zeros(3)},
    ]
    for change in cases:
        with path.open("wb") as stream:
            np.savez(stream, **{**arrays, **change})
        with pytest.raises(ga.GraspAtlasError, match=r"damaged|length one|quaternion"):
            ga.optimize(ga.load_problem("gripper_skittle"), checkpoint=tmp_path / "c")
