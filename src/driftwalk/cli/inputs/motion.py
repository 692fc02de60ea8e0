"""A motion from a file: a recording in any format, or one replicate of a simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.core.errors import InputError
from driftwalk.core.files.file_names import text_of_name
from driftwalk.schema.check import check_contents
from driftwalk.schema.stores.netcdf import kind_of_file, open_netcdf

if TYPE_CHECKING:
    import xarray as xr


def load_motion(path: Path, how: RecordingOptions) -> xr.Dataset:
    """Load a `trajectory` from a recording, or from a file that `driftwalk simulate` wrote.

    Parameters
    ----------
    path : Path
        The file.
    how : RecordingOptions
        How to read a recording, and which replicate of a simulation; a simulation says all else of
        itself.

    Raises
    ------
    InputError
        When the file cannot be read, has no such replicate, or the body never moves.
    """
    from driftwalk.conditions import require_motion

    simulated = load_simulation(path, replicate=how.replicate or 0)
    if simulated is not None:
        return simulated
    # The replicate is that of the other motion.
    recording = replace(how, replicate=None).load(path)
    require_motion(recording, body=how.body, where=path)
    return recording


def load_simulation(path: Path, *, replicate: int = 0) -> xr.Dataset | None:
    """Load a `trajectory` from a file that `driftwalk simulate` wrote; None of any other file.

    Parameters
    ----------
    path : Path
        The file.
    replicate : int
        Which replicate, counted from 0.

    Raises
    ------
    InputError
        When it has no such replicate.
    """
    simulation = _open_simulation(path)
    if simulation is None:
        return None
    count = simulation.sizes["replicate"]
    if not 0 <= replicate < count:
        raise InputError(
            f"{path}: no replicate {replicate}; it has {count}, counted from 0 (--replicate)"
        )
    chosen = simulation[["x", "y", "theta"]].isel(replicate=replicate, drop=True)
    return chosen.assign_attrs(kind="trajectory", source=text_of_name(path.name), simulated="yes")


def _open_simulation(path: Path) -> xr.Dataset | None:
    """Return the simulation that the file holds, None when it is anything else."""
    if not path.is_file():
        return None
    # Damaged, or no NetCDF: the loaders of recordings say what is wrong.
    return check_contents(open_netcdf(path), path) if kind_of_file(path) == "simulation" else None
