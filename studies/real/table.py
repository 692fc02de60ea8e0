"""Print the table of docs/validation.md from finished runs: python table.py RUN [RUN ...].

Each run is a run directory of `driftwalk calibrate`; its name becomes the first column.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

COLUMNS = (
    "recording",
    "pairs of steps",
    "C_d·d/m [m/kg]",
    "σ_F/m [m/s²]",
    "σ_F²·τ [N² s]",
    "D",
    "floor",
    "D/floor",
    "second half: D (floor)",
)


def row(name: str, found: xr.Dataset) -> list[str]:
    """Return the cells of one calibration; what is interpreted, each with its 90 % interval."""
    from driftwalk.model import parse_study
    from driftwalk.schema.answers.facts import facts_of

    facts = facts_of(found)
    study = parse_study(facts["study"])
    per_mass = 1.0 / study.block.mass_kg
    drag = per_mass * study.wetted_depth_m
    return [
        name,
        str(facts["recording_pairs"]),
        _with_interval(facts, "drag_coefficient", drag),
        _with_interval(facts, "force_std_N", per_mass),
        f"{facts['force_noise_intensity_N2_s']:.2g}",
        f"{facts['ks_distance']:.3f}",
        f"{facts['noise_floor']:.3f}",
        f"{facts['distance_to_floor_ratio']:.1f}",
        f"{facts['second_half_ks_distance']:.3f} ({facts['second_half_noise_floor']:.3f})",
    ]


def _with_interval(facts: dict[str, Any], key: str, factor: float) -> str:
    low, high = facts[f"{key}_interval"]
    return f"{factor * facts[key]:.3g} ({factor * low:.3g} to {factor * high:.3g})"


def main(runs: list[str]) -> None:
    """Print the table, and below it the warnings of each run."""
    from driftwalk.schema.stores.netcdf import open_netcdf

    print("| " + " | ".join(COLUMNS) + " |")
    print("|" + "---|" * len(COLUMNS))
    warnings = []
    for run in runs:
        found = open_netcdf(Path(run) / "calibration.nc")
        print("| " + " | ".join(row(Path(run).name, found)) + " |")
        warnings += [(Path(run).name, text) for text in found["warning"].values]
    print()
    for name, text in warnings:
        print(f"- {name}: {text}")


if __name__ == "__main__":
    main(sys.argv[1:])
