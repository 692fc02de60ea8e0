"""Output of `driftwalk fit`: one JSON object, or rows for people."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.cli.terminal.answer import (
    print_estimates,
    print_intensity,
    print_origin,
    print_page,
    print_row,
    print_warnings,
)
from driftwalk.schema.facts import fit_facts, sentences

if TYPE_CHECKING:
    import xarray as xr

_LAW_ROWS: Final = {
    "added_mass_share": ("added mass / mass", 1.0, ""),
    "effective_drag_coefficient": ("C_d per effective mass", 1.0, ""),
    "effective_force_std_N": ("σ_F per effective mass", 1e3, " mN"),
    "linear_drag_kg_s": ("linear drag", 1e3, " g/s"),
    "drag_power": ("power of the drag", 1.0, ""),
    "force_memory_s": ("memory of the force", 1.0, " s"),
    "time_stamp_noise_s": ("jitter of the stamps", 1e3, " ms"),
    "orientation_offset_rad": ("orientation offset", degrees(1.0), "°"),
    "marker_x_m": ("marker off by, x", 1e3, " mm"),
    "marker_y_m": ("marker off by, y", 1e3, " mm"),
    "flow_strength_change": ("change of the flow", 1e2, " %"),
    "pulse_amplitude": ("pulses of the flow", 1e2, " %"),
    "pulse_frequency_Hz": ("frequency of pulses", 1.0, " Hz"),
}
"""Name, factor and unit of the rows of estimates that stand in a fit where the recording or the
user asks for them."""
MOST_FINDINGS: Final = 2
"""Findings that are printed; all are in the file."""
FAR_ABOVE_FLOOR: Final = 2.0
LEAST_EVIDENCE: Final = 3.0
"""Difference of the logarithms of the evidence for two laws, below which both may be right."""
_KEYS: Final = (
    "drag_coefficient",
    "drag_coefficient_interval",
    "force_std_N",
    "force_std_N_interval",
    "force_interval_s",
    "force_noise_intensity_N2_s",
    "force_noise_intensity_N2_s_interval",
    "tracking_noise_m",
    "tracking_noise_m_interval",
    "confidence",
    "maximum_likelihood_drag_coefficient",
    "wetted_depth_m",
    "wall_share",
    "angle",
    "chi_squared_per_dof",
    "autocorrelation",
    "autocorrelation_std",
    "samples",
    "samples_used",
    "duration_s",
    "recordings",
    "iterations",
    "converged",
    "visited_share",
    "drag_coefficient_relative_std",
    "drag_coefficient_precision",
    "needed_duration_s",
    "switching_times_s",
    "mistakes",
    "force_law",
    "law_settled_by",
    *(f"{name}{end}" for name in _LAW_ROWS for end in ("", "_interval")),
    "drag_coefficient_any_added_mass_interval",
    "force_std_any_added_mass_interval_N",
    "jumps_removed",
    "dropped_frames",
    "compared_laws",
    "wall_contacts",
    *(f"wall_{name}{end}" for name in ("restitution", "friction") for end in ("", "_interval")),
)
"""The last ones where they are in the fit."""


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return the fit with units in its keys."""
    facts = fit_facts(found)
    if "compared_law" in found.dims:
        facts["compared_laws"] = _laws_of(found)
    return {
        **{key: facts[key] for key in _KEYS if key in facts},
        "recording": facts["source"],
        "warnings": facts["warnings"],
    }


def _laws_of(fit: xr.Dataset) -> dict[str, dict[str, float | None]]:
    """Return the compared laws, by name; None where one has no solution."""
    names = ("compared_log_evidence", "compared_log_score", "compared_log_score_std")
    return {
        str(law): {
            name.removeprefix("compared_"): value if isfinite(value) else None
            for name in names
            for value in [float(fit[name].sel(compared_law=law))]
        }
        for law in fit["compared_law"].values
    }


def answer(fit: xr.Dataset, check: xr.Dataset | None) -> dict[str, Any]:
    """Return all that ``--json`` prints: the fit, and the check where one was asked for."""
    return summary(fit) | verdict(check, fit)


def verdict(check: xr.Dataset | None, fit: xr.Dataset) -> dict[str, Any]:
    """Return the check of the model with units in its keys; nothing where none was asked for."""
    if check is None:
        reason = fit.attrs.get("check_left_out")
        return {} if reason is None else {"explained": None, "check_left_out": reason}
    facts = check.attrs
    distances = {key: float(facts[key]) for key in ("ks_distance", "ks_noise_floor")}
    return {
        "explained": bool(check["explained"]),
        "findings": sentences(check, "finding"),
        **{key: value if isfinite(value) else None for key, value in distances.items()},
    }


