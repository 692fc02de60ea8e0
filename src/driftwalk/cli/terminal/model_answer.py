"""Output of `driftwalk calibrate` for a model of many parameters: rows for people, or JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.cli.terminal.answer import (
    ends_text,
    label_of,
    number_text,
    print_figures,
    print_row,
    print_warnings,
)
from driftwalk.cli.terminal.calibration_answer import model_words
from driftwalk.cli.terminal.output import command_text, print_next, sibling
from driftwalk.schema.answers.answer import estimate_of
from driftwalk.schema.answers.compared_models import own_score
from driftwalk.schema.parameters import unit_suffix

if TYPE_CHECKING:
    import xarray as xr


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the answer with units in its keys."""
    aspects = [str(name) for name in found["aspect"].values]
    return {
        "model": found.attrs["model"],
        "parameters": {_key(one): _parameter(one) for one in _each(found)},
        "fixed": json.loads(found.attrs["fixed"]),
        "estimate_from": found.attrs["estimate_from"],
        "explained": bool(found["explained"]),
        "verdict": str(found["verdict"].values),
        "held_out_distance": dict(
            zip(aspects, found["held_out_distance"].values.tolist(), strict=True)
        ),
        "own_distance": dict(zip(aspects, found["own_distance"].values.tolist(), strict=True)),
        **{
            name: float(found[name])
            for name in (
                "score", "score_std", "searched_score", "matched_score", "misfit", "usual_misfit",
                "most_misfit", "interval_stretch",
            )
            if name in found
        },
        **{
            key: found.attrs[key]
            for key in ("confidence", "step_interval_s", "duration_s", "position_noise_m", "seed")
        },
        "warnings": [str(text) for text in found["warning"].values],
    }  # fmt: skip


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the parameters, the verdict, and where everything is."""
    for one in _each(found):
        name = str(one["parameter"].values)
        print_row(label_of(name), _value_text(found, one, name))
    print_row(
        "distance",
        f"{float(found['score']):.2f} ± {float(found['score_std']):.2f} noise floors from blocks "
        f"not seen, the recording's own parts {own_score(found):.2f}",
    )
    if "misfit" in found:
        print_row(
            "summaries",
            f"misfit {float(found['misfit']):.0f}, of the model's own recordings "
            f"{float(found['usual_misfit']):.0f} (95 % below {float(found['most_misfit']):.0f})",
        )
    where = str(found["verdict"].values)
    print_row("explained", "yes" if bool(found["explained"]) else f"no: {where}")
    print_warnings(str(text) for text in found["warning"].values)
    print_figures(folder)
    print_row("all in one page", command_text("report", folder, "-o", "report.html"))
    print_next("simulate", folder, *model_words(found), "-o", sibling(folder, "motion.nc"))


def _value_text(found: xr.Dataset, one: xr.Dataset, name: str) -> str:
    """Return a value with its interval; no value where the recording does not determine it."""
    estimate = estimate_of(found, name)
    ends = ends_text(estimate)
    if not bool(one["determined"]):
        within = "" if ends is None else f" ({ends} {estimate.unit}".rstrip() + ")"
        return f"not determined{within}"
    said = f"{float(found.attrs['confidence']):.0%} interval {ends}"
    return f"{number_text(estimate.value)} {estimate.unit}".rstrip() + f"   {said}"


def _parameter(one: xr.Dataset) -> dict[str, Any]:
    ends = one["interval"].values
    return {
        "value": float(one["estimate"]),
        "interval": ends.tolist() if np.isfinite(ends).all() else None,
        "determined": bool(one["determined"]),
        "range": one["range"].values.tolist(),
    }


def _key(one: xr.Dataset) -> str:
    name, suffix = str(one["parameter"].values), unit_suffix(str(one["unit"].values))
    return f"{name}_{suffix}" if suffix else name


def _each(found: xr.Dataset) -> list[xr.Dataset]:
    return [found.isel(parameter=index) for index in range(found.sizes["parameter"])]
