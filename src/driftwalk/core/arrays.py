"""Short names for the types of arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.int64]
Codes = npt.NDArray[np.int32]
"""Index of each row's name in a list of names."""
Indices = npt.NDArray[np.intp]
Keys = npt.NDArray[np.uint64]
"""Addresses of random numbers, one for each world."""
