"""Numbers as a page carries them: rounded to sixteen bits where that is enough, deflated, as text."""

from __future__ import annotations

import base64
import zlib
from typing import TypedDict

import numpy as np

from graspatlas.support.arrays import AnyArray, Array
from graspatlas.support.validation import PlainTable

__all__ = ["Numbers"]

#: Codes of a rounded column: 0 to LAST are numbers, MISSING is none.
LAST, MISSING = 65534, 65535
#: Columns that vary by less are constant, and cost nothing [units of the column].
CONSTANT = 1e-9
#: Names of the types in the page.
TYPES = {"uint8": "Uint8Array", "uint16": "Uint16Array", "uint32": "Uint32Array", "int8": "Int8Array"} | {
    "float32": "Float32Array",
    "float64": "Float64Array",
}


class Entry(TypedDict, total=False):
    """Where an array lies, and how it is read.

    Attributes:
        at: Its first byte.
        type: Name of the typed array that it is in the page.
        shape: Rows and columns.
        low, step: Of rounded columns: a code c stands for low + c step; columns of step 0 are not stored.
        log: Codes stand for logarithms; 0 stands for zero, and c > 0 for exp(low + (c - 1) step).
    """

    at: int
    type: str
    shape: list[int]
    low: list[float]
    step: list[float]
    log: bool


class Numbers:
    """Arrays one after another, rounded ones column by column.

    Each is split into planes, all first bytes before all second ones, which deflates better.
    """

    def __init__(self) -> None:
        #: Where each array lies.
        self.entries: dict[str, Entry] = {}
        self._pieces: list[bytes] = []
        self._size = 0

    def add(self, name: str, values: AnyArray) -> None:
        """Keep an array (n,) or (n, c) as it is."""
        rows = np.ascontiguousarray(values)
        self._append(name, rows, [len(rows), rows.shape[1] if rows.ndim > 1 else 1])

    def add_rounded(self, name: str, values: Array, *, log: bool = False) -> None:
        """Keep columns (n, c) in steps of 1 / 65534 of each column's range; NaN stays NaN.

        Args:
            name: The array's name.
            values: The columns.
            log: Round the logarithms of what is not negative, so that small numbers stay as precise as large ones.
        """
        columns = np.asarray(values, float).T
        zero = log & (columns <= 0.0)
        numbers = np.log(np.where(zero, 1.0, columns)) if log else columns
        numbers = np.where(zero | ~np.isfinite(columns), np.nan, numbers)
        known = np.isfinite(numbers)
        low = np.where(known, numbers, np.inf).min(axis=1, initial=np.inf)
        high = np.where(known, numbers, -np.inf).max(axis=1, initial=-np.inf)
        low, high = np.where(low > high, 0.0, low), np.where(low > high, 0.0, high)
        step = (high - low) / (LAST - 1)
        kept = (high - low > CONSTANT) | ~known.all(axis=1)
        step = np.where(kept, np.maximum(step, np.finfo(float).tiny), 0.0)
        codes = np.round((numbers - low[:, None]) / np.where(kept, step, 1.0)[:, None]) + (1 if log else 0)
        codes = np.where(known, codes, np.where(zero, 0, MISSING))
        shape = [columns.shape[1], columns.shape[0]]
        self._append(name, codes[kept].astype(np.uint16), shape)
        self.entries[name] |= {"low": low.tolist(), "step": step.tolist(), "log": log}

    def _append(self, name: str, rows: AnyArray, shape: list[int]) -> None:
        planes = np.ascontiguousarray(rows).view(np.uint8).reshape(-1, rows.dtype.itemsize).T
        self.entries[name] = {"at": self._size, "type": TYPES[rows.dtype.name], "shape": shape}
        self._pieces.append(planes.tobytes())
        self._size += rows.nbytes

    def table(self) -> PlainTable:
        """All of them, and where each lies, as they are sent to a page that is there already."""
        return {"entries": self.entries, "data": self.text()}  # type: ignore[dict-item]  # typed more closely

    def text(self) -> str:
        """All of them, deflated, in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._pieces), 6)).decode("ascii")
