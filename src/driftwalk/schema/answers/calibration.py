"""The answers of calibrations: on a map of one or two parameters, and by summaries of many."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.schema.answers.facts import facts_of, flat_variables, sentences
from driftwalk.schema.answers.model_comparison import own_score
from driftwalk.schema.answers.parts import (
    PREDICT,
    Answer,
    Following,
    Row,
    by_name,
    each,
    estimates,
    intensity_row,
    origin,
)
from driftwalk.schema.answers.verdict import stored_verdict, verdict_facts, verdict_parts
from driftwalk.schema.kinds.calibration import CALIBRATION
from driftwalk.schema.parameters import flat_name, is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr

_NOT_IN_JSON: Final = ("far_above_floor", "region_level", "position_quantum_m")

UNCHECKED: Final = "it takes a refined map and a bootstrap"
"""Why a calibration has no verdict."""


def calibration_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a calibration."""
    facts, parts = facts_of(found), [*origin(found), *estimates(found)]
    if "force_noise_intensity_N2_s" in facts:
        parts.append(intensity_row(facts["force_noise_intensity_N2_s"]))
    if "ks_distance" in facts and "noise_floor" in facts:
        said = f"{facts['ks_distance']:.4f} at the optimum, noise floor {facts['noise_floor']:.4f}"
        parts.append(Row("KS distance", said))
    if "second_half_ks_distance" in facts:
        said = (
            f"{facts['second_half_ks_distance']:.4f} for a calibration on the first, noise floor "
            f"{facts['second_half_noise_floor']:.4f}"
        )
        parts.append(Row("second half", said))
    if "halves_ks_distance" in facts:
        said = (
            f"{facts['halves_ks_distance']:.4f} apart, halves of parts drawn at random "
            f"{facts['halves_ks_distance_expected']:.4f}"
        )
        parts.append(Row("its own halves", said))
    if estimates(found):
        parts += verdict_parts(stored_verdict(found), UNCHECKED)
    warnings = sentences(found, "warning")
    return Answer(parts, _json(found, facts, warnings), warnings)


def _json(found: xr.Dataset, facts: dict[str, Any], warnings: list[str]) -> dict[str, Any]:
    own, block = [one.key for one in stored_parameters(found)], is_block(found)
    keys = [*own, *(f"{key}_interval" for key in own)]
    keys += [key for key in flat_variables(CALIBRATION) if key not in _NOT_IN_JSON]
    if block:
        keys += [f"{stage}_{key}" for stage in ("first_half", "coarse") for key in own]
        shown = {key: facts.get(key) for key in keys}
    else:
        shown = {key: facts[key] for key in ("model", *keys) if key in facts}
    shown |= verdict_facts(stored_verdict(found))
    return {**shown, "recording": facts.get("recording_name"), "warnings": warnings}


def model_calibration_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a calibration of many parameters."""
    parts = [*origin(found), *estimates(found)]
    distance = (
        f"{float(found['score']):.2f} ± {float(found['score_std']):.2f} noise floors from blocks "
        f"not seen, the recording's own parts {own_score(found):.2f}"
    )
    parts.append(Row("distance", distance))
    if "discrepancy" in found:
        said = (
            f"discrepancy {float(found['discrepancy']):.0f}, of the model's own recordings "
            f"{float(found['discrepancy_median']):.0f} (95 % below "
            f"{float(found['discrepancy_q95']):.0f})"
        )
        parts.append(Row("summaries", said))
    verdict = stored_verdict(found)
    parts += verdict_parts(verdict)
    warnings = sentences(found, "warning")
    # Single numbers that a calibration may lack: without matched summaries there is no discrepancy.
    numbers = (
        *("score", "score_std", "searched_score", "matched_score"),
        *("discrepancy", "discrepancy_median", "discrepancy_q95", "interval_stretch"),
    )
    attributes = ("confidence", "step_interval_s", "duration_s", "position_noise_m", "seed")
    facts = {
        "model": found.attrs["model"],
        "parameters": {_key(one): _parameter(one) for one in each(found, "parameter")},
        "fixed": json.loads(found.attrs["fixed"]),
        "estimate_from": found.attrs["estimate_from"],
        **verdict_facts(verdict),
        "held_out_distance": by_name(found, "aspect", "held_out_distance"),
        "own_distance": by_name(found, "aspect", "own_distance"),
        **{name: float(found[name]) for name in numbers if name in found},
        **{key: found.attrs[key] for key in attributes},
        "warnings": warnings,
    }
    return Answer(parts, facts, warnings)


def _parameter(one: xr.Dataset) -> dict[str, Any]:
    ends = one["interval"].values
    return {
        "value": float(one["estimate"]),
        "interval": ends.tolist() if np.isfinite(ends).all() else None,
        "determined": bool(one["determined"]),
        "range": one["range"].values.tolist(),
    }


def _key(one: xr.Dataset) -> str:
    return flat_name(str(one["parameter"].values), str(one["unit"].values))


def after_calibration(found: xr.Dataset) -> Following:
    """Return what comes after a `calibration`."""
    return PREDICT if is_block(found) else simulate_model(found)


def simulate_model(found: xr.Dataset) -> Following:
    """Return what comes after the calibration of another model than the block."""
    if "model_source_sha256" in found.attrs:
        # The user names a model that is none of driftwalk's own; on a page its name says nothing.
        return Following(("simulate", str(found.attrs["model"]), "motion.nc"))
    return Following(
        ("simulate", "motion.nc"), "Simulate the model: `driftwalk simulate {run} -o motion.nc`"
    )
