"""Output of `driftwalk study recover`: a table for people, the same as JSON for programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.cli.terminal.answer import print_report_next, print_row, print_warnings
from driftwalk.cli.terminal.output import print_table
from driftwalk.cli.terminal.progress import duration_text
from driftwalk.schema.answers.answer import symbol_of

if TYPE_CHECKING:
    import xarray as xr

PARAMETERS: Final = ("drag_coefficient", "force_std", "tracking_noise")
SUMMARY: Final = (
    *("median_absolute_error", "absolute_error_90", "bias", "rms_error", "spread", "rms_z"),
    *("coverage", "coverage_low", "coverage_high"),
)
ATTRS: Final = (
    *("drag_coefficient", "force_std_N", "force_interval_s", "tracking_noise_m", "flow"),
    *("sample_interval_s", "recordings_per_fit", "missing_share", "seed", "confidence"),
    "coverage_confidence",
)
NOTABLE_BIAS: Final = 0.05
NOTABLE_STANDARD_ERRORS: Final = 3.0
NOTABLE_EXCESS: Final = 2.0
"""In standard errors of the logarithm of an rms."""
COLUMNS: Final = ("length", "angle", "of", "median |error|", "90 % within", "bias", "rms z")


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the truth, and the summary by length and use of the angle."""
    results = []
    for part in _parts(found):
        table = {
            name: {key: float(part[key].sel(parameter=name)) for key in SUMMARY}
            for name in PARAMETERS
        }
        flow = {key: float(part[key]) for key in ("median_flow_error", "flow_error_90")}
        results.append(
            {
                "duration_s": float(part["duration"]),
                "angle": str(part["angle"].values),
                **counts(part),
                **table,
                **flow,
                "median_wall_share": float(np.nanmedian(part["wall_share"].values))
                if np.isfinite(part["wall_share"].values).any()
                else None,
                "median_fit_s": _median_of_fitted(part["fit_time"].values),
            }
        )
    return {
        "truth": {key: found.attrs[key] for key in ATTRS},
        "results": results,
        "needed": [_needed(found.sel(angle=angle)) for angle in found["angle"].values],
        "warnings": warnings(found),
    }


def counts(part: xr.Dataset) -> dict[str, int]:
    """Return what became of the recordings of one length."""
    fitted = int((part["status"].values == 0).sum())
    used = int(part["used"].values.sum())
    return {
        "recordings": part.sizes["recording"],
        "used": used,
        "at_the_wall": fitted - used,
        "without_fit": part.sizes["recording"] - fitted,
    }


def warnings(found: xr.Dataset) -> list[str]:
    """Return what the user should know, in sentences."""
    said = []
    for part in _parts(found):
        number = counts(part)
        where = _where(part)
        if number["at_the_wall"]:
            said.append(
                f"{where}: {number['at_the_wall']} of {number['recordings']} recordings have more "
                f"than {found.attrs['most_wall_share']:.0%} of their intervals at the wall; they "
                "are left out of the summary"
            )
        if number["without_fit"]:
            texts = [str(text) for text in part["message"].values.ravel() if text]
            said.append(
                f"{where}: {number['without_fit']} of {number['recordings']} recordings could not "
                f"be fitted: {texts[0]}"
            )
    longest = found.isel(duration=-1)
    for angle in found["angle"].values:
        part = longest.sel(angle=angle)
        said += [f"{_where(part)}: {text}" for text in _doubts(part)]
    return said


def _where(part: xr.Dataset) -> str:
    return f"{length_text(float(part['duration']))}, angle {part['angle'].values}"


def _doubts(part: xr.Dataset) -> list[str]:
    """Return what to say of C_d where its error is not the chance that the fits state."""
    used = counts(part)["used"]
    value = {key: float(part[key].sel(parameter="drag_coefficient")) for key in SUMMARY}
    chance = value["spread"] / np.sqrt(max(used, 1))
    said = []
    if abs(value["bias"]) > max(NOTABLE_BIAS, NOTABLE_STANDARD_ERRORS * chance):
        said.append(
            f"C_d is off by {value['bias']:+.0%} on average, where chance gives "
            f"{chance:.0%}: more recordings do not help, and only a comparison of "
            "lengths shows whether longer ones do"
        )
    if value["coverage_high"] < part.attrs["confidence"]:
        said.append(
            f"the {part.attrs['confidence']:.0%} intervals of C_d hold the truth in "
            f"{round(value['coverage'] * used)} of {used}: they are too narrow here, by a "
            f"factor of about {value['rms_z']:.1f}"
        )
    excess = _excess(part, value["rms_error"])
    if excess > np.exp(NOTABLE_EXCESS / np.sqrt(2.0 * max(used, 1))):
        said.append(
            f"the error of C_d is {excess:.1f} times what the square root of the length gives: do "
            "not trust the length to record"
        )
    return said


