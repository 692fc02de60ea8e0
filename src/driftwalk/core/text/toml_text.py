"""TOML of the files that people write by hand: study, markers, camera."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError
from driftwalk.core.files.bounded import MIB, read_bounded
from driftwalk.core.text.json_text import refuse_deep

MOST_BYTES: Final = MIB
"""Largest such file, including comments: its reader takes time that grows with the square of
some of what it holds."""
_TWICE: Final = re.compile(
    r"(?:Cannot declare (?P<table>\(.*?\)) twice|Cannot overwrite a value) \(at line (?P<line>\d+)"
)
"""Message of the reader about a table, or a key, that stands twice."""
MOST_PARTS: Final = 100
"""Parts of a key, as of a.b.c; its reader takes memory that grows with the square of their number:
50,000 took 4 GB. Keys of these files have two."""
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
    return parse_toml(read_bounded(path, most=MOST_BYTES), path=path)


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
        if _LONG_KEY.search(plain):
            raise FormatError(
                f"not a file that driftwalk reads: a key of more than {MOST_PARTS} parts", path=path
            )
        values = tomllib.loads(plain)
    except UnicodeDecodeError as error:
        raise FormatError(f"not a text file in UTF-8 ({error.reason})", path=path) from error
    except FormatError:
        raise
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
