"""The numbers of a fit under flat names, with the unit in the name.

The command line prints them under these names: ``force_std_N`` is the value at
``force_std`` of the variable ``estimate``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.text.json_text import parse_json

if TYPE_CHECKING:
    import xarray as xr

ESTIMATES: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "drag_coefficient": ("drag_coefficient", "1"),
        "force_std_N": ("force_std", "N"),
        "force_noise_intensity_N2_s": ("force_noise_intensity", "N2 s"),
        "tracking_noise_m": ("tracking_noise", "m"),
        "force_lever_m": ("force_lever", "m"),
        "orientation_noise_rad": ("orientation_noise", "rad"),
        "added_mass_share": ("added_mass_share", "1"),
        "effective_drag_coefficient": ("effective_drag_coefficient", "1"),
        "effective_force_std_N": ("effective_force_std", "N"),
        "linear_drag_kg_s": ("linear_drag", "kg s-1"),
        "drag_power": ("drag_power", "1"),
        "force_memory_s": ("force_memory", "s"),
        "time_stamp_noise_s": ("time_stamp_noise", "s"),
        "orientation_offset_rad": ("orientation_offset", "rad"),
        "marker_x_m": ("marker_x", "m"),
        "marker_y_m": ("marker_y", "m"),
        "flow_strength_change": ("flow_strength_change", "1"),
        "pulse_amplitude": ("pulse_amplitude", "1"),
        "pulse_frequency_Hz": ("pulse_frequency", "Hz"),
    }
)
"""Flat name to the parameter and its unit. Lever and noise of the orientation with the angle in the
state only; what comes after them where it was estimated."""
BOUNDS: Final = ("lower", "upper")

FIT_NUMBERS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "force_interval_s": "force_interval",
        "confidence": "confidence",
        "maximum_likelihood_drag_coefficient": "maximum_likelihood_drag_coefficient",
        "drag_coefficient_relative_std": "drag_coefficient_relative_std",
        "drag_coefficient_precision": "drag_coefficient_precision",
        "needed_duration_s": "needed_duration",
        "wetted_depth_m": "wetted_depth",
        "wall_share": "wall_share",
        "drag_coefficient_angle_given": "drag_coefficient_angle_given",
        "angle_disagreement_std": "angle_disagreement_std",
        "duration_s": "duration",
        "chi_squared_per_dof": "chi_squared_per_dof",
        "autocorrelation": "autocorrelation",
        "autocorrelation_std": "autocorrelation_std",
        "roughness_weight": "roughness_weight",
        "size_weight": "size_weight",
        "visited_share": "visited_share",
        "spline_spacing_m": "spline_spacing",
        "cell_size_m": "cell_size",
        "recording_start_s": "recording_start",
        "law_settled_by": "law_settled_by",
        "wall_restitution": "wall_restitution",
        "wall_friction": "wall_friction",
    }
)
FIT_COUNTS: Final = (
    *("samples", "mistakes", "jumps_removed", "dropped_frames", "samples_used"),
    *("intervals_usable", "recordings", "iterations", "wall_contacts"),
)
FIT_VERDICTS: Final = ("restricted", "converged")
FIT_ROWS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "drag_coefficient_angle_given_interval": ("drag_coefficient_angle_given_interval", "bound"),
        "spline_origin_m": ("spline_origin", "axis"),
        "switching_times_s": ("switching_time", "switch"),
        "drag_coefficient_any_added_mass_interval": (
            "drag_coefficient_any_added_mass_interval",
            "bound",
        ),
        "force_std_any_added_mass_interval_N": ("force_std_any_added_mass_interval", "bound"),
        "wall_restitution_interval": ("wall_restitution_interval", "bound"),
        "wall_friction_interval": ("wall_friction_interval", "bound"),
    }
)


def fit_variables(facts: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the variables and coordinates of a fit that hold facts under flat names.

    Parameters
    ----------
    facts : mapping
        Numbers, pairs and words; what has no place in a variable is passed over.
    """
    names = [key for key in ESTIMATES if key in facts]
    data: dict[str, Any] = {
        "estimate": ("parameter", np.array([facts[key] for key in names], dtype=np.float64)),
        "interval": (
            ("parameter", "bound"),
            np.array([facts[f"{key}_interval"] for key in names], dtype=np.float64),
        ),
    }
    for key, name in FIT_NUMBERS.items():
        if key in facts:
            data[name] = ((), np.float64(facts[key]))
    for key in FIT_COUNTS:
        if key in facts:
            data[key] = ((), np.int64(facts[key]))
    for key in FIT_VERDICTS:
        if key in facts:
            data[key] = ((), np.bool_(facts[key] == "yes"))
    for key, (name, dim) in FIT_ROWS.items():
        if key in facts:
            # NetCDF keeps a list of one number as the number.
            data[name] = (dim, np.atleast_1d(np.asarray(facts[key], dtype=np.float64)))
    coords: dict[str, Any] = {
        "parameter": ("parameter", np.array([ESTIMATES[key][0] for key in names])),
        "unit": ("parameter", np.array([ESTIMATES[key][1] for key in names])),
        "bound": ("bound", np.array(BOUNDS)),
        "axis": ("axis", np.array(["x", "y"])),
    }
    if "warnings" in facts:
        coords["warning"] = ("warning", texts(facts["warnings"]))
    return data, coords


