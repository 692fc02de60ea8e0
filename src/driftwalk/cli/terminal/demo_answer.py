"""Output of the demo: the fit, then the calibration, each next to the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.terminal.output import print_note
from driftwalk.schema.answers.calibration import calibration_answer
from driftwalk.schema.answers.fit import fit_json
from driftwalk.schema.answers.parts import estimates, number_text
from driftwalk.schema.kinds.fit import PARAMETERS

if TYPE_CHECKING:
    import xarray as xr

ROWS: Final = ("drag_coefficient", "force_std", "tracking_noise")
TRUTH: Final = {
    "drag_coefficient": "acting_drag_coefficient",
    **{name: name for name in ("force_std_N", "force_interval_s", "tracking_noise_m")},
}
"""Keys of the truth that estimates are compared with: of the drag, the one that acts."""


@dataclass(frozen=True)
class Fitted:
    """Results of the first half of the demo.

    Attributes
    ----------
    fit : xarray.Dataset
        A `fit`.
    check : xarray.Dataset
        Its `model_check`.
    recording : xarray.Dataset
        The `trajectory`.
    """

    fit: xr.Dataset
    check: xr.Dataset
    recording: xr.Dataset

    @property
    def flow_error(self) -> float:
        """Relative error of the fitted flow, averaged over the block; see `score_fit`."""
        from driftwalk.datasets import tank30_flow
        from driftwalk.likelihood import score_fit

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
    """Return what the estimates are compared with, units in the keys."""
    from driftwalk.datasets import tank30_truth

    truth = tank30_truth()
    return {name: truth[key] for name, key in TRUTH.items()}


def in_json(fitted: Fitted, calibration: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the two answers and the truth."""
    return {
        "truth": demo_truth(),
        "fit": fit_json(fitted.fit, fitted.check) | {"flow_error": fitted.flow_error},
        "calibration": calibration_answer(calibration).facts,
    }


def print_fit(fit: xr.Dataset) -> None:
    """Print the estimates of the fit next to the truth, as soon as they are ready."""
    from driftwalk.datasets import tank30_truth

    truth = tank30_truth()
    print("This recording was simulated by another engine (ODE): the truth is known.")
    _print_estimates("likelihood fit", fit)
    every, step = (1e3 * truth[name] for name in ("force_interval_s", "time_step_s"))
    was, acts = (truth[name] for name in ("drag_coefficient", "acting_drag_coefficient"))
    # Through a pipe the answer would wait in the buffer for the check and the map.
    print(
        f"Intervals of 90 %; σ_F redrawn every {every:g} ms. The engine's C_d was set to {was:g}; "
        f"in its steps\nof {step:g} ms the drag acts like {acts:g}.",
        flush=True,
    )


def print_check(fitted: Fitted) -> None:
    """Print how far the flow is off, whether the model explains the recording, and what warns."""
    fit = fit_json(fitted.fit, fitted.check)
    print_row("flow past the block", "", f"{fitted.flow_error:.1%} off")
    print_row("KS distance, floor", "", _distance(fit, "ks_noise_floor"))
    print_row("model explains it", "", _word(fit["explained"]))
    for finding in fit["findings"]:
        print_note(f"model check: {finding}")
    for warning in fit["warnings"]:
        print_note(f"warning: fit: {warning}")


def print_next(page: Path) -> None:
    """Say what comes next; whoever waits may open the page of the fit meanwhile."""
    print(f"Its page: {page}")
    # How long it takes stands at the bar below, which measures it.
    print("Next, the paper's method: a map of KS distances in the fitted flow.\n", flush=True)


def print_calibration(calibration: xr.Dataset) -> None:
    """Print the minimum of the map next to the truth, and its warnings."""
    search = calibration_answer(calibration).facts
    _print_estimates("KS map in the fitted flow", calibration)
    print_row("KS distance, floor", "", _distance(search))
    print_row("model explains it", "", _word(bool(calibration["explained"])))
    for warning in search["warnings"]:
        print_note(f"warning: KS map: {warning}")


def print_places(folder: Path, page: Path) -> None:
    """Print where the figures are and, last, the page to open."""
    print(f"\nfigures: {folder}/fit/figures, {folder}/calibrate/figures")
    print(f"open in a browser: {page}")


def _print_estimates(method: str, found: xr.Dataset) -> None:
    truth = demo_truth()
    print_row("", "truth", method)
    shown = {one.number.name: one for one in estimates(found)}
    for name in ROWS:
        number, text = PARAMETERS[name], "taken from the recording"
        if name in shown:
            value, *ends = (
                number_text(number.factor * one)
                for one in (shown[name].value, *(shown[name].ends or ()))
            )
            text = f"{value} ({' to '.join(ends)})" if ends else value
        label = f"{number.words} [{number.reader_unit}]" if number.reader_unit else number.words
        print_row(label, f"{number.factor * truth[number.key]:.4g}", text)


def print_row(name: str, *cells: str) -> None:
    """Print a row of the table."""
    widths = (9, 0)
    line = "".join(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=True))
    print(f"{name:27}{line}".rstrip())


def _distance(facts: dict[str, Any], floor: str = "noise_floor") -> str:
    return f"{facts['ks_distance']:.3f}, {facts[floor]:.3f}"


def _word(yes: bool) -> str:
    return "yes" if yes else "no"
