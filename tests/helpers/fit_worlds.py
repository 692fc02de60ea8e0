"""Recordings for tests of the likelihood fit: parts of the bundled one, with coarse knots.

They were simulated by another engine; every parameter is known.
"""

from __future__ import annotations

from functools import cache
from typing import Literal

import xarray as xr

import driftwalk as dw
from driftwalk.model import Study, apply_overrides

TRUTH = dw.tank30_truth()
DRAG = TRUTH["drag_coefficient"]
FORCE_N = TRUTH["force_std_N"]
NOISE_M = TRUTH["tracking_noise_m"]


def coarse_study(law: Literal["auto", "paper"] = "paper") -> Study:
    """Return the study of the bundled recording with knots 3 cm apart, for speed.

    With the paper's law, which is that of the recording, nothing else is looked for.
    """
    closed = {
        "fit.law": "paper",
        "fit.camera": "exact",
        "fit.flow_strength": "constant",
        "fit.force_memory_s": "white",
    }
    return apply_overrides(
        Study(),
        {
            "forces.force_interval_s": TRUTH["force_interval_s"],
            "fit.spline_spacing_m": 0.03,
            **(closed if law == "paper" else {}),
        },
    )


@cache
def _whole(realisation: Literal["first", "second"]) -> xr.Dataset:
    return dw.tank30_recording(realisation)


def recording(seconds: float, realisation: Literal["first", "second"] = "first") -> xr.Dataset:
    """Return the first part of a bundled recording."""
    return _whole(realisation).sel(time=slice(0.0, seconds)).copy(deep=True)


@cache
def _fitted(seconds: float) -> xr.Dataset:
    return dw.fit_motion(recording(seconds), coarse_study())


def fitted(seconds: float) -> xr.Dataset:
    """Return the fit of the first part of the bundled recording, made once in a process."""
    return _fitted(seconds).copy(deep=True)