def texts(stored: str | Sequence[str]) -> Any:
    """Return sentences as an array; given as a list or as its JSON text.

    Text keeps its type where there is none: a variable of length 0 stays one of text in a file.
    """
    found = parse_json(stored) if isinstance(stored, str) else stored
    return np.array(found, dtype=np.str_)


def fit_facts(fit: xr.Dataset) -> dict[str, Any]:
    """Return what a fit says under flat names, in Python's own types.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`. Its attributes are among the facts; what is not in it is absent.

    Returns
    -------
    dict
        ``drag_coefficient`` and ``drag_coefficient_interval`` [low, high], ``force_std_N`` and so
        on; verdicts as "yes" and "no"; ``warnings``, a list of sentences.
    """
    facts: dict[str, Any] = {str(key): value for key, value in fit.attrs.items()}
    if "estimate" in fit and "parameter" in fit.coords:
        known = [str(name) for name in fit["parameter"].values]
        for key, (name, _) in ESTIMATES.items():
            if name in known:
                facts[key] = float(fit["estimate"].values[known.index(name)])
                if "interval" in fit:
                    facts[f"{key}_interval"] = fit["interval"].values[known.index(name)].tolist()
    named = {**FIT_NUMBERS, **{key: key for key in (*FIT_COUNTS, *FIT_VERDICTS)}}
    named |= {key: name for key, (name, _) in FIT_ROWS.items()}
    facts |= {key: plain(fit[name]) for key, name in named.items() if name in fit.variables}
    facts["warnings"] = sentences(fit, "warning")
    return facts


def is_open(facts: Mapping[str, Any], key: str) -> bool:
    """Return whether an interval has no upper end: the recording does not determine the number.

    Examples
    --------
    >>> facts = {"drag_coefficient": 0.4, "drag_coefficient_interval": [0.0, np.inf]}
    >>> is_open(facts, "drag_coefficient"), is_open(facts, "force_std_N")
    (True, False)
    """
    return bool(np.isposinf(facts.get(f"{key}_interval", (0.0, 0.0))[1]))


def sentences(dataset: xr.Dataset, name: str) -> list[str]:
    """Return the sentences that a variable holds; none where it is absent."""
    return [str(text) for text in dataset[name].values] if name in dataset.variables else []


def plain(values: xr.DataArray) -> Any:
    """Return values in Python's own types; a verdict as "yes" or "no"."""
    found = values.values.tolist()
    return {True: "yes", False: "no"}[found] if isinstance(found, bool) else found


def fitted_value(fit: xr.Dataset, parameter: str) -> float:
    """Return the estimate of a parameter of a fit or of a calibration.

    Raises
    ------
    InputError
        When it was not fitted.
    """
    known = [str(name) for name in fit["parameter"].values]
    if parameter not in known:
        kind = fit.attrs.get("kind", "fit")
        raise InputError(f"the {kind} has no {parameter}: it has {', '.join(known)}")
    return float(fit["estimate"].values[known.index(parameter)])
