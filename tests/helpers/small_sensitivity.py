"""Sensitivity studies that take no time, and each of their settings simulated by hand."""

from __future__ import annotations

from typing import Any

import xarray as xr

import driftwalk as dw
from driftwalk.assembly.runs.run import assemble

RUNS, REALISATIONS = 12, 3
# A stream towards one side of a narrow tank: within ten seconds most blocks have met.
FLOW = dw.uniform_flow(0.02, 0.0)


def small(**sections: dict[str, Any]) -> dw.Study:
    """Return a study of two or three blocks and few short runs."""
    given: dict[str, Any] = {
        "tank": {"diameter_m": 0.16},
        "forces": {"drag_coefficient": 0.45, "force_std_N": 1e-3},
        "assembly": {"blocks": 3, "duration_s": 10.0},
        "sensitivity": {"runs": RUNS, "reference_realisations": REALISATIONS, "seed": 5},
    }
    for name, values in sections.items():
        given[name] = {**given.get(name, {}), **values}
    return dw.Study(**given)


def by_hand(study: dw.Study, trial: int, **options: Any) -> xr.Dataset:
    """Simulate one setting by the public function, with the random numbers of its trial."""
    return assemble(study, FLOW, runs=RUNS, seed=5, trial=trial, **options)
