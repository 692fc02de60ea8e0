"""Dask out of the sight of xarray, which loads its arrays where it is installed: half a second.

Driftwalk has no arrays of Dask; it needs Dask for workers elsewhere alone.
"""

from __future__ import annotations

import sys
from typing import Final, cast

DASK: Final = "dask"


def hide_dask() -> None:
    """Let Dask seem not to be installed, until `show_dask` is called.

    Does nothing where Dask is loaded already. For a process that is driftwalk's own: a notebook
    may have arrays of Dask.
    """
    if DASK not in sys.modules:
        # What Python takes for a module that is not there; the types of `sys` do not know it.
        cast("dict[str, object]", sys.modules)[DASK] = None


def show_dask() -> None:
    """Let Dask be imported again, by workers or by a user's own code."""
    if DASK in sys.modules and cast("dict[str, object]", sys.modules)[DASK] is None:
        del sys.modules[DASK]
