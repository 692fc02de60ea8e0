"""Text from outside, read whole or refused with the place of what is wrong: JSON, TOML, paths.

Python's own reader of JSON lets three things pass that are no mistake of its caller: it ends with
`RecursionError` on brackets that are nested too deeply, with `ValueError` on integers of more than
4300 digits, and it returns integers that no float and no array holds.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePath
from typing import Any, Final

from driftwalk.core.errors import FormatError

MIB: Final = 1 << 20
"""Bytes of a mebibyte."""


def read_bounded(path: str | Path, *, most: int) -> bytes:
    """Return the content of a file of limited size.

    Parameters
    ----------
    path : path-like
        The file; a device or a pipe is not read beyond the bound either.
    most : int
        Bytes that it may hold.

    Raises
    ------
    FormatError
        When it holds more.
    OSError
        When it cannot be read.

    Examples
    --------
    >>> from importlib.resources import files
    >>> truth = files("driftwalk.datasets") / "tank30_ode_a" / "truth.json"
    >>> read_bounded(str(truth), most=MIB)[:1]
    b'{'
    """
    with Path(path).open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise FormatError(f"is larger than {most / MIB:g} MiB, too large for its kind", path=path)
    return content


def text_of_name(name: str | PurePath) -> str:
    r"""Return a name or a path as text that every file can hold.

    Python keeps the bytes of a name that are not of the locale's encoding as lone surrogates, which
    neither UTF-8 nor HDF5 take. Bytes of UTF-8, all of them in the locale C, become what they
    mean; others are spelled.

    Parameters
    ----------
    name : str or path
        As the operating system or the command line gave it.

    Examples
    --------
    >>> text_of_name("K\udcc3\udca4fer.csv")
    'Käfer.csv'
    >>> print(text_of_name("K\udce4fer.csv"))
    K\xe4fer.csv
    """
    return str(name).encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def path_inside(folder: Path, name: str) -> Path | None:
    """Return where a name leads, links followed; None when out of the folder, or nowhere.

    Parameters
    ----------
    folder : Path
        The folder. It may be reached through a link itself: the user named it.
    name : str
        What lies in it, parts joined by "/". It may come from a browser or from a file.

    Examples
    --------
    >>> path_inside(Path("."), "../secret") is None, path_inside(Path("."), "/etc") is None
    (True, True)
    """
    try:
        root = folder.resolve(strict=True)
        path = root.joinpath(name).resolve(strict=True)
    except (OSError, ValueError, RuntimeError):
        # No such file, a name that no file has, a ring of links.
        return None
    return path if path.is_relative_to(root) else None


MOST_JSON_BYTES: Final = 64 * MIB
"""Largest JSON file: some 3 million points, or any manifest; chosen by hand."""
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
    return parse_json(read_bounded(path, most=MOST_JSON_BYTES), path=path)


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
"""Depth of nested values: far below the depth at which Python's own recursion ends (1000)."""


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


MOST_TOML_BYTES: Final = MIB
"""Largest TOML file, including comments, as people write studies, markers and cameras: its reader
takes time that grows with the square of some of what it holds."""
_TWICE: Final = re.compile(
    r"(?:Cannot declare (?P<table>\(.*?\)) twice|Cannot overwrite a value) \(at line (?P<line>\d+)"
)
"""Message of the reader about a table, or a key, that stands twice."""
MOST_PARTS: Final = 100
"""Parts of a key, as of a.b.c; its reader takes memory that grows with the square of their number:
50,000 took 4 GB. Keys of such a file have two; chosen by hand."""
_LONG_KEY: Final = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){""" + f"{MOST_PARTS}}}"
)
_LARGE: Final = "an integer has more than 64 bits"


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises
    ------
    FormatError
        See `parse_toml`; also when the file is too large.
    OSError
        When it cannot be read.
    """
    return parse_toml(read_bounded(path, most=MOST_TOML_BYTES), path=path)


def parse_toml(text: str | bytes, *, path: str | Path | None = None) -> dict[str, Any]:
    """Return what a TOML text holds.

    Parameters
    ----------
    text : str or bytes
        TOML in UTF-8; a byte order mark, as some editors write, is left aside.
    path : path-like, optional
        Where it is from, for the message.

    Raises
    ------
    FormatError
        When it is no TOML, values are nested too deeply, a key has more than 100 parts, or an
        integer has more than 64 bits.

    Examples
    --------
    >>> parse_toml('side_m = 0.03')
    {'side_m': 0.03}
    """
    try:
        plain = text if isinstance(text, str) else text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(f"not a text file in UTF-8 ({error.reason})", path=path) from error
    if _LONG_KEY.search(plain):
        raise FormatError(
            f"not a file that driftwalk reads: a key of more than {MOST_PARTS} parts", path=path
        )
    try:
        values = tomllib.loads(plain)
    except RecursionError:
        raise FormatError("not a TOML file: values nested too deeply", path=path) from None
    except ValueError as error:
        # The syntax; a date that no calendar has; an integer of more digits than Python converts.
        reason = _LARGE if "Exceeds the limit" in str(error) else str(error)
        reason = _twice(str(error), plain.splitlines()) or reason
        raise FormatError(f"not a TOML file: {reason}", path=path) from error
    refuse_deep(values, path=path)
    if any(isinstance(value, int) and not -(2**63) <= value < 2**63 for value in _leaves(values)):
        raise FormatError(f"not a TOML file: {_LARGE}", path=path)
    return values


def _twice(reason: str, lines: list[str]) -> str | None:
    """Return where a table or a key that stands twice does, None where it is another fault."""
    match = _TWICE.search(reason)
    if match is None:
        return None
    second = int(match["line"])
    if match["table"]:
        name = match["table"].strip("(), ").replace("'", "").replace(", ", ".")
        header = rf"\s*(\[+\s*{re.escape(name)}\s*\]+|{re.escape(name)}\s*\.)"
        what, advice = f"the table [{name}]", "write the keys of both below the first"
        earlier = range(second - 1)
    else:
        key = lines[second - 1].partition("=")[0].strip()
        header, what = rf"\s*{re.escape(key)}\s*=", f"the key {key}"
        advice = "leave one out"
        headers = [at for at in range(second - 1) if lines[at].lstrip().startswith("[")]
        earlier = range(max(headers, default=0), second - 1)
    first = next((at + 1 for at in earlier if re.match(header, lines[at])), None)
    if first is None:
        return None
    return f"{what} stands twice, in line {first} and in line {second}: {advice}"


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from _leaves(item)
    else:
        yield value
