"""Short names for the types of arrays, and the memory of costly functions of arrays.

A command prepares the same recording for its fit, for the check of the fit and for its figures.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from typing import Final, ParamSpec, TypeVar

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


MOST_REMEMBERED: Final = 16
"""Results of a function that are kept; chosen by hand."""

P = ParamSpec("P")
T = TypeVar("T")


def remembered(call: Callable[P, T]) -> Callable[P, T]:
    """Return a function that keeps its last results, by the content of its arguments.

    The arguments are arrays, or tuples of arrays. Results are shared, and must not be changed; a
    result of None is not kept.

    Examples
    --------
    >>> calls = []
    >>> @remembered
    ... def total(values):
    ...     calls.append(values)
    ...     return float(values.sum())
    >>> total(np.arange(3.0)), total(np.arange(3.0)), len(calls)
    (3.0, 3.0, 1)
    """
    results: OrderedDict[bytes, T] = OrderedDict()

    @wraps(call)
    def recalled(*args: P.args, **kwargs: P.kwargs) -> T:
        digest = hashlib.blake2b(digest_size=16)
        for name, value in [*enumerate(args), *sorted(kwargs.items())]:
            for array in value if isinstance(value, tuple) else (value,):
                whole = np.ascontiguousarray(array)
                digest.update(f"{name} {whole.dtype} {whole.shape} ".encode())
                digest.update(whole.tobytes())
        key = digest.digest()
        if (known := results.get(key)) is not None:
            return known
        found = call(*args, **kwargs)
        results[key] = found
        while len(results) > MOST_REMEMBERED:
            results.popitem(last=False)
        return found

    return recalled
