"""What the demo prints: the fit and the calibration beside the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.calibrate import summary as calibration_summary
from driftwalk.cli.fit import answer
from driftwalk.cli.output import print_note

if TYPE_CHECKING:
    import xarray as xr

ROWS: Final = (
    ("drag coefficient C_d", "drag_coefficient", 1.0),
    ("stochastic force σ_F [mN]", "force_std_N", 1e3),
    ("tracking noise [mm]", "tracking_noise_m", 1e3),
)
KNOWN: Final = ("drag_coefficient", "force_std_N", "force_interval_s", "tracking_noise_m")
STEP_REMARK: Final = (
    "The engine's steps of 16 ms\nmake its drag act some 2 % stronger than its C_d says."
)


@dataclass(frozen=True)
class Found:
    """What both commands found.

    Attributes
    ----------
    fit : xarray.Dataset
        A `fit`.
    check : xarray.Dataset
        Its `model_check`.
    calibration : xarray.Dataset
        A `calibration` in the fitted flow.
    recording : xarray.Dataset
        The `trajectory` of both.
    """

    fit: xr.Dataset
    check: xr.Dataset
    calibration: xr.Dataset
    recording: xr.Dataset

    @property
    def flow_error(self) -> float:
        """Relative error of the fitted flow, averaged over the block; see `score_fit`."""
        from driftwalk.calibrate import score_fit
        from driftwalk.datasets import tank30_flow

        truth = demo_truth()
        score = score_fit(
            self.fit,
            drag_coefficient=truth["drag_coefficient"],
            force_std=truth["force_std_N"],
            tracking_noise=truth["tracking_noise_m"],
            flow=tank30_flow(),
            recordings=self.recording,
        )
        return float(score["flow_error"])


def demo_truth() -> dict[str, float]:
    """Return what made the recording, units in the keys."""
    from driftwalk.datasets import tank30_truth

    truth = tank30_truth()
    return {key: truth[key] for key in KNOWN}


def in_json(found: Found) -> dict[str, Any]:
    """Return what ``--json`` prints: the two answers and the truth."""
    return {
        "truth": demo_truth(),
        "fit": answer(found.fit, found.check) | {"flow_error": found.flow_error},
        "calibration": calibration_summary(found.calibration),
    }


def print_beside_truth(found: Found, folder: Path) -> None:
    """Print a table of both answers and the truth, what speaks against them, and the figures."""
    fit = answer(found.fit, found.check)
    search, truth = calibration_summary(found.calibration), demo_truth()
    near = search["distance_to_floor_ratio"] < found.calibration.attrs["far_above_floor"]
    print("This recording was simulated by another engine (ODE): the truth is known.")
    print_row("", "truth", "likelihood fit", "KS map in the fitted flow")
    for name, key, scale in ROWS:
        known = f"{scale * truth[key]:.4g}"
        print_row(name, known, _estimate(fit, key, scale), _estimate(search, key, scale))
    print_row("flow past the block", "", f"{found.flow_error:.1%} off", "the same")
    print_row("KS distance, floor", "", _distance(fit, "ks_noise_floor"), _distance(search))
    print_row("model explains it", "", _word(fit["explained"]), _word(near))
    every = 1e3 * truth["force_interval_s"]
    print(f"Intervals of 90 %; σ_F drawn anew every {every:g} ms. {STEP_REMARK}")
    for finding in fit["findings"]:
        print_note(f"model check: {finding}")
    for name, warnings in (("fit", fit["warnings"]), ("KS map", search["warnings"])):
        for warning in warnings:
            print_note(f"warning: {name}: {warning}")
    print(f"figures: {folder}/fit/figures, {folder}/calibrate/figures")
    print(f"open in a browser: {folder}/fit/report.html, {folder}/calibrate/report.html")


def print_row(name: str, *cells: str) -> None:
    """Print a row of the table."""
    widths = (9, 28, 0)
    line = "".join(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=True))
    print(f"{name:27}{line}".rstrip())


def _estimate(facts: dict[str, Any], key: str, scale: float) -> str:
    if f"{key}_interval" not in facts:
        return "taken from the recording"
    low, high = (scale * end for end in facts[f"{key}_interval"])
    return f"{scale * facts[key]:.4f} ({low:.4f} to {high:.4f})"


def _distance(facts: dict[str, Any], floor: str = "noise_floor") -> str:
    return f"{facts['ks_distance']:.3f}, {facts[floor]:.3f}"


def _word(yes: bool) -> str:
    return "yes" if yes else "no"
