"""Arrays inside page data: float32, deflated, in text.

The format is described in ``docs/reference/page-data.md``.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text_files import json_value

SHORT: Final = 64
"""Arrays with fewer numbers than this stand as a plain list where their reader allows it; chosen by
hand."""


def encode_array(
    values: npt.ArrayLike, *, step: float = 0.0, offset: float = 0.0
) -> dict[str, Any]:
    """Encode an array for a page.

    Parameters
    ----------
    values : array_like
        Numbers; NaN where there is none.
    step : float
        Rounds the values to multiples of it, in their unit; 0: not at all. A power of two leaves
        zeros at the end of a float32, which take no room; see `binary_step`.
    offset : float
        Subtracted before they become float32: the first of the times on a clock. Of values far from
        it, such as metres of a map, also their middle is.

    Returns
    -------
    dict
        JSON-ready; `decode_array` reads it. A value that is infinite, also as a float32, becomes
        NaN. The same values give the same bytes.

    Raises
    ------
    InputError
        When the step is negative or not finite.

    Examples
    --------
    >>> encoded = encode_array([0.0, 0.26, float("nan")], step=0.25)
    >>> decode_array(encoded).tolist()
    [0.0, 0.25, nan]
    """
    if not 0.0 <= step < math.inf:
        raise InputError(f"the step of an array is a number from 0 on, got {step}")
    array = np.asarray(values, dtype=np.float64) - offset
    middle = _far_middle(array, step)
    array, offset = array - middle, offset + middle
    if step > 0.0:
        array = step * np.rint(array / step)
    with np.errstate(over="ignore"):
        stored = np.asarray(array, dtype="<f4")
    stored = np.where(np.isfinite(stored), stored, np.float32(np.nan))
    content = zlib.compress(stored.tobytes(), level=9)
    return {
        "shape": list(stored.shape),
        "step": step,
        "offset": offset,
        "data": base64.b64encode(content).decode("ascii"),
    }


def decode_array(encoded: Mapping[str, Any]) -> Floats:
    """Decode an array of a page.

    Parameters
    ----------
    encoded : mapping
        Result of `encode_array`.

    Returns
    -------
    ndarray of float
        The values, NaN where there is none.

    Raises
    ------
    FormatError
        When it is no encoded array, or is cut short.

    Examples
    --------
    >>> decode_array(encode_array([[1, 2], [3, 4]])).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    try:
        content = zlib.decompress(base64.b64decode(encoded["data"], validate=True))
        stored = np.frombuffer(content, dtype="<f4").reshape(tuple(encoded["shape"]))
        return float(encoded["offset"]) + stored.astype(np.float64)
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        raise FormatError(f"no array of a page: {error}") from error


def numbers(values: npt.ArrayLike) -> Any:
    """Return a short array as a plain list with null for NaN, a longer one encoded.

    Examples
    --------
    >>> numbers([1.0, float("nan")])
    [1.0, None]
    """
    array = np.asarray(values, dtype=np.float64)
    return plain_list(array) if array.size < SHORT else encode_array(array)


def plain_list(values: npt.ArrayLike) -> Any:
    """Return an array as nested lists, null where a number is not finite.

    Raises
    ------
    InputError
        With more than 100,000 numbers: lists of Python take thirty times their memory.

    Examples
    --------
    >>> plain_list([[1.0], [float("inf")]])
    [[1.0], [None]]
    """
    # No axis of a study has so many.
    if np.size(values) > 100_000:
        raise InputError(f"{np.size(values)} numbers in one list are more than a page shows")
    return json_value(np.asarray(values, dtype=np.float64))


def number(value: Any) -> float | None:
    """Return a number in JSON's own type, None when there is none or it is not finite.

    Examples
    --------
    >>> number(np.float64(0.5)), number(float("nan")), number(None)
    (0.5, None, None)
    """
    found = math.nan if value is None else float(value)
    return found if math.isfinite(found) else None


def binary_step(extent: float, parts: float) -> float:
    """Return the largest power of two that divides an extent often enough, 0 for no extent.

    Parameters
    ----------
    extent : float
        Range of the values.
    parts : float
        Least number of steps in it.

    Examples
    --------
    >>> binary_step(0.3, 5000.0)
    3.0517578125e-05
    """
    if not (math.isfinite(extent) and extent > 0.0):
        return 0.0
    return 2.0 ** math.floor(math.log2(extent / parts))


def _far_middle(array: Floats, step: float) -> float:
    """Return the middle of an array far from zero, a multiple of the step; 0 of one near it."""
    known = array[np.isfinite(array)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    # A float32 has 24 bits: nearer than 256 ranges it still tells 2¹⁶ values of a range apart.
    if not 0.0 < 256.0 * (high - low) < max(-low, high):
        return 0.0
    middle = low + 0.5 * (high - low)
    return step * round(middle / step) if step > 0.0 else middle
