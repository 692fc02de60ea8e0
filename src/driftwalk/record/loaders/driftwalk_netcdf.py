"""driftwalk's own NetCDF: a `trajectory` dataset as `save_trajectory` wrote it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.netcdf import open_netcdf, read_attributes
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions
from driftwalk.schema import body_names, check_trajectory


class DriftwalkLoader:
    """SI units, y up, with everything that was known about the recording."""

    name = "driftwalk"
    description = "driftwalk's own NetCDF"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the attribute ``kind``."""
        return 1.0 if read_attributes(head, path).get("kind") == "trajectory" else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every body and carry the attributes over."""
        dataset = open_netcdf(path)
        try:
            check_trajectory(dataset)
        except ValueError as error:
            raise FormatError(str(error), path=path) from error
        time = np.asarray(dataset["time"].values, dtype=np.float64)
        fields = [np.asarray(dataset[name].values, np.float64) for name in ("x", "y", "theta")]
        bodies = []
        for index, name in enumerate(body_names(dataset)):
            x, y, theta = (np.ascontiguousarray(field[:, index]) for field in fields)
            bodies.append(RawBody(name, time, x, y, theta if np.isfinite(theta).any() else None))
        kept = {
            key: value
            for key, value in dataset.attrs.items()
            if key not in ("kind", "schema_version", "counts")
        }
        return RawRecording(
            bodies, clock_unit="s", length_unit="m", y_axis="up", rows=time.size, attrs=kept
        )


LOADER = DriftwalkLoader()
