"""The array types of the package."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["AnyArray", "Array", "BoolArray", "Float32Array", "IndexArray", "Int32Array", "IntArray"]

Array: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
#: Rows to choose, as NumPy's argsort and flatnonzero give them.
IndexArray: TypeAlias = NDArray[np.intp]
#: Whole numbers of the core (charts, facets) and of meshes (corners of triangles).
Int32Array: TypeAlias = NDArray[np.int32]
#: What is drawn: colours, depths and the points a browser gets.
Float32Array: TypeAlias = NDArray[np.float32]
#: An array whose type is looked at before it is used, as of a file.
AnyArray: TypeAlias = NDArray[Any]
