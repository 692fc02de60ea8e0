"""The motion in a run or a file: recordings, simulated worlds, blocks that assemble; its clock."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.files.run_layout import MANIFEST_FILE, run_file, run_files, state_of
from driftwalk.core.text_files import read_json
from driftwalk.schema.kinds.assembly import ASSEMBLY
from driftwalk.schema.stores.netcdf import kind_of_file, open_netcdf
from driftwalk.schema.trajectory import block_of_study

if TYPE_CHECKING:
    import xarray as xr

OF_WORLDS: Final = {"simulation": "replicate", "assembly_path": "run"}
"""Kinds that hold several simulated worlds, and the dimension over which they do."""


@dataclass(frozen=True)
class Motion:
    """One world: bodies that moved together.

    Attributes
    ----------
    name : str
        Name of its files, without an ending.
    recording : xarray.Dataset
        Kind "trajectory".
    """

    name: str
    recording: xr.Dataset


def find_motions(source: Path, *, replicate: int | None = None) -> list[Motion]:
    """Return every recording and every simulated world of a run directory or a file.

    Parameters
    ----------
    source : Path
        The run directory of a fit, a calibration, a comparison of models or of self-assembly; or a
        file: a simulation, the path of an assembly, or a recording that is read without options.
    replicate : int, optional
        Which simulated world to take alone: a replicate, or a run of blocks; default: all.

    Returns
    -------
    list of Motion
        At least one.

    Raises
    ------
    InputError
        When there is no motion, or no such world.

    Examples
    --------
    >>> find_motions(Path("fit"))[0].name  # doctest: +SKIP
    'recording'
    """
    if state_of(source) == "new":
        return _of_file(source, replicate)
    files = [*run_files(source, "recording*.nc"), *run_files(source, "path.nc")]
    if not files:
        raise InputError(
            f"{source} holds no motion: neither a recording (recording.nc) nor runs of blocks "
            "(path.nc); give the file of a recording or a simulation"
        )
    size = _block_of_run(source)
    found = [motion for file in files for motion in _of_file(file, replicate)]
    for motion in found:
        motion.recording.attrs = size | motion.recording.attrs
    return found


def _of_file(file: Path, replicate: int | None) -> list[Motion]:
    from driftwalk.record import load

    if not file.exists():
        raise InputError(f"{file} does not exist: give a run directory, or a file with motion")
    kind = kind_of_file(file) if file.is_file() else None
    if kind in OF_WORLDS:
        return list(_of_worlds(file, kind, replicate))
    if kind == ASSEMBLY.name:
        raise InputError(
            f"{file} holds only the ends of the runs: give the run directory, whose path.nc holds "
            "the whole way of some"
        )
    if replicate is not None:
        raise InputError(f"{file} is a recording, which has no replicates: leave `replicate` out")
    # A recording in the plain form that `load` makes of any file that needs no options.
    return [Motion(file.stem.partition(".")[0] or "recording", load(file))]


def _of_worlds(file: Path, kind: str, replicate: int | None) -> Iterator[Motion]:
    from driftwalk.assembly import path_recording
    from driftwalk.record import load

    stored = open_netcdf(file)
    dimension = OF_WORLDS[kind]
    known = stored[dimension].values.tolist()
    if replicate is not None and replicate not in known:
        raise InputError(
            f"{file}: there is no {dimension} {replicate}: it holds {known[0]} to {known[-1]}"
        )
    for number in known if replicate is None else [replicate]:
        if dimension == "replicate":
            recording = load(file, replicate=known.index(number))
        else:
            recording = path_recording(stored, run=number)
            joined = stored["assembly"].sel(run=number).transpose("time", "block")
            recording["assembly"] = (("time", "body"), joined.values)
        yield Motion(f"{dimension}_{number}", recording)


def _block_of_run(folder: Path) -> dict[str, Any]:
    path = run_file(folder, MANIFEST_FILE)
    manifest = {} if path is None else read_json(path)
    if not isinstance(manifest, dict):
        return {}
    specification = manifest.get("specification")
    if isinstance(specification, dict) and specification.get("model"):
        return {}
    return block_of_study(manifest.get("study"))


def frame_rate(recording: xr.Dataset) -> float | None:
    """Return the rate [Hz] of a clock that ticks evenly, None for any other.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory"; frames may be missing.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> frame_rate(build_trajectory([0.0, 0.04, 0.12], [0.0] * 3, [0.0] * 3))
    25.0
    """
    time = np.asarray(recording["time"].values, dtype=np.float64)
    if time.size < 2:
        return None
    stated = recording.attrs.get("sample_rate_Hz")
    for rate in (stated, 1.0 / float(np.diff(time).min()), 1.0 / float(np.median(np.diff(time)))):
        if isinstance(rate, (int, float, np.number)) and _is_even(time, float(rate)):
            # Over the whole recording the rounding of single times does not count.
            frames = np.rint((time[-1] - time[0]) * rate)
            whole = float(f"{frames / (time[-1] - time[0]):.12g}")
            return whole if _is_even(time, whole) else float(rate)
    return None


def frame_numbers(recording: xr.Dataset) -> Integers:
    """Return the number of the frame of each time, from 0; of an uneven clock that of the row.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> frame_numbers(build_trajectory([0.0, 0.04, 0.12], [0.0] * 3, [0.0] * 3)).tolist()
    [0, 1, 3]
    """
    time = np.asarray(recording["time"].values, dtype=np.float64)
    rate = frame_rate(recording)
    if rate is None:
        return np.arange(time.size, dtype=np.int64)
    numbers: Integers = np.rint((time - time[0]) * rate).astype(np.int64)
    return numbers


def _is_even(time: Floats, rate: float) -> bool:
    """Whether every time lies at a different frame."""
    if not (np.isfinite(rate) and rate > 0.0):
        return False
    ticks = (time - time[0]) * rate
    if not ticks[-1] < 2.0**53:
        return False
    frames = np.rint(ticks)
    # The clock is even where no sample lies farther than this from its frame, in frames.
    return bool((np.diff(frames) > 0).all() and (np.abs(ticks - frames) <= 0.25).all())
