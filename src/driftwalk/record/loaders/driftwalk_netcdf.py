"""driftwalk's own NetCDF: a `trajectory` as `save_trajectory` wrote it, or a `simulation`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text_files import parse_toml
from driftwalk.record.raw import Extra, RawBody, RawRecording, ReadOptions
from driftwalk.schema import body_names, check_trajectory
from driftwalk.schema.check import check_contents
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.kinds.motion import SIMULATION, TRAJECTORY
from driftwalk.schema.parameters import is_block
from driftwalk.schema.stores.netcdf import MAGIC, kind_of_file, open_netcdf
from driftwalk.schema.trajectory import POSE, block_of_study

if TYPE_CHECKING:
    import xarray as xr


class DriftwalkLoader:
    """SI units, y up, with everything that was known about the recording."""

    name = "driftwalk"
    description = "driftwalk's own NetCDF"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the attribute ``kind``."""
        known = head.startswith(MAGIC) and kind_of_file(path) in ("trajectory", "simulation")
        return 1.0 if known else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every body and carry the attributes over; of a simulation one replicate."""
        dataset = check_contents(open_netcdf(path), path)
        if find_kind(dataset) is SIMULATION:
            dataset = _replicate(dataset, options.replicate)
        try:
            check_trajectory(dataset)
        except ValueError as error:
            raise FormatError(str(error)) from error
        extra = _extra(dataset)
        time = np.array(dataset["time"].values, dtype=np.float64)
        bodies = []
        for index, name in enumerate(body_names(dataset)):
            x, y, theta = (np.array(dataset[key].values[:, index], np.float64) for key in POSE)
            further = {key: np.array(dataset[key].values[:, index], np.float64) for key in extra}
            oriented = theta if np.isfinite(theta).any() else None
            bodies.append(RawBody(name, time, x, y, oriented, extra=further))
        own = {"kind", "schema_version", "counts"}
        kept = {key: value for key, value in dataset.attrs.items() if key not in own}
        if dataset.attrs.get("format") == "driftwalk track":
            # `counts` is what reading found; the tracker's own counts are kept next to it.
            kept["tracking_counts"] = dataset.attrs["counts"]
        return RawRecording(bodies, "s", "m", y_axis="up", attrs=kept, extra=extra)


def _replicate(simulation: xr.Dataset, replicate: int) -> xr.Dataset:
    """Return one simulated world as a recording; tank, block and force interval stay stated."""
    count = simulation.sizes["replicate"]
    if not 0 <= replicate < count:
        raise InputError(f"no `replicate` {replicate}: the simulation has {count}, counted from 0")
    chosen = simulation[list(POSE)].isel(replicate=replicate, drop=True)
    kept = {name: simulation.attrs[name] for name in ("arena",) if name in simulation.attrs}
    if is_block(simulation) and "study" in simulation.attrs:
        kept |= block_of_study(parse_toml(str(simulation.attrs["study"])))
        if "force_interval_s" in simulation.attrs:
            kept["force_interval_s"] = simulation.attrs["force_interval_s"]
    version = TRAJECTORY.version
    chosen.attrs = {"kind": "trajectory", "schema_version": version, "simulated": "yes", **kept}
    return chosen


def _extra(dataset: xr.Dataset) -> dict[str, Extra]:
    """Return the further numbers that are known of each sample, such as its covariance."""
    found = {}
    for name, variable in dataset.data_vars.items():
        dims = tuple(str(dim) for dim in variable.dims)
        if name in POSE or dims[:2] != ("time", "body") or variable.dtype.kind not in "fiub":
            continue
        coords = {dim: dataset[dim] for dim in dims[2:] if dim in dataset.coords}
        found[str(name)] = Extra(dims[2:], dict(variable.attrs), coords)
    return found


LOADER = DriftwalkLoader()
