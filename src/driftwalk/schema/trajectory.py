"""The `trajectory` dataset, poses of one or more bodies over time, and the `steps` cut from it.

A missing sample is NaN in ``x`` and ``y``: gaps are real and are never filled. Bodies with clocks
of their own share the union of their time stamps, each with NaN where it has no sample. A turning
angle is the signed angle from the step before to this one (the paper's step angle).
`driftwalk.schema.kinds.motion` lists the variables and attributes of both.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.files.atomic import atomic_path, require_target, write_atomic
from driftwalk.core.text_files import parse_json
from driftwalk.schema.check import build_dataset
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

POSE: Final = ("x", "y", "theta")


class Track(NamedTuple):
    """The samples of one body that are present, shapes (n,), in time order."""

    time: Floats
    """Time [s]."""
    x: Floats
    """Position x [m]."""
    y: Floats
    """Position y [m]."""
    theta: Floats
    """Orientation [rad]; all NaN when the recording has none."""

    @property
    def has_orientation(self) -> bool:
        """Whether any sample carries an orientation."""
        return bool(np.isfinite(self.theta).any())

    @property
    def turns(self) -> bool:
        """Whether orientations differ: a tracker that only fills its column has none."""
        known = self.theta[np.isfinite(self.theta)]
        return bool(known.size) and float(np.ptp(known)) > 0.0


def build_trajectory(
    time: npt.ArrayLike,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    theta: npt.ArrayLike | None = None,
    *,
    body: list[str] | None = None,
    attrs: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Build a `trajectory` dataset.

    Parameters
    ----------
    time : array_like, shape (n,)
        Time stamps [s], strictly increasing.
    x, y : array_like, shape (n,) or (n, bodies)
        Positions [m], NaN where a sample is missing.
    theta : array_like, optional
        Orientations [rad], same shape; wrapped into (-pi, pi].
    body : list of str, optional
        Names of the bodies; default ``"0"``, ``"1"``, ...
    attrs : dict, optional
        Attributes to add.

    Returns
    -------
    xarray.Dataset
        The checked dataset.

    Raises
    ------
    InputError
        When shapes disagree or times do not increase.

    Examples
    --------
    >>> build_trajectory([0.0, 0.1], [0.0, 0.01], [0.0, 0.0]).sizes["time"]
    2
    """
    import pandas as pd

    time_s = np.asarray(time, dtype=np.float64)
    x_m, y_m = (_columns(values) for values in (x, y))
    theta_rad = np.full_like(x_m, np.nan) if theta is None else wrap_angle(_columns(theta))
    if not x_m.shape == y_m.shape == theta_rad.shape or x_m.shape[0] != time_s.size:
        raise InputError(
            f"x {x_m.shape}, y {y_m.shape}, theta {theta_rad.shape} and time {time_s.shape} "
            "do not have the same number of samples"
        )
    names = body if body is not None else [str(index) for index in range(x_m.shape[1])]
    dataset = build_dataset(
        "trajectory",
        {
            name: (("time", "body"), values)
            for name, values in zip(POSE, (x_m, y_m, theta_rad), strict=True)
        },
        {
            # An index copies an array by itself: a quarter of the text of a long recording.
            "time": ("time", pd.Index(time_s, copy=False)),
            "body": ("body", np.asarray(names, dtype=object)),
        },
        attrs or {},
    )
    return check_trajectory(dataset)


def wrap_angle(theta: Floats) -> Floats:
    """Wrap angles [rad] into (-pi, pi]."""
    wrapped: Floats = np.pi - theta
    # In place: a long recording is not to be held four times.
    np.mod(wrapped, 2.0 * np.pi, out=wrapped)
    np.subtract(np.pi, wrapped, out=wrapped)
    return wrapped


