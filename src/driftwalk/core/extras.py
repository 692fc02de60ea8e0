"""Packages of the extras, when something needs them: OpenCV, and Dask, which xarray would load."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, cast

from driftwalk.core.errors import FormatError, InputError

_STDERR: Final = 2
"""File descriptor of standard error, by POSIX: libraries in C write to it past `sys.stderr`."""
_DASK: Final = "dask"


def require_opencv(purpose: str = "tracking") -> Any:
    """Return the module ``cv2``.

    Parameters
    ----------
    purpose : str
        The feature that needs it, for the message.

    Raises
    ------
    InputError
        When OpenCV is not installed.

    Examples
    --------
    >>> require_opencv().__name__
    'cv2'
    """
    try:
        import cv2
    except ImportError as error:
        raise InputError(f"{purpose} needs OpenCV: pip install 'driftwalk[track]'") from error
    return cv2


def read_image(path: str | Path) -> Any:
    """Return an image in colour, shape (rows, columns, 3).

    Raises
    ------
    FormatError
        When the file is no image that OpenCV can read, or one of more than 2^30 pixels.

    Examples
    --------
    >>> read_image("no/such.png")
    Traceback (most recent call last):
    driftwalk.core.errors.FormatError: no/such.png: is not an image that OpenCV can read
    """
    cv2, image = require_opencv(), None
    with _without_stderr(), contextlib.suppress(cv2.error):
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise FormatError("is not an image that OpenCV can read", path=path)
    return image


@contextlib.contextmanager
def _without_stderr() -> Iterator[None]:
    """Keep the libraries under OpenCV, which ask for no level, from printing about an image."""
    sys.stderr.flush()
    kept, nowhere = os.dup(_STDERR), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, _STDERR)
        yield
    finally:
        os.dup2(kept, _STDERR)
        os.close(kept)
        os.close(nowhere)


def hide_dask() -> None:
    """Let Dask seem not to be installed, until `show_dask` is called.

    Where it is installed xarray loads its arrays, and with them scipy: half a second. Driftwalk has
    no such arrays; it needs Dask for workers elsewhere alone. This is for a process that is
    driftwalk's own, for a notebook may have some. Does nothing where Dask is loaded already.
    """
    if _DASK not in sys.modules:
        # Python takes None for a module that is not there; the types of `sys` do not know it.
        cast("dict[str, object]", sys.modules)[_DASK] = None


def show_dask() -> None:
    """Let Dask be imported again, by workers or by a user's own code."""
    if _DASK in sys.modules and cast("dict[str, object]", sys.modules)[_DASK] is None:
        del sys.modules[_DASK]
