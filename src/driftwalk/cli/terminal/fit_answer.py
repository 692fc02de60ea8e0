"""Output of `driftwalk fit`: one JSON object, or rows for people."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.terminal.answer import (
    label_of,
    print_estimates,
    print_intensity,
    print_origin,
    print_report_next,
    print_row,
    print_warnings,
)
from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import command_text, print_next, sibling
from driftwalk.schema.answers.answer import undetermined
from driftwalk.schema.answers.compared_laws import compared_laws
from driftwalk.schema.answers.fit_facts import ESTIMATES, fit_facts, is_open, sentences
from driftwalk.schema.answers.law_words import (
    LAW_KEYS,
    LINEAR_DRAG_ALONE,
    WALL_KEYS,
    law_numbers,
    law_words,
    wall_numbers,
    wall_words,
)

if TYPE_CHECKING:
    import xarray as xr

MOST_FINDINGS: Final = 2
"""Findings that are printed; all are in the file."""
FAR_ABOVE_FLOOR: Final = 2.0
TELLING_SHARE: Final = 0.02
"""Of the intervals at the wall, from which on there may be enough contacts to estimate it."""
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
    *LAW_KEYS,
    "jumps_removed",
    "dropped_frames",
    "compared_laws",
    *WALL_KEYS,
)
"""The last ones where they are in the fit."""


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return the fit with units in its keys; None for what the recording does not determine."""
    facts = fit_facts(found)
    for key in ESTIMATES:
        if is_open(facts, key):
            facts[key] = None
    if facts.get("drag_coefficient", math.nan) is None:
        facts["maximum_likelihood_drag_coefficient"] = None
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


def print_found(fit: xr.Dataset, *, wall: bool = False) -> None:
    """Print the estimates, as soon as they are there.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`, checked or not.
    wall : bool
        Whether an estimate of the wall follows.
    """
    facts = fit_facts(fit)
    print_origin(fit)
    if facts.get("drag_law") == "linear":
        print_row(label_of("drag_coefficient"), LINEAR_DRAG_ALONE)
    else:
        print_estimates(fit, "drag_coefficient")
    print_estimates(fit, "force_std", "tracking_noise")
    if not is_open(facts, "force_noise_intensity_N2_s"):
        print_intensity(facts["force_noise_intensity_N2_s"])
    print_law(facts)
    left_out = f"{facts['wall_share']:.1%}, left out"
    asked = wall or "wall_contacts" in facts or "wall_left_out" in facts
    if not asked and fit.attrs["angle"] == "state" and facts["wall_share"] > TELLING_SHARE:
        left_out += "; --wall estimates restitution and friction from them"
    print_row("intervals at the wall", left_out)
    if "flow" in fit.dims:
        names = fit["flow"].values[fit["interval_flow"].values]
        times = ", ".join(f"{time:g} s" for time in facts["switching_times_s"])
        print_row("flows", f"{', '.join(names)}, switched at {times}")
    # Through a pipe the answer would wait in the buffer for the check and the figures.
    sys.stdout.flush()


def print_verdict(fit: xr.Dataset, check: xr.Dataset | None) -> None:
    """Print what was found after the estimates: compared laws, the wall, and the check."""
    _print_laws(fit)
    _print_wall(fit_facts(fit))
    _print_verdict(check, fit)
    sys.stdout.flush()


def print_places(fit: xr.Dataset, folder: Path) -> None:
    """Print the warnings, and where everything is."""
    print_warnings(fit_facts(fit)["warnings"])
    print_row("flow", folder / "flow.nc")
    if undetermined(fit):
        # Nothing can be simulated with what is not known.
        print_report_next(folder)
        return
    print_row("all in one page", command_text("report", folder, "-o", "report.html"))
    print_next("assemble", folder, "-o", sibling(folder, "assembly"))


def _print_wall(facts: Mapping[str, Any]) -> None:
    """Print restitution and friction of the wall, where they were estimated."""
    lacking = wall_words(facts)
    if lacking is not None:
        print_row("wall", to_options(lacking))
    for number in wall_numbers(facts):
        print_row(number.label, number.text(digits=2))


def print_law(facts: Mapping[str, Any]) -> None:
    """Print the force law, by how much the recording supports it, and what was opened."""
    for label, words in law_words(facts).items():
        print_row(label, words)
    for number in law_numbers(facts):
        print_row(number.label, number.text())


def _print_laws(fit: xr.Dataset) -> None:
    """Print the table of compared laws, the best first."""
    laws = compared_laws(fit)
    if not laws:
        return
    width = 2 + max(len(law.name) for law in laws)
    print("force laws: held out prediction per sample, and evidence, below the best")
    for law in laws:
        words = f"{law.loss:8.4f} ± {law.std:.4f}   {abs(law.evidence):8.1f}"
        print(f"  {law.name:<{width}}{words if law.solved else 'no solution'}")


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
