"""Calibrations of models of a user, for tests of figures and pages. Synthetic: none was run."""

from __future__ import annotations

import xarray as xr
from synthetic_calibration import answered, synthetic_calibration

from driftwalk.schema.answers.facts import facts_of

NAMES = {"drag_coefficient": "speed", "force_std": "tumble_rate"}
UNITS = {"speed": "m/s", "tumble_rate": "1/s"}
LABELS = {"speed": "speed", "tumble_rate": "rate of tumbles"}
PREFIXES = ("", "refined_", "bootstrap_", "region_")


def two_parameters(points: int = 9) -> xr.Dataset:
    """Return a calibration over a speed [m/s] and a rate of tumbles [1/s]."""
    found = synthetic_calibration(points=points, simulated="no")
    renamed = found.rename(
        {f"{prefix}{old}": f"{prefix}{new}" for prefix in PREFIXES for old, new in NAMES.items()}
    )
    for prefix in PREFIXES:
        for name, unit in UNITS.items():
            renamed[f"{prefix}{name}"].attrs = {"units": unit, "long_name": LABELS[name]}
    facts = facts_of(found)
    kept = {
        name: value
        for name, value in facts.items()
        if not name.startswith(("drag_coefficient", "force_"))
    }
    bare = renamed.drop_vars(["estimate", "interval", "force_interval", "force_noise_intensity"])
    bare.attrs = {}
    answer = {
        "model": "tumble",
        "speed_m_s": facts["drag_coefficient"],
        "speed_m_s_interval": facts["drag_coefficient_interval"],
        "tumble_rate_per_s": facts["force_std_N"],
        "tumble_rate_per_s_interval": facts["force_std_N_interval"],
        "confidence": 0.9,
    }
    return answered(bare, kept | answer)


def one_parameter() -> xr.Dataset:
    """Return a calibration over the rate of tumbles alone, on a logarithmic scale."""
    whole = two_parameters()
    found = whole.isel(speed=2, refined_speed=6).drop_vars(
        [name for name in whole.variables if str(name).endswith("speed")], errors="ignore"
    )
    for name in ("tumble_rate", "refined_tumble_rate"):
        shifted = found[name] + 1e-4  # a logarithmic axis has no zero
        found = found.assign_coords({name: (name, shifted.values, found[name].attrs)})
        found[name].attrs["scale"] = "log"
    return found.sel(parameter=["tumble_rate"])
