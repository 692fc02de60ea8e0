"""Output of `driftwalk calibrate`: one JSON object, or rows for people."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.terminal.answer import (
    print_estimates,
    print_figures,
    print_intensity,
    print_origin,
    print_row,
    print_warnings,
)
from driftwalk.cli.terminal.output import command_text, print_next, sibling
from driftwalk.schema.answers.calibration_facts import calibration_facts
from driftwalk.schema.calibration import is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr

_KEYS: Final = (
    "drag_coefficient",
    "drag_coefficient_interval",
    "force_std_N",
    "force_std_N_interval",
    "confidence",
    "force_interval_s",
    "force_noise_intensity_N2_s",
    "ks_distance",
    "ks_distance_standard_error",
    "noise_floor",
    "noise_floor_upper",
    "distance_to_floor_ratio",
    "interval_stretch",
    "second_half_ks_distance",
    "second_half_noise_floor",
    "halves_ks_distance",
    "halves_ks_distance_expected",
    "halves_p_value",
    "first_half_drag_coefficient",
    "first_half_force_std_N",
    "coarse_drag_coefficient",
    "coarse_force_std_N",
    "wetted_depth_m",
    "position_noise_m",
    "orientation_noise_rad",
    "step_interval_s",
    "time_step_s",
    "duration_s",
    "recording_pairs",
)


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the answer with units in its keys."""
    facts = calibration_facts(found)
    if is_block(found):
        answer = {key: facts.get(key) for key in _KEYS}
    else:
        own = [one.key for one in stored_parameters(found)]
        keys = ("model", *own, *(f"{key}_interval" for key in own), *_KEYS)
        answer = {key: facts[key] for key in keys if key in facts}
    return {
        **answer,
        "recording": facts["recording_name"],
        "warnings": facts["warnings"],
    }


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the answer for people, and where the figures are."""
    facts = calibration_facts(found)
    print_origin(found)
    print_estimates(found, *map(str, found["parameter"].values))
    if is_block(found):
        print_intensity(facts["force_noise_intensity_N2_s"])
    print_row(
        "KS distance",
        f"{facts['ks_distance']:.4f} at the optimum, noise floor {facts['noise_floor']:.4f}",
    )
    if "second_half_ks_distance" in facts:
        print_row(
            "second half",
            f"{facts['second_half_ks_distance']:.4f} for a calibration on the first, noise floor "
            f"{facts['second_half_noise_floor']:.4f}",
        )
    if "halves_ks_distance" in facts:
        print_row(
            "its own halves",
            f"{facts['halves_ks_distance']:.4f} apart, halves of parts drawn at random "
            f"{facts['halves_ks_distance_expected']:.4f}",
        )
    print_warnings(facts["warnings"])
    print_figures(folder)
    print_row("all in one page", command_text("report", folder, "-o", "report.html"))
    if is_block(found):
        print_next("assemble", folder, "-o", sibling(folder, "assembly"))
    else:
        print_next("simulate", folder, *model_words(found), "-o", sibling(folder, "motion.nc"))


def model_words(found: xr.Dataset) -> list[str]:
    """Return how the user names a model that is none of driftwalk's own."""
    model = str(found.attrs["model"])
    return ["--model", model] if "model_source_sha256" in found.attrs else []
