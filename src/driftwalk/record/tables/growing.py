"""Growing arrays: columns that are appended block by block and held once."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


class GrowingColumn:
    """An array that values are appended to."""

    def __init__(self, dtype: npt.DTypeLike, *, expected: int = 0) -> None:
        # Memory that is never written to is never taken.
        self._values = np.empty(expected, dtype=dtype)
        self._count = 0

    def append(self, values: npt.NDArray[Any]) -> None:
        """Append values, which are copied."""
        stop = self._count + values.size
        if stop > self._values.size:
            self._values.resize(max(stop, int(1.25 * self._values.size)), refcheck=False)
        self._values[self._count : stop] = values
        self._count = stop

    def whole(self) -> npt.NDArray[np.bool_]:
        """Return where the values are whole numbers, or no numbers."""
        values = self._values[: self._count]
        whole: npt.NDArray[np.bool_] = ~(np.isfinite(values) & (values % 1.0 != 0.0))
        return whole

    def take(self) -> npt.NDArray[Any]:
        """Return the array, which is this column's no more."""
        values, self._values = self._values, np.empty(0, dtype=self._values.dtype)
        values.resize(self._count, refcheck=False)
        self._count = 0
        return values
