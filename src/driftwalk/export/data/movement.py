"""Motion as NetCDF of the `movement` package."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.files.atomic import require_free, write_atomic
from driftwalk.core.text_files import json_value
from driftwalk.export.data.motion import Motion, frame_rate
from driftwalk.schema import body_names
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr


def write_movement(motion: Motion, folder: Path) -> list[Path]:
    """Write NetCDF as movement 0.15 does: positions of one keypoint, the body's centre.

    Numbers are double. Positions are in metres, as their attribute ``units`` says, with y up; the
    orientation is the further variable ``orientation``. The attribute ``driftwalk`` holds what was
    known of the recording as JSON, and driftwalk takes it over when it reads the file again.

    Parameters
    ----------
    motion : Motion
        What to write.
    folder : Path
        Where to write.

    Returns
    -------
    list of Path
        The file, ``NAME.movement.nc``.

    Raises
    ------
    InputError
        When the file exists.

    Examples
    --------
    >>> write_movement(Motion("recording", trajectory), Path("out"))  # doctest: +SKIP
    [PosixPath('out/recording.movement.nc')]
    """
    target = folder / f"{motion.name}.movement.nc"
    require_free(target, existing="error")
    write_atomic(target, netcdf_bytes(movement_dataset(motion.recording)))
    return [target]


def movement_dataset(recording: xr.Dataset) -> xr.Dataset:
    """Return a recording as a dataset of poses in movement's form.

    Parameters
    ----------
    recording : xarray.Dataset
        Kind "trajectory".

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> dict(movement_dataset(build_trajectory([0.0], [0.1], [0.2])).sizes)
    {'time': 1, 'space': 2, 'keypoints': 1, 'individuals': 1}
    """
    import xarray as xr

    x, y, theta = (recording[name].values for name in ("x", "y", "theta"))
    position = np.stack([x, y], axis=1)[:, :, None, :]
    data: dict[str, Any] = {
        "position": (("time", "space", "keypoints", "individuals"), position, {"units": "m"}),
        # movement asks for it, and none was stated.
        "confidence": (("time", "keypoints", "individuals"), np.full_like(x, np.nan)[:, None, :]),
    }
    if np.isfinite(theta).any():
        words = {"units": "rad", "long_name": "orientation, counter-clockwise from x"}
        data["orientation"] = (("time", "individuals"), theta, words)
    # These are made again when a recording is read.
    made_again = {"kind", "schema_version", "counts"}
    known = {key: value for key, value in recording.attrs.items() if key not in made_again}
    attrs: dict[str, Any] = {
        "source_software": "driftwalk",
        "ds_type": "poses",
        "time_unit": "seconds",
        "driftwalk": json.dumps(json_value(known)),
    }
    rate = frame_rate(recording)
    if rate is not None:
        attrs["fps"] = rate
    if "source" in recording.attrs:
        attrs["source_file"] = recording.attrs["source"]
    return xr.Dataset(
        data,
        {
            "time": recording["time"].values,
            "space": ["x", "y"],
            "keypoints": ["centroid"],
            "individuals": body_names(recording),
        },
        attrs,
    )