def _excess(part: xr.Dataset, rms_error: float) -> float:
    """Return the error over that of the law; the longest recordings show a bias that stays."""
    law = float(part["drag_coefficient_error_scale"]) / np.sqrt(float(part["duration"]))
    return float(rms_error / law)


def length_text(seconds: float) -> str:
    """Return a duration in words, without parts that are zero.

    Examples
    --------
    >>> length_text(1800.0), length_text(5400.0)
    ('30 min', '1 h 30 min')
    """
    return duration_text(seconds).removesuffix(" 0 s").removesuffix(" 0 min")


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the table, how long to record, and where the rest is."""
    facts = found.attrs
    print(
        f"truth: C_d {facts['drag_coefficient']:g}, σ_F {1e3 * facts['force_std_N']:g} mN every "
        f"{1e3 * facts['force_interval_s']:g} ms, tracking noise "
        f"{1e3 * facts['tracking_noise_m']:.3g} mm, flow: {facts['flow']}"
    )
    rows = [row for part in _parts(found) for row in _rows(part)]
    print_table(
        rows, columns=[*COLUMNS, f"{facts['confidence']:.0%} intervals that hold the truth"]
    )
    for angle in found["angle"].values:
        print(_needed_sentence(found.sel(angle=angle)))
    print_warnings(warnings(found))
    print_row("every recording", folder / "recovery.nc")
    print_report_next(folder)


def _parts(found: xr.Dataset) -> list[xr.Dataset]:
    return [
        found.sel(duration=duration, angle=angle)
        for duration in found["duration"].values
        for angle in found["angle"].values
    ]


def _rows(part: xr.Dataset) -> list[list[str]]:
    used = counts(part)["used"]
    rows = []
    for name in PARAMETERS:
        value = {key: float(part[key].sel(parameter=name)) for key in SUMMARY}
        covered = (
            f"{round(value['coverage'] * used)} of {used} ({value['coverage_low']:.0%} to "
            f"{value['coverage_high']:.0%})"
            if used
            else "none"
        )
        errors = [_percent(value[key]) for key in ("median_absolute_error", "absolute_error_90")]
        rows.append(
            [
                symbol_of(name),
                *errors,
                _percent(value["bias"], sign="+"),
                f"{value['rms_z']:.2f}",
                covered,
            ]
        )
    flow = [_percent(float(part[key])) for key in ("median_flow_error", "flow_error_90")]
    rows.append(["flow", *flow])
    head = [length_text(float(part["duration"])), str(part["angle"].values)]
    return [[*(head if n == 0 else ("", "")), *row] for n, row in enumerate(rows)]


def _percent(value: float, *, sign: str = "") -> str:
    return f"{100 * value:{sign}.1f} %" if np.isfinite(value) else "-"


def _median_of_fitted(values: Any) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None


def _needed(part: xr.Dataset) -> dict[str, Any]:
    """Return how long to record with one use of the angle."""
    return {
        "angle": str(part["angle"].values),
        "drag_coefficient_precision": part.attrs["drag_coefficient_precision"],
        "duration_s": float(part["needed_duration"]),
        "duration_s_interval": [float(part[f"needed_duration_{end}"]) for end in ("low", "high")],
        "drag_coefficient_error_scale_sqrt_s": float(part["drag_coefficient_error_scale"]),
        "basis": _basis(part),
    }


def _basis(part: xr.Dataset) -> str:
    lengths = ", ".join(length_text(float(value)) for value in part["duration"].values)
    return f"rms error of C_d at {lengths}, assumed to fall with the square root of the length"


def _needed_sentence(part: xr.Dataset) -> str:
    scale = float(part["drag_coefficient_error_scale"])
    head = f"angle {part['angle'].values}: "
    if not np.isfinite(scale):
        return f"{head}too few fits to say how the error of C_d falls with the length"
    hour, low, high = (
        f"{float(part[f'drag_coefficient_error_scale{end}']) / np.sqrt(3600.0):.1%}"
        for end in ("", "_low", "_high")
    )
    within = f"{part.attrs['needed_confidence']:.0%} interval"
    text = f"{head}C_d to {hour} (rms) in 1 h ({within} {low} to {high})"
    asked = float(part.attrs["drag_coefficient_precision"])
    if np.isfinite(asked):
        time, low, high = (
            length_text(float(part[f"needed_duration{end}"])) for end in ("", "_low", "_high")
        )
        text = f"{head}for C_d to {asked:.1%} (rms) record {time} ({within} {low} to {high})"
    return f"{text}: an estimate from the {_basis(part)}"
