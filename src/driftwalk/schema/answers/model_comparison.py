"""The answer of compared motion models, and words for the parts of a comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.parts import Answer, Part, Table, by_name, each

if TYPE_CHECKING:
    import xarray as xr

ASPECT_WORDS: Final = {
    "steps": "steps",
    "steps_3": "steps of 3 intervals",
    "steps_9": "steps of 9 intervals",
    "frame": "displacement in the body's frame",
    "wall": "place near the wall",
    "memory": "memory of the speed",
}
_CHECKS: Final = {
    "displacement_1": ("mean squared displacement over 1 step interval", "msd, 1 step"),
    "displacement_3": ("mean squared displacement over 3", "msd, 3 steps"),
    "displacement_10": ("mean squared displacement over 10", "msd, 10 steps"),
    "displacement_30": ("mean squared displacement over 30", "msd, 30 steps"),
    "displacement_100": ("mean squared displacement over 100", "msd, 100 steps"),
    "speed_time": ("time over which the speed lasts", "speed lasts"),
    "wall_share": ("share of the time at the wall", "at the wall"),
    "rest_share": ("share of the time at rest", "at rest"),
}
CHECK_WORDS: Final = {name: words for name, (words, _) in _CHECKS.items()}
CHECK_LABELS: Final = {name: label for name, (_, label) in _CHECKS.items()}
"""Short ones, for figures."""

_COLUMNS: Final = ("model", "numbers", "distance", "behind", "D of steps")


def own_score(found: xr.Dataset) -> float:
    """Return the distance of the recording's own parts, as the models' distances are counted.

    Parameters
    ----------
    found : xarray.Dataset
        A `model_comparison` or a `model_calibration`.

    Returns
    -------
    float
        Mean over the aspects of the distance over the floor.
    """
    return float((found["own_distance"] / found["floor"]).mean())


def comparison_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a comparison: the verdict, the ranking, the reasons."""
    findings, warnings = sentences(found, "finding"), sentences(found, "warning")
    models = each(found, "model")
    own = by_name(found, "aspect", "own_distance")
    apart = ", ".join(f"{ASPECT_WORDS.get(name, name)} {value:.3f}" for name, value in own.items())
    parts: list[Part] = [
        *(f"{text}." for text in findings[:1]),
        ranking_table(found),
        f"D of the recording's own parts: {apart}",
        *(f"{text}." for text in findings[1:]),
    ]
    attributes = ("step_interval_s", "duration_s", "worlds", "seed")
    optional = ("halves_ks_distance", "halves_p_value")
    facts = {
        "findings": findings,
        "models": [_model(one) for one in models],
        "own_distance": own,
        "floor": by_name(found, "aspect", "floor"),
        "checks": by_name(
            found,
            "check",
            lambda one: {
                "unit": str(one["check_unit"].values),
                "recorded": float(one["check_recorded"]),
            },
        ),
        **{key: found.attrs[key] for key in attributes},
        **{key: found.attrs[key] for key in optional if key in found.attrs},
        "warnings": warnings,
    }
    return Answer(parts, facts, warnings)


def ranking_table(found: xr.Dataset) -> Table:
    """Return the table of the compared models, the closest first."""
    asked = "asked" in found
    rows = [
        (
            str(one["model"].values),
            int(one["free_numbers"]),
            f"{float(one['score']):.2f} ± {float(one['score_std']):.2f}",
            f"{float(one['behind']):.2f} ± {float(one['behind_std']):.2f}" if index else "",
            f"{float(one['held_out_distance'][0]):.3f}",
            *((_misfit(one),) if asked else ()),
            "a walk of steps" if bool(one["baseline"]) else str(one["verdict"].values),
        )
        for index, one in enumerate(each(found, "model"))
    ]
    columns = (*_COLUMNS, *(("discrepancy",) if asked else ()), "verdict")
    return Table(rows, columns, "models, the closest first")


def _misfit(one: xr.Dataset) -> str:
    if not bool(one["asked"]):
        return ""
    return f"{float(one['discrepancy']):.0f} (own below {float(one['discrepancy_q95']):.0f})"


def _model(one: xr.Dataset) -> dict[str, Any]:
    ends, summaries = one["end_score"].values, {}
    if "asked" in one and bool(one["asked"]):
        names = ("discrepancy", "discrepancy_median", "discrepancy_q95", "deviance")
        summaries = {"named": bool(one["named"]), **{name: float(one[name]) for name in names}}
    known = one.isel(parameter=np.flatnonzero(np.isfinite(one["estimate"].values)))
    return {
        "model": str(one["model"].values),
        "verdict": str(one["verdict"].values),
        "verdict_reasons": [text for text in str(one["verdict_reason"].values).split("; ") if text],
        "baseline": bool(one["baseline"]),
        "numbers": int(one["free_numbers"]),
        **{name: float(one[name]) for name in ("score", "score_std", "behind", "behind_std")},
        **summaries,
        "held_out_distance": by_name(one, "aspect", "held_out_distance"),
        "checks": by_name(
            one,
            "check",
            lambda of: [float(of[f"check_{part}"]) for part in ("low", "median", "high")],
        ),
        "estimate": by_name(
            known,
            "parameter",
            lambda of: {"value": float(of["estimate"]), "unit": str(of["parameter_unit"].values)},
        ),
        "end_scores": ends[np.isfinite(ends)].tolist(),
        "evaluations": int(one["evaluations"]),
    }
