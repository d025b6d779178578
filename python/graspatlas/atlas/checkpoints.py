"""Checkpoints of an atlas in the making, from which it goes on to the same result, to the bit."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from graspatlas import _core
from graspatlas.errors import GraspAtlasError
from graspatlas.storage.files import stated_path
from graspatlas.storage.run_files import damaged, read_run_file, write_run_file
from graspatlas.support.arrays import AnyArray, Array
from graspatlas.systems.system import AnySystem

__all__ = ["CheckpointFolder", "run_digest"]

#: Changes when a checkpoint of an older version would not lead to the same atlas.
VERSION = 3
#: Arrays of which each file of a checkpoint holds the part from its first chart on.
_GROWING = ("centers", "bases", "residuals", "regularities", "keys")
#: What each array of a checkpoint may hold: floating-point numbers, whole ones.
_KINDS = {
    **dict.fromkeys(("centers", "bases", "residuals", "regularities", "closed_vertices"), "f"),
    **dict.fromkeys(("keys", "closed_charts", "closed_reasons", "generation", "again", "paused"), "iu"),
    **dict.fromkeys(("counts", "first"), "iu"),
}
#: A step away from x0 at which the system is looked at, to tell it from others [units of the tangent space].
_STEP = 1e-3


def run_digest(system: AnySystem, x0: Array, radius: float, epsilon: float) -> str:
    """Digest that tells runs apart: the options, and the system's numbers at x0 and a step away from it."""
    digest = hashlib.sha256(json.dumps([VERSION, type(system).__name__, radius, epsilon]).encode())
    away = system.integrate(x0, np.full(system.tangent_size, _STEP))
    for x in (x0, away):
        for array in (x, system.evaluate_residual(x), system.evaluate_jacobian(x), system.slack(x)):
            digest.update(np.ascontiguousarray(array, float).tobytes())
    digest.update(np.ascontiguousarray(system.bound_normals).tobytes())
    return digest.hexdigest()


class CheckpointFolder:
    """A folder of numbered files: each holds the charts from the first on whose number was not settled before.

    So a long run writes nearly all charts once. A file is written beside its place and renamed, and what it says of the
    state of the run replaces what older files say; a file that a killed run left unfinished is not there.

    Args:
        folder: The folder; made when the first file is written.
        digest: Of the run, see :func:`run_digest`.
    """

    def __init__(self, folder: str | os.PathLike[str], digest: str) -> None:
        self.folder = stated_path(folder, "keep a checkpoint at")
        self.digest = digest
        self._n_files = self._n_charts = 0

    def load(self) -> dict[str, AnyArray] | None:
        """What ``AtlasBuilder.resume`` needs; None when there is no checkpoint.

        Raises:
            GraspAtlasError: If a file is damaged, or the checkpoint is of another run.
        """
        paths = sorted(self.folder.glob("*.npz"))
        parts = [self._read(path) for path in paths]
        if not parts:
            return None
        out = {name: part for name, part in parts[-1].items() if name != "first"}
        try:
            out |= {name: self._joined(name, parts) for name in _GROWING}
        except ValueError:
            raise GraspAtlasError(
                f"the checkpoint is damaged: files of '{self.folder}' do not fit together; delete it to start over"
            ) from None
        self._n_files, self._n_charts = len(parts), int(parts[-1]["first"])
        return out

    def _joined(self, name: str, parts: list[dict[str, AnyArray]]) -> AnyArray:
        """An array of all charts [flat]: each file says anew what older ones say from its first chart on."""
        whole: AnyArray = parts[0][name].reshape(len(parts[0]["keys"]), -1)
        for part in parts[1:]:
            added = part[name].reshape(len(part["keys"]), whole.shape[1]) if part["keys"].size else whole[:0]
            whole = np.concatenate([whole[: int(part["first"])], added])
        return whole.ravel()

    def _read(self, path: Path) -> dict[str, AnyArray]:
        part = read_run_file(path, self.digest)
        if set(part) != set(_KINDS) or any(array.dtype.kind not in _KINDS[name] for name, array in part.items()):
            raise damaged(path)
        return part

    def write(self, builder: _core.AtlasBuilder) -> None:
        """Write the charts that came since the last file, and the state of the run.

        Raises:
            GraspAtlasError: If the file cannot be written.
        """
        part: dict[str, Any] = dict(builder.save(self._n_charts))
        path = self.folder / f"{self._n_files:06}.npz"
        write_run_file(path, self.digest, {"first": self._n_charts, **part})
        self._n_files += 1
        self._n_charts = builder.n_settled

    @staticmethod
    def remove(folder: Path) -> None:
        """Remove the files of a checkpoint, and the folder if nothing else is in it."""
        for path in folder.glob("[0-9]*.npz"):
            path.unlink()
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
