"""JSON: values made ready for it; texts read whole, or refused with the place of what is wrong.

Python's own reader lets three things pass that are no mistake of its caller: it ends with
`RecursionError` on brackets that are nested too deeply, with `ValueError` on integers of more than
4300 digits, and it returns integers that no float and no array holds.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any, Final

from driftwalk.core.errors import FormatError
from driftwalk.core.files.bounded import MIB, read_bounded

MOST_BYTES: Final = 64 * MIB
"""Largest JSON file: some 3 million points, or any manifest."""
_INTEGER_DIGITS: Final = 20
"""Characters of the longest integer of 64 bits."""


def read_json(path: str | Path) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    FormatError
        When the file is too large or no JSON; with line and column where there is one.
    OSError
        When it cannot be read.
    """
    return parse_json(read_bounded(path, most=MOST_BYTES), path=path)


def parse_json(text: str | bytes, *, path: str | Path | None = None) -> Any:
    """Return what a JSON text holds.

    Parameters
    ----------
    text : str or bytes
        JSON in UTF-8; a byte order mark is left aside. An integer beyond 64 bits is read as a
        float, as by readers that know floats alone.
    path : path-like, optional
        Where it is from, for the message.

    Raises
    ------
    FormatError
        When it is no JSON, with line and column where there is one; when it is nested too deeply.

    Examples
    --------
    >>> parse_json('{"x": [1, 1000000000000000000000]}')
    {'x': [1, 1e+21]}
    """
    try:
        decoded = text if isinstance(text, str) else text.decode("utf-8-sig")
        values = json.loads(decoded, parse_int=_integer)
    except UnicodeDecodeError as error:
        raise FormatError("expected JSON, got bytes that are not text", path=path) from error
    except json.JSONDecodeError as error:
        raise FormatError(
            f"expected JSON: {error.msg}", path=path, line=error.lineno, column=error.colno
        ) from error
    except RecursionError:
        raise FormatError("expected JSON, got brackets nested too deeply", path=path) from None
    refuse_deep(values, path=path)
    return values


def json_value(value: Any) -> Any:
    """Return a value in JSON's own types: numpy to Python, a path to text, what is not finite null.

    Parameters
    ----------
    value : object
        Numbers, text, None, paths, numpy scalars and arrays; mappings, lists and tuples of them.

    Returns
    -------
    object
        The same, with dicts for mappings and lists for tuples and arrays, and None for every number
        that is not finite.

    Raises
    ------
    TypeError
        When a value has no such form.

    Examples
    --------
    >>> json_value({"x": float("nan"), 1: (True, 2)})
    {'x': None, '1': [True, 2]}
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_value(item) for item in value]
    if isinstance(value, PurePath):
        return str(value)
    raise TypeError(f"cannot write {type(value).__name__} as JSON")


def _integer(digits: str) -> int | float:
    if len(digits) > _INTEGER_DIGITS:
        return float(digits)
    value = int(digits)
    return value if -(2**63) <= value < 2**63 else float(value)


MOST_LEVELS: Final = 64


def refuse_deep(values: Any, *, path: str | Path | None = None) -> None:
    """Refuse lists and mappings that lie more than 64 levels inside each other.

    Raises
    ------
    FormatError
        When they do.

    Examples
    --------
    >>> refuse_deep({"x": [[1, 2], [3, 4]]})
    """
    level = [values]
    for _ in range(MOST_LEVELS):
        level = [
            item
            for value in level
            if isinstance(value, (dict, list))
            for item in (value.values() if isinstance(value, dict) else value)
            if isinstance(item, (dict, list))
        ]
        if not level:
            return
    raise FormatError(f"holds values nested more than {MOST_LEVELS} levels deep", path=path)
