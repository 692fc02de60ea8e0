"""Arrays inside page data: packed integers and floats, in text, small enough to embed.

The format is described in ``docs/reference/page-data.md``.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Mapping
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text.json_text import json_value

Floats = npt.NDArray[np.float64]
DType = Literal["f4", "f8", "i2", "i4", "u1"]

DTYPES: Final = ("f4", "f8", "i2", "i4", "u1")
SHORT: Final = 64
"""Arrays with fewer numbers than this stand as a plain list where their reader allows it."""
MOST_LISTED: Final = 100_000
"""Numbers of a plain list; no axis of a study has so many."""
_LIMIT: Final = {"i2": 32767, "i4": 2147483647}
_DEFLATE_LEVEL: Final = 9


def encode_array(
    values: npt.ArrayLike,
    *,
    dtype: DType = "f4",
    resolution: float | None = None,
    delta: bool = False,
) -> dict[str, Any]:
    """Encode an array for a page.

    Parameters
    ----------
    values : array_like
        Numbers; NaN where there is none.
    dtype : {"f4", "f8", "i2", "i4", "u1"}
        How they are stored. For "i2" and "i4" with a resolution, "i2" is replaced by "i4" when the
        range asks for it, and the resolution is made coarser when that is not enough either.
    resolution : float, optional
        Step between stored values, in the unit of the values: they are rounded to multiples of
        it. Needed for i2 and i4 unless the values are whole numbers.
    delta : bool
        Whether to store first differences along the last axis, which makes paths small.

    Returns
    -------
    dict
        JSON-ready; `decode_array` reads it. A value that is infinite, also as a float of that size,
        becomes NaN.

    Raises
    ------
    InputError
        When the dtype is unknown, the resolution not positive, or a whole number does not fit.

    Examples
    --------
    >>> encoded = encode_array([0.0, 0.25, float("nan")], dtype="i2", resolution=0.25)
    >>> decode_array(encoded).tolist()
    [0.0, 0.25, nan]
    """
    if dtype not in DTYPES:
        raise InputError(f"dtype is one of {', '.join(DTYPES)}, got {dtype!r}")
    array = np.asarray(values, dtype=np.float64)
    largest = np.finfo(np.float32 if dtype == "f4" else np.float64).max
    array = np.where(np.abs(array) <= largest, array, np.nan)
    if dtype in ("f4", "f8"):
        return _packed(array.astype(f"<{dtype}"), dtype)
    if dtype == "u1":
        return _packed(_whole(array, 0, 255).astype("<u1"), dtype)
    if resolution is None:
        return _encode_whole(array, dtype)
    return _encode_steps(array, dtype, resolution, delta)


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
    >>> decode_array(encode_array([[1, 2], [3, 4]], dtype="i2")).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    try:
        dtype, shape = encoded["dtype"], tuple(encoded["shape"])
        if dtype not in DTYPES:
            raise FormatError(f"an array of a page has the dtype {dtype!r}")
        content = base64.b64decode(encoded["data"], validate=True)
        if encoded["packed"] == "deflate":
            content = zlib.decompress(content)
        stored = np.frombuffer(content, dtype=f"<{dtype}").reshape(shape)
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        raise FormatError(f"no array of a page: {error}") from error
    if dtype in ("f4", "f8"):
        return stored.astype(np.float64)
    if encoded.get("delta"):
        stored = np.cumsum(stored, axis=-1, dtype=stored.dtype)
    values = encoded.get("offset", 0.0) + encoded.get("scale", 1.0) * stored.astype(np.float64)
    missing = encoded.get("missing")
    return values if missing is None else np.where(stored == missing, np.nan, values)


def numbers(values: npt.ArrayLike, *, dtype: DType = "f4", **options: Any) -> Any:
    """Return a short array as a plain list with null for NaN, a longer one encoded.

    Examples
    --------
    >>> numbers([1.0, float("nan")])
    [1.0, None]
    """
    array = np.asarray(values, dtype=np.float64)
    return plain_list(array) if array.size < SHORT else encode_array(array, dtype=dtype, **options)


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
    if np.size(values) > MOST_LISTED:
        raise InputError(f"{np.size(values)} numbers in one list are more than a page shows")
    return json_value(np.asarray(values, dtype=np.float64))


def number(value: Any) -> float | None:
    """Return a number in JSON's own type, None when there is none or it is not finite.

    Examples
    --------
    >>> number(np.float64(0.5)), number(float("nan")), number(None)
    (0.5, None, None)
    """
    if value is None:
        return None
    found = float(value)
    return found if math.isfinite(found) else None


def nice_step(extent: float, parts: float) -> float:
    """Return a round step (1, 2 or 5 times a power of ten) that divides an extent often enough.

    Parameters
    ----------
    extent : float
        Range of the values, > 0.
    parts : float
        Least number of steps in it.

    Examples
    --------
    >>> nice_step(0.3, 5000.0)
    5e-05
    """
    if not (math.isfinite(extent) and extent > 0.0):
        return 1.0
    rough = extent / parts
    power = math.floor(math.log10(rough))
    factor = next((f for f in (5, 2, 1) if f * 10.0**power <= rough * (1.0 + 1e-9)), 1)
    return float(f"{factor}e{power}")


def _encode_whole(array: Floats, dtype: DType) -> dict[str, Any]:
    """Encode whole numbers as they are; the lowest of the type means none."""
    missing = -_LIMIT[dtype] - 1
    known = _whole(array[np.isfinite(array)], -_LIMIT[dtype], _LIMIT[dtype])
    stored = np.full(array.shape, missing, dtype=f"<{dtype}")
    stored[np.isfinite(array)] = known
    return _packed(stored, dtype, missing=missing if known.size < array.size else None)


def _encode_steps(array: Floats, dtype: DType, resolution: float, delta: bool) -> dict[str, Any]:
    """Encode values as multiples of a resolution above an offset in their middle."""
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise InputError(f"the resolution of an array is a positive number, got {resolution}")
    known = np.isfinite(array)
    low, high = (float(f(array[known])) if known.any() else 0.0 for f in (np.min, np.max))
    # A multiple of the step, so that zero stays zero.
    offset = resolution * round(0.5 * (low + high) / resolution) if low * high > 0.0 else 0.0
    reach = max(high - offset, offset - low) / resolution
    if reach > _LIMIT["i2"] - 1:
        dtype = "i4"
    if reach > _LIMIT[dtype] - 1:
        resolution, offset = resolution * reach / (_LIMIT[dtype] - 1), 0.5 * (low + high)
    missing = -_LIMIT[dtype] - 1
    stored = np.full(array.shape, missing, dtype=f"<{dtype}")
    stored[known] = np.rint((array[known] - offset) / resolution)
    if delta and array.ndim and array.shape[-1] > 1:
        stored = _differences(stored)
    else:
        delta = False
    return _packed(
        stored, dtype, scale=resolution, offset=offset, delta=delta,
        missing=None if known.all() else missing,
    )  # fmt: skip


def _differences(stored: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return first differences along the last axis; they wrap, and so does the sum of them."""
    changed = stored.copy()
    np.subtract(stored[..., 1:], stored[..., :-1], out=changed[..., 1:])
    return changed


def _whole(array: Floats, low: int, high: int) -> Floats:
    rounded = np.rint(array)
    if array.size and not (
        np.array_equal(rounded, array) and rounded.min() >= low and rounded.max() <= high
    ):
        raise InputError(f"an array of a page: expected whole numbers from {low} to {high}")
    return rounded


def _packed(
    stored: npt.NDArray[Any],
    dtype: DType,
    *,
    scale: float = 1.0,
    offset: float = 0.0,
    missing: int | None = None,
    delta: bool = False,
) -> dict[str, Any]:
    content = np.ascontiguousarray(stored).tobytes()
    smaller = zlib.compress(content, _DEFLATE_LEVEL)
    deflate = len(smaller) < len(content)
    return {
        "dtype": dtype,
        "shape": list(stored.shape),
        "data": base64.b64encode(smaller if deflate else content).decode("ascii"),
        "packed": "deflate" if deflate else "none",
        "scale": scale,
        "offset": offset,
        "missing": missing,
        "delta": delta,
    }