def print_answer(fit: xr.Dataset, check: xr.Dataset | None, folder: Path) -> None:
    """Print the answer for people: the fit, where the flow is, and the check."""
    facts = fit_facts(fit)
    print_origin(fit)
    print_estimates(fit, "drag_coefficient", "force_std", "tracking_noise")
    print_intensity(facts["force_noise_intensity_N2_s"])
    print_law(facts)
    if "compared_law" in fit.dims:
        _print_laws(fit)
    print_row("intervals at the wall", f"{facts['wall_share']:.1%}, left out")
    _print_wall(facts)
    if "flow" in fit.dims:
        names = fit["flow"].values[fit["interval_flow"].values]
        times = ", ".join(f"{time:g} s" for time in facts["switching_times_s"])
        print_row("flows", f"{', '.join(names)}, switched at {times}")
    print_warnings(facts["warnings"])
    print_row("flow", folder / "flow.nc")
    _print_verdict(check, fit)
    print_page(folder)


def _print_wall(facts: Mapping[str, Any]) -> None:
    """Print restitution and friction of the wall, where they were estimated."""
    if "wall_contacts" not in facts:
        return
    if "wall_friction" not in facts:
        print_row("wall", f"{facts['wall_contacts']} contacts say too little of it")
        return
    for name in ("restitution", "friction"):
        low, high = facts[f"wall_{name}_interval"]
        print_row(f"{name} of the wall", f"{facts[f'wall_{name}']:.2g} ({low:.2g} to {high:.2g})")


def _law_in_words(law: str, settled: float | None) -> str:
    """Return the force law, and by how much the recording supports it."""
    names = ["the paper's", "a floating body's"]
    found, other = names if law == "paper" else reversed(names)
    if settled is None:
        return f"{found}, as far as this recording tells" if law == "paper" else found
    if settled < LEAST_EVIDENCE:
        return f"{found}; the recording cannot tell it from {other}"
    return f"{found}; {other} is less likely by e^{settled:.0f}"


def print_law(facts: Mapping[str, Any]) -> None:
    """Print the force law, by how much the recording supports it, and what was opened."""
    if "force_law" in facts:
        print_row("force law", _law_in_words(str(facts["force_law"]), facts.get("law_settled_by")))
    for key, (name, scale, unit) in _LAW_ROWS.items():
        if key in facts:
            low, high = (scale * end for end in facts[f"{key}_interval"])
            print_row(name, f"{scale * facts[key]:.3g}{unit} ({low:.3g} to {high:.3g})")


def _print_laws(fit: xr.Dataset) -> None:
    """Print the table of compared laws, the best first."""
    best = float(fit["compared_log_score"].max())
    evidence = fit["compared_log_evidence"] - fit["compared_log_evidence"].max()
    print("force laws: held out prediction per sample, and evidence, below the best")
    for name in fit["compared_law"].values[np.argsort(-fit["compared_log_score"].values)]:
        law = fit.sel(compared_law=name)
        lost, std = best - float(law["compared_log_score"]), float(law["compared_log_score_std"])
        one = float(evidence.sel(compared_law=name))
        words = "no solution" if isnan(lost) else f"{lost:8.4f} ± {std:.4f}   {abs(one):8.1f}"
        print(f"  {name:<28}{words}")


def _print_verdict(check: xr.Dataset | None, fit: xr.Dataset) -> None:
    """Print whether the model explains the recording, and the worst of what speaks against it."""
    found = verdict(check, fit)
    if check is None:
        if found:
            print_row("model check", found["check_left_out"])
        return
    if found["explained"]:
        print_row("model check", "the model explains this recording")
    else:
        print_row("model check", "THE MODEL DOES NOT EXPLAIN THIS RECORDING:")
        for finding in found["findings"][:MOST_FINDINGS]:
            print(f"  {finding}")
        more = len(found["findings"]) - MOST_FINDINGS
        if more > 0:
            print(f"  and {more} more: see findings in check.nc, or --json")
    if found["ks_distance"] is None:
        print_row("KS distance", f"not available: {check.attrs['ks_left_out']}")
        return
    far = found["ks_distance"] > FAR_ABOVE_FLOOR * found["ks_noise_floor"]
    print_row(
        "KS distance",
        f"{found['ks_distance']:.3f}, noise floor {found['ks_noise_floor']:.3f}"
        + (": far, but within the uncertainty of the fit" if found["explained"] and far else ""),
    )
