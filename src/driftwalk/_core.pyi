"""Types of the native core. Private: use the functions of the stages instead."""

from typing import Any

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_Place = tuple[float, float, int, int]

# --- the KS statistic ---------------------------------------------------------------------------
# D1 and D2 in units of 1 / (n1 n2), n1, n2, points that tie, place of D1, place of D2
KsResult = tuple[int, int, int, int, int, _Place, _Place]

class KsReference:
    def __init__(self, points: _Floats) -> None: ...
    @property
    def size(self) -> int: ...
    def compare(self, points: _Floats, limits: bool) -> KsResult: ...
    def peacock(self, points: _Floats) -> tuple[int, int, _Place]: ...

def ks_compare(a: _Floats, b: _Floats, limits: bool) -> KsResult: ...
def ks_permutations(
    pooled: _Floats,
    n1: int,
    block_of: npt.NDArray[np.int32],
    labels: npt.NDArray[np.uint8],
    limits: bool,
) -> npt.NDArray[np.int64]: ...

# --- steps --------------------------------------------------------------------------------------
def apply_step_plan(
    left: npt.NDArray[np.int32],
    weight: _Floats,
    triple: npt.NDArray[np.int32],
    x: npt.NDArray[Any],
    y: npt.NDArray[Any],
) -> tuple[_Floats, _Floats, npt.NDArray[np.int32], int, int]: ...
