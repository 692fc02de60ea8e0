"""`driftwalk compare`: how far apart two motions are."""

from __future__ import annotations

import json as json_module
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from driftwalk.cli.inputs.recordings import load_motion
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import Json, Replace, argument, optional
from driftwalk.cli.options.study import study_option
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_table,
    print_warnings,
    require_place,
    save_dataset,
)

if TYPE_CHECKING:
    import xarray as xr

_NUMBERS = {
    "ks_distance": "ks_distance",
    "score": "score",
    "ks_distance_a": "ks_distance_a",
    "ks_distance_b": "ks_distance_b",
    "ks_step_length_m": "ks_step_length",
    "ks_turning_angle_rad": "ks_turning_angle",
    "p_value": "p_value",
    "noise_floor": "noise_floor",
    "block_length_steps": "block_length",
    "autocorrelation_time_steps": "autocorrelation_time",
    "tied_fraction": "tied_fraction",
}
_BY_MOTION = {
    "pairs": "pairs",
    "effective_pairs": "",
    "zero_length": "zero_length",
    "gaps": "gaps",
    "mode": "mode",
    "mean_step_length_m": "mean_step_length",
    "median_step_length_m": "median_step_length",
    "std_turning_angle_rad": "std_turning_angle",
}


@with_recording_options
def compare(
    a: Annotated[Path, argument("A", "Recording, or output of driftwalk simulate.")],
    b: Annotated[Path, argument("B", "Recording, or output of driftwalk simulate.")],
    how: RecordingOptions,
    body_b: str | None = optional("--body-b", "Body in B (default: same as A)."),
    step_interval: Annotated[Any, study_option("step_interval")] = None,
    ties: Literal["strict", "limits"] = optional(
        "--ties",
        "Treatment of points that tie with an origin: in no quadrant, or in each.",
        default="strict",
    ),
    permutations: int = optional(
        "--permutations N", "Permutations of the test; 0 for no test.", min=0, default=999
    ),
    seed: int = optional("--seed N", "Seed of the permutations.", min=0, default=1),
    out: Path | None = optional("--out -o FILE.nc", "File for the comparison."),
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Measure how far apart two motions are.

    Turns both into step lengths and turning angles at the same step interval. Their distance is the
    two-sample Kolmogorov-Smirnov statistic of Fasano and Franceschini. The options for reading
    apply to both files.
    """
    from driftwalk.comparison import compare as compare_motions

    if out is not None:
        require_place(out, existing="replace" if overwrite else "error")
    how_b = how if body_b is None else replace(how, body=body_b)
    motions = load_motion(a, how), load_motion(b, how_b)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        interval = None if step_interval == "auto" else step_interval
        result = compare_motions(
            *motions, step_interval=interval, ties=ties, permutations=permutations, seed=seed
        )
    if out is not None:
        save_dataset(result, out)
    summary = summarise(result)
    # What `compare` warned of in passing stands in the result as well, there with the motion.
    noted = " ".join(summary["warnings"])
    said = [str(one.message) for one in caught]
    summary["warnings"] += [text for text in said if text not in noted]
    if json:
        print_json({"a": a, "b": b, **summary})
        return
    _print(summary)
    print_warnings(summary["warnings"])
    print_next("report", b, "-o", "report.html")


def summarise(result: xr.Dataset) -> dict[str, Any]:
    """Return the numbers of a comparison with units in the keys, ready for JSON."""
    memory = float(result["autocorrelation_time"])
    motions = {
        f"motion_{name}": {
            key: result[variable].values[index]
            if variable
            # Steps remember their past: as many independent ones would tell as much. NaN untested.
            else round(float(result["pairs"].values[index]) / memory, 1)
            for key, variable in _BY_MOTION.items()
        }
        for index, name in enumerate("ab")
    }
    return {
        **{key: result[variable].item() for key, variable in _NUMBERS.items()},
        "step_interval_s": result.attrs["step_interval_s"],
        **motions,
        "warnings": json_module.loads(result.attrs["warnings"]),
    }


def _print(summary: dict[str, Any]) -> None:
    print_table([[key, summary[key]] for key in (*_NUMBERS, "step_interval_s")])
    print()
    rows = [[key, summary["motion_a"][key], summary["motion_b"][key]] for key in _BY_MOTION]
    print_table(rows, columns=["motion", "a", "b"])
