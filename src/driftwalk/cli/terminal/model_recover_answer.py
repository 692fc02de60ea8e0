"""Output of `driftwalk study recover --model`: a table for people, the same as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.cli.terminal.answer import print_report_next, print_row, print_warnings
from driftwalk.cli.terminal.output import print_table
from driftwalk.cli.terminal.recover_answer import length_text
from driftwalk.schema.parameters import unit_suffix

if TYPE_CHECKING:
    import xarray as xr

FACTS: Final = (
    *("duration_s", "sample_rate_Hz", "missing_share", "position_noise_m", "noise"),
    *("confidence", "seed"),
)
STATUS_WORDS: Final = {1: "could not be calibrated", 2: "could not be simulated"}


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the truth and the summary of each parameter."""
    return {
        "model": found.attrs["model"],
        "fixed": json.loads(found.attrs["fixed"]),
        "recordings": found.sizes["recording"],
        "calibrated": int((found["status"].values == 0).sum()),
        **{key: found.attrs[key] for key in FACTS},
        "parameters": {_key(one): _parameter(one) for one in _each(found)},
        "warnings": warnings(found),
    }


def warnings(found: xr.Dataset) -> list[str]:
    """Return what the user should know, in sentences."""
    said = []
    status = found["status"].values
    for value, words in STATUS_WORDS.items():
        which = status == value
        if which.any():
            why = str(found["message"].values[which][0])
            said.append(f"{which.sum()} of {status.size} recordings {words}: {why}")
    return said


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the set-up, the table, and where everything is."""
    facts = found.attrs
    lost = float(facts["missing_share"])
    print(
        f"{facts['model']}: {found.sizes['recording']} recordings of "
        f"{length_text(float(facts['duration_s']))} at {float(facts['sample_rate_Hz']):g} Hz"
        f"{f', {lost:.0%} of the samples missing' if lost else ''}, tracking noise "
        f"{1e3 * float(facts['position_noise_m']):.3g} mm"
        f"{', which is known' if facts['noise'] == 'known' else ''}"
    )
    print_table(
        [_row(one) for one in _each(found)],
        columns=[
            "parameter", "truth", "median |error|", "determined in",
            f"{facts['confidence']:.0%} intervals that hold the truth",
        ],
    )  # fmt: skip
    print_warnings(warnings(found))
    print_row("every recording", folder / "model_recovery.nc")
    print_report_next(folder)


def _row(one: xr.Dataset) -> list[str]:
    count = _counts(one)
    unit = str(one["unit"].values)
    error = float(one["median_error"])
    held = f"{count['covered']} of {count['intervals']}" if count["intervals"] else "no intervals"
    return [
        str(one["parameter"].values).replace("_", " "),
        f"{float(one['truth']):g} {'' if unit == '1' else unit}".rstrip(),
        f"{100.0 * error:.1f} %" if np.isfinite(error) else "-",
        f"{count['determined']} of {count['calibrated']}",
        held,
    ]


def _counts(one: xr.Dataset) -> dict[str, int]:
    """Return in how many recordings a parameter is what."""
    known = np.isfinite(one["interval"].transpose("recording", "bound").values).all(axis=1)
    calibrated = one["status"].values == 0
    return {
        "calibrated": int(calibrated.sum()),
        "determined": int((one["determined"].values.astype(bool) & calibrated).sum()),
        "intervals": int(known.sum()),
        "covered": round(float(one["coverage"]) * known.sum()) if known.any() else 0,
    }


def _parameter(one: xr.Dataset) -> dict[str, Any]:
    names = (
        *("truth", "median_error", "determined_median_error", "determined_share", "coverage"),
        "coverage_standard_error",
    )
    return {**{name: _number(float(one[name])) for name in names}, **_counts(one)}


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _key(one: xr.Dataset) -> str:
    name, suffix = str(one["parameter"].values), unit_suffix(str(one["unit"].values))
    return f"{name}_{suffix}" if suffix else name


def _each(found: xr.Dataset) -> list[xr.Dataset]:
    return [found.isel(parameter=index) for index in range(found.sizes["parameter"])]