def check_trajectory(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset if it is a valid `trajectory`, else raise `InputError`."""
    for name in POSE:
        if name not in dataset or dataset[name].dims != ("time", "body"):
            raise InputError(
                f"not a trajectory dataset: no variable '{name}' with dimensions (time, body)"
            )
    time = dataset["time"].values
    if time.size and not np.isfinite(time).all():
        raise InputError("not a trajectory dataset: a time stamp is not a finite number")
    require_increasing(time)
    return dataset


def require_increasing(time: Floats) -> None:
    """Refuse time stamps of which one is not after the one before."""
    increases = time[1:] > time[:-1]  # a difference of unsigned integers would wrap
    if not increases.all():
        at = int(np.flatnonzero(~increases)[0])
        raise InputError(
            f"time does not increase at sample {at + 1}: {time[at]} s is followed by "
            f"{time[at + 1]} s; sort the recording first"
        )


def read_arena(arena: Mapping[str, Any] | str) -> dict[str, Any]:
    """Return an arena as a dictionary, from its JSON text or a mapping."""
    if not isinstance(arena, str):
        return dict(arena)
    try:
        facts = parse_json(arena)
    except FormatError as error:
        raise InputError(f"the arena is not JSON text ({error}): got {arena!r}") from error
    if not isinstance(facts, dict):
        raise InputError(f"the arena must be an object of keys, got {arena!r}")
    return facts


def block_of_study(study: object) -> dict[str, Any]:
    """Return the attributes by which a recording states the block of a stored study.

    The shape of a square and a side that is immersed are not stated: they are what else is meant.

    Parameters
    ----------
    study : object
        The study as it is stored, with its [block]; anything else states nothing.

    Examples
    --------
    >>> block_of_study({"block": {"shape": "disc", "side_m": 0.03, "mass_kg": 0.0116}})
    {'block_shape': 'disc', 'block_side_m': 0.03, 'block_mass_kg': 0.0116}
    """
    block = study.get("block") if isinstance(study, dict) else None
    usual = {"shape": "square", "depth": "immersed"}
    return {
        f"block_{key}": block[key]
        for key in ("shape", "side_m", "width_m", "mass_kg", "depth_m", "depth")
        if isinstance(block, dict) and block.get(key) not in (None, usual.get(key))
    }


def body_names(dataset: xr.Dataset) -> list[str]:
    """Return the names of the bodies, in order."""
    return [str(name) for name in dataset["body"].values]


def body_track(dataset: xr.Dataset, body: str | None = None) -> Track:
    """Return the present samples of one body.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `trajectory`.
    body : str, optional
        Name of the body; may be left out when there is only one.

    Raises
    ------
    InputError
        When the body is not named and there are several, or there is none of that name.
    """
    names = body_names(dataset)
    if body is None:
        if len(names) != 1:
            raise InputError(
                f"the recording has {len(names)} bodies ({', '.join(names[:8])}"
                f"{', …' if len(names) > 8 else ''}): name one with `body`"
            )
        body = names[0]
    if body not in names:
        raise InputError(f"no body '{body}' in the recording; it has {', '.join(names)}")
    index = names.index(body)
    x, y, theta = (dataset[name].values[:, index] for name in POSE)
    present = np.isfinite(x) & np.isfinite(y)
    return Track(dataset["time"].values[present], x[present], y[present], theta[present])


def _columns(values: npt.ArrayLike) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    return array[:, None] if array.ndim == 1 else array


STEP: Final = ("step_length", "turning_angle")


def build_steps(
    step_length: npt.ArrayLike,
    turning_angle: npt.ArrayLike,
    *,
    time: npt.ArrayLike,
    attrs: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Build a `steps` dataset.

    Parameters
    ----------
    step_length : array_like, shape (n,)
        Step lengths [m], > 0.
    turning_angle : array_like, shape (n,)
        Turning angles [rad], in (-pi, pi].
    time : array_like, shape (n,)
        When each step begins [s].
    attrs : dict, optional
        Attributes to add.

    Raises
    ------
    InputError
        When the shapes disagree or a value is out of range.

    Examples
    --------
    >>> build_steps([0.01], [0.2], time=[0.1]).sizes["step"]
    1
    """
    values = {"step_length": step_length, "turning_angle": turning_angle}
    try:
        dataset = build_dataset(
            "steps",
            {name: ("step", np.asarray(array, dtype=np.float64)) for name, array in values.items()},
            {"time": ("step", np.asarray(time, dtype=np.float64))},
            attrs or {},
        )
    except ValueError as error:
        raise InputError(f"not a steps dataset: {error}") from error
    return check_steps(dataset)


def check_steps(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset if it is a valid `steps` dataset, else raise `InputError`."""
    for name in STEP:
        if name not in dataset or dataset[name].dims != ("step",):
            raise InputError(
                f"not a steps dataset: variable '{name}' with dimension (step) is missing"
            )
    length, angle = (dataset[name].values for name in STEP)
    if not (np.isfinite(length) & (length > 0)).all():
        raise InputError("not a steps dataset: a step_length is not a positive number")
    if not ((angle > -np.pi) & (angle <= np.pi)).all():
        raise InputError("not a steps dataset: a turning_angle lies outside (-pi, pi]")
    return dataset


CSV_COLUMNS = ["t_s", "x_m", "y_m", "theta_rad", "body"]


def save_trajectory(
    dataset: xr.Dataset, path: str | PathLike[str], *, existing: str = "error"
) -> Path:
    """Write a trajectory as NetCDF (``.nc``) or plain CSV (``.csv``), by the name's ending.

    CSV has the columns t_s, x_m, y_m, theta_rad and body. Numbers have as many digits as it takes
    to read the same float64 back. Rows are the present samples, and one row with empty positions
    for a time at which no body is present; the arena and the other attributes are lost, so NetCDF
    is the format to keep.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `trajectory`.
    path : path-like
        Where to write. The file appears whole or not at all.
    existing : {"error", "replace"}
        Behaviour if the file exists already.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the file exists, its folder does not, or its ending is neither ``.nc`` nor ``.csv``.
    RunDirectoryError
        When the place cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_trajectory(build_trajectory([0.0], [0.1], [0.2]), f"{folder}/a.csv").name
    'a.csv'
    """
    check_trajectory(dataset)
    target = Path(path)
    require_target(target, existing=existing, endings=(".nc", ".csv"))
    if target.suffix.lower() == ".csv":
        with atomic_path(target) as partial:
            _write_csv(dataset, partial)
    else:
        write_atomic(target, netcdf_bytes(dataset))
    return target


def _write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write block by block, so that the text never stands in memory as a whole."""
    import pandas as pd

    time = dataset["time"].values
    names = np.array(body_names(dataset), dtype=object)
    with path.open("w", encoding="utf-8", newline="") as file:
        pd.DataFrame(columns=CSV_COLUMNS).to_csv(file, index=False)
        for first in range(0, time.size, 200_000):
            block = slice(first, first + 200_000)
            x, y, theta = (dataset[name].values[block] for name in ("x", "y", "theta"))
            present = np.isfinite(x) & np.isfinite(y)
            present[:, 0] |= ~present.any(axis=1)
            row, body = np.nonzero(present)
            values = [time[block][row], x[row, body], y[row, body], theta[row, body], names[body]]
            pd.DataFrame(dict(zip(CSV_COLUMNS, values, strict=True))).to_csv(
                file, index=False, header=False
            )
