"""Datasets of earlier schema versions, made into what this version reads."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.schema.answers.facts import calibration_parts, fit_parts, is_explained, texts
from driftwalk.schema.calibration import stored_parameters
from driftwalk.schema.check import with_descriptions
from driftwalk.schema.kinds import KINDS

if TYPE_CHECKING:
    import xarray as xr


_ANSWER: Final = (
    *("drag_coefficient", "force_std_N", "force_noise_intensity_N2_s", "tracking_noise_m"),
    *("confidence", "force_interval_s", "warnings", "study"),
)


def current_form(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset of an earlier version as this version has it; any other one as it is.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset, of driftwalk or not.

    Raises
    ------
    FormatError
        When it is of an earlier version and not what that version wrote.
    """
    kind, version = (dataset.attrs.get(name) for name in ("kind", "schema_version"))
    convert = _CONVERTERS.get((str(kind), _number(version)))
    if convert is None:
        return dataset
    try:
        return convert(dataset)
    except (InputError, KeyError, ValueError, TypeError) as error:
        raise FormatError(
            f"is damaged: its {kind} of schema version {version} is not complete ({error})"
        ) from error


def current_file(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Return the same of a dataset that was read, naming its file where it is damaged."""
    try:
        return current_form(dataset)
    except FormatError as error:
        raise FormatError(str(error), path=path) from error


def _number(version: object) -> int:
    return int(version) if isinstance(version, int | np.integer) else 0


def _fit_of_attributes(fit: xr.Dataset) -> xr.Dataset:
    """Make variables of the attributes of version 1, in which the answer stood.

    Attributes were added while that version lasted: only the answer has to be there.
    """
    for name in _ANSWER:
        if name not in fit.attrs:
            raise InputError(f"the attribute '{name}' is missing")
    names = {"parameter": "log_parameter", "other_parameter": "other_log_parameter"}
    # The dimension has to make room for the variable of that name.
    names |= {"interval": "flow_interval"} if "interval" in fit.dims else {}
    data, coords, _ = fit_parts(fit.attrs)
    kept = ("kind", *(one.name for one in KINDS["fit"].attributes))
    found = fit.rename(names).assign(data).assign_coords(coords)
    found.attrs = {name: fit.attrs[name] for name in kept if name in fit.attrs}
    return with_descriptions(found.assign_attrs(schema_version=KINDS["fit"].version))


def _check_of_attributes(check: xr.Dataset) -> xr.Dataset:
    """Make variables of the attributes of version 1, in which the verdict stood."""
    found = check.assign(explained=((), np.bool_(check.attrs["explained"] == "yes")))
    found = found.assign_coords(finding=("finding", texts(check.attrs["findings"])))
    for name in ("explained", "findings"):
        del found.attrs[name]
    return with_descriptions(found.assign_attrs(schema_version=KINDS["model_check"].version))


def _calibration_of_attributes(calibration: xr.Dataset) -> xr.Dataset:
    """Make variables of the attributes of version 1, in which the answer stood.

    Attributes were added while that version lasted: only the estimates and the warnings have to be
    there. The verdict is the one that version 1 put into the warnings.
    """
    for name in ("warnings", "study"):
        if name not in calibration.attrs:
            raise InputError(f"the attribute '{name}' is missing")
    facts = dict(calibration.attrs)
    judged = ("ks_distance", "noise_floor", "noise_floor_upper", "far_above_floor")
    if all(name in facts for name in judged):
        facts["explained"] = is_explained(*(float(facts[name]) for name in judged))
    parts = calibration_parts(facts, stored_parameters(calibration))
    found = calibration.assign(parts.data).assign_coords(parts.coords)
    found.attrs = parts.attrs
    return _calibration_without_counts(found)


def _calibration_without_counts(calibration: xr.Dataset) -> xr.Dataset:
    """State the replicates of every setting: until version 2 all settings had as many."""
    counts = {}
    for prefix in ("", "refined_"):
        each = calibration.get(f"{prefix}ks_distance_replicate")
        if each is not None:
            shape = each.shape[:-1]
            full = np.full(shape, each.shape[-1], dtype=np.int32)
            counts[f"{prefix}replicate_count"] = (each.dims[:-1], full)
    found = calibration.assign(counts)
    return with_descriptions(found.assign_attrs(schema_version=KINDS["calibration"].version))


_CONVERTERS: Final[dict[tuple[str, int], Callable[[xr.Dataset], xr.Dataset]]] = {
    ("fit", 1): _fit_of_attributes,
    ("model_check", 1): _check_of_attributes,
    ("calibration", 1): _calibration_of_attributes,
    ("calibration", 2): _calibration_without_counts,
}
"""By kind and the version that is read."""
