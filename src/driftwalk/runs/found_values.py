"""Values of a motion model that an earlier run has found: its directory, or a file of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import InputError
from driftwalk.core.provenance import read_manifest
from driftwalk.core.run_layout import MANIFEST_FILE, faults_of, run_file, run_files, state_of
from driftwalk.motion import MotionModel, estimated_values
from driftwalk.schema.netcdf import kind_of, open_netcdf

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FoundValues:
    """The values that a run holds of its model.

    Attributes
    ----------
    file : Path
        The file of the estimates.
    found : xarray.Dataset
        The estimates.
    known : dict of str to float
        Values that the run was given, by the name of the parameter; of a body of the family with
        its ``clearance`` [m]. Empty for a file that lies in no run directory.
    faults : list of str
        What the manifest of the run says against the file.
    """

    file: Path
    found: xr.Dataset
    known: dict[str, float] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)

    def of(self, model: MotionModel) -> dict[str, float]:
        """Return the values of a model, by the names of its parameters.

        Parameters
        ----------
        model : MotionModel
            The model that the run was about.

        Raises
        ------
        InputError
            When the run was about another model.
        """
        try:
            values = estimated_values(self.found, model)
        except InputError as error:
            raise InputError(f"{self.file}: {error}") from error
        names = {one.name for one in model.parameters}
        known = {name: value for name, value in self.known.items() if name in names}
        return {**known, **{name: value for name, value in values.items() if name in names}}

    def is_outdated(self, model: MotionModel) -> bool:
        """Return whether the source of the model is not the one that the run had."""
        known = self.found.attrs.get("model_source_sha256")
        own = model.facts(self.of(model)).get("model_source_sha256")
        return known is not None and own != known


def read_found_values(place: Path) -> FoundValues:
    """Read the values that a calibration has found.

    Parameters
    ----------
    place : Path
        The run directory of a finished calibration or comparison of models, or its dataset.

    Returns
    -------
    FoundValues
        The estimates, and what the run was given.

    Raises
    ------
    InputError
        When there is none, or the run has not come to its end.

    Examples
    --------
    >>> read_found_values(Path("run")).found.attrs["model"]  # doctest: +SKIP
    'active'
    """
    if place.is_file():
        folder, file = place.parent, place
    else:
        folder, file = place, _dataset_in(place)
    found = open_netcdf(file)
    if "estimate" not in found:
        raise InputError(f"{file} holds no estimate of parameters: give that of a calibration")
    return FoundValues(file, found, _known(folder), faults_of(folder, [file.name]))


def _dataset_in(folder: Path) -> Path:
    state = state_of(folder)
    if state == "unfinished":
        raise InputError(
            f"{folder} holds a run that is not finished: run its command again, which continues it"
        )
    if state == "new":
        what = "is not a run directory" if folder.exists() else "does not exist"
        raise InputError(f"{folder} {what}: give the directory of a finished calibration")
    for path in run_files(folder, "*.nc"):
        if kind_of(path) in ("calibration", "model_calibration", "model_comparison"):
            return path
    raise InputError(f"{folder} holds a finished run, but no calibration of a motion model")


def _known(folder: Path) -> dict[str, float]:
    """Return what a run was given: the known values of its model, with the clearance."""
    if state_of(folder) != "finished":
        return {}
    specification = read_manifest(folder / MANIFEST_FILE).get("specification")
    model = specification.get("model") if isinstance(specification, Mapping) else None
    if not isinstance(model, Mapping):
        return {}
    fixed = model.get("fixed")
    given: dict[str, Any] = dict(fixed) if isinstance(fixed, Mapping) else {}
    if "clearance_m" in model:
        given["clearance"] = model["clearance_m"]
    # With many parameters it may come from the recording.
    path = run_file(folder, "model_calibration.nc")
    if path is not None:
        given |= json.loads(open_netcdf(path).attrs["fixed"])
    return {name: float(one) for name, one in given.items() if _is_number(one)}


def _is_number(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value)
