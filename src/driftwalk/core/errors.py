"""The errors that driftwalk raises on purpose.

Each is also a standard exception, so a caller may catch either. The message of an
`InputError` is written for the person at the keyboard: what was wrong, where, what to do.
The command line prints it on one line and exits with code 2.
"""

from __future__ import annotations

import difflib
import json
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Concatenate, Final, ParamSpec, TypeVar

DAMAGED: Final = (OSError, EOFError, zlib.error)
"""Raised by reading a file, or one of gzip that is cut off or damaged."""
_Further = ParamSpec("_Further")
_Result = TypeVar("_Result")


def reason_of(error: BaseException) -> str:
    r"""Return on one line what another library's error says, its kind where it says nothing.

    Examples
    --------
    >>> reason_of(ValueError("bad\n  magic")), reason_of(KeyError())
    ('bad magic', 'KeyError')
    """
    return " ".join(str(error).split()) or type(error).__name__


class DriftwalkError(Exception):
    """Base of every error that driftwalk raises on purpose."""


class InputError(DriftwalkError, ValueError):
    """Something the user gave cannot be used: a value, an option, an array."""


class ConfigurationError(InputError):
    """A study file or option is wrong: unknown key, value out of range, contradiction."""


class FormatError(InputError):
    """A file cannot be read as what it claims to be.

    Parameters
    ----------
    message : str
        The problem and the remedy; what it quotes of the file is brought on one line.
    path : path-like, optional
        The file.
    line, column : int, optional
        Position in the file, both counted from 1.
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        message = " ".join(message.splitlines())
        self.reason = message
        """The message without the place."""
        self.path = path
        self.line = line
        self.column = column
        places = (("", path), ("line ", line), ("column ", column))
        where = ", ".join(f"{what}{place}" for what, place in places if place is not None)
        super().__init__(f"{where}: {message}" if where else message)


class RunDirectoryError(DriftwalkError, OSError):
    """A run directory cannot be used: held by another process, of another study, not writable."""

    def __str__(self) -> str:
        """Return the message as it was given, without the errno prefix of `OSError`."""
        return str(self.args[0]) if self.args else ""


class ClusterError(DriftwalkError, RuntimeError):
    """Workers on other machines cannot be reached, or must not be used; what is done is kept."""


def argument_text(name: str, value: str | Mapping[str, str]) -> str:
    """Return an argument and its value as a message names them: in backquotes, the value as JSON.

    A message of the library speaks to the caller of a Python function. The command line finds
    these texts and prints its options in their place, so they have one form.

    A text that is the same in every message can stand there as it is. This function is for a value
    that comes from outside and may hold quotes and backquotes.

    Parameters
    ----------
    name : str
        Name of the argument.
    value : str or mapping
        What to give for it.

    Examples
    --------
    >>> print(argument_text("columns", {"t": "time:ms"}))
    `columns={"t": "time:ms"}`
    """
    text = json.dumps(value if isinstance(value, str) else dict(value), ensure_ascii=False)
    # A backquote would end the argument early; its escape means the same in Python and in JSON.
    escaped = text.replace("`", "\\u0060")
    return f"`{name}={escaped}`"


@contextmanager
def damaged_as(what: str, path: Path, *, advice: str = "") -> Iterator[None]:
    """Turn whatever a library raises on a damaged file into a `FormatError`.

    Parameters
    ----------
    what : str
        Completes "cannot be read", such as ``"as HDF5"``.
    path : Path
        The file.
    advice : str
        What to do about it, after a semicolon.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        reason = f"cannot be read {what}: {reason_of(error)}"
        if advice:
            reason = f"{reason.rstrip('.')}; {advice}"
        raise FormatError(reason, path=path) from error


def naming_its_file(
    function: Callable[Concatenate[Path, _Further], _Result],
) -> Callable[Concatenate[Path, _Further], _Result]:
    """Let a function of a file name it in each `FormatError` that does not.

    A failure of the system, or of gzip, becomes a `FormatError` too.

    Parameters
    ----------
    function : callable
        Its first argument is the path of the file.

    Examples
    --------
    >>> @naming_its_file
    ... def read(path: Path) -> None:
    ...     raise FormatError("has no rows", line=2)
    >>> read(Path("a.csv"))
    Traceback (most recent call last):
    driftwalk.core.errors.FormatError: a.csv, line 2: has no rows
    """

    @wraps(function)
    def named(path: Path, /, *args: _Further.args, **kwargs: _Further.kwargs) -> _Result:
        try:
            return function(path, *args, **kwargs)
        except FormatError as error:
            if error.path is not None:
                raise
            raise FormatError(
                error.reason, path=path, line=error.line, column=error.column
            ) from error
        except DAMAGED as error:
            known = getattr(error, "strerror", None)
            reason = f"cannot be read: {known}" if known else f"is damaged: {error}"
            raise FormatError(reason, path=path) from error

    return named


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean '…'?" for the closest known word, or nothing.

    A name that lacks only its unit ("diameter" for "diameter_m") counts as close.
    """
    names = list(known)
    found = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    found = found or [name for name in names if name.startswith(f"{word}_")]
    return f"; did you mean '{found[0]}'?" if found else ""


def listed(names: Sequence[str]) -> str:
    """Return the first names, with commas between them.

    Examples
    --------
    >>> listed(["nose", "tail"])
    'nose, tail'
    """
    return ", ".join(names[:20]) + (", …" if len(names) > 20 else "")
