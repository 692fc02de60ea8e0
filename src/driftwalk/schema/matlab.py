"""Which files are MATLAB's, and the names of the variables in them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Final

OLD: Final = b"MATLAB 5.0 MAT-file"
"""Start of the format that MATLAB writes unless a user chooses another."""
HDF5_BASED: Final = b"MATLAB 7.3 MAT-file"
"""Start of the format for large variables, an HDF5 file behind half a kilobyte of text."""


def matlab_variables(path: Path) -> list[str]:
    """Return the names of a file's variables, [] when it is no file of MATLAB's or damaged.

    Parameters
    ----------
    path : Path
        Any file.
    """
    try:
        with path.open("rb") as file:
            old = file.read(len(OLD)) == OLD
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _old_variables(path) if old else _hdf5_variables(path)
    except Exception:  # whatever the damage of a file leads the libraries to
        return []


def _old_variables(path: Path) -> list[str]:
    from scipy.io import whosmat

    return [str(name) for name, _, _ in whosmat(path, appendmat=False)]


def _hdf5_variables(path: Path) -> list[str]:
    import h5py

    with h5py.File(path, "r") as file:
        return [str(name) for name in file if not str(name).startswith("#")]
