"""The answer of a command in rows for people: a label, a value with its unit, an interval."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from driftwalk.cli.terminal.output import print_next, print_note, printable
from driftwalk.schema.answers.answer import NOT_DETERMINED, SYMBOLS, Estimate, estimate_of

if TYPE_CHECKING:
    import xarray as xr

LABEL_WIDTH: Final = 22
SMALLEST_FIXED: Final = 1e-3
"""Smaller numbers are printed with an exponent."""
WORDS: Final = MappingProxyType(
    {
        "drag_coefficient": "drag coefficient",
        "force_std": "stochastic force",
        "force_noise_intensity": "noise intensity",
    }
)
"""Words in front of a parameter's symbol."""


def label_of(parameter: str) -> str:
    """Return what a row calls a parameter.

    Examples
    --------
    >>> label_of("force_std"), label_of("tracking_noise")
    ('stochastic force σ_F', 'tracking noise')
    """
    words = WORDS.get(parameter, parameter.replace("_", " "))
    return f"{words} {SYMBOLS[parameter]}" if parameter in SYMBOLS else words


def number_text(value: float) -> str:
    """Return a number with four decimals, or with three digits where these would all be zeros.

    Examples
    --------
    >>> number_text(0.61542), number_text(0.00002)
    ('0.6154', '2e-05')
    """
    return f"{value:.4f}" if value >= SMALLEST_FIXED else f"{value:.3g}"


def ends_text(found: Estimate) -> str | None:
    """Return "0.3881 to 0.3976", None without an interval."""
    return None if found.ends is None else " to ".join(number_text(end) for end in found.ends)


def print_row(label: str, text: object) -> None:
    """Print a row.

    Examples
    --------
    >>> print_row("flow", "fit/flow.nc")
    flow                   fit/flow.nc
    """
    print(f"{printable(label):{LABEL_WIDTH}} {printable(str(text))}")


def print_origin(found: xr.Dataset) -> None:
    """Say that a recording was simulated, where it was."""
    if found.attrs.get("simulated_recording") == "yes":
        print("This recording was simulated, not measured.")


def print_estimates(found: xr.Dataset, *parameters: str) -> None:
    """Print a row for each of some parameters; a force without its interval means nothing.

    Parameters
    ----------
    found : xarray.Dataset
        A `fit` or a `calibration`.
    *parameters : str
        Their names, in the order of the rows.
    """
    for name in parameters:
        one = estimate_of(found, name)
        if one.open:
            print_row(label_of(name), NOT_DETERMINED)
            continue
        text = f"{number_text(one.value)} {one.unit}".rstrip()
        if name == "force_std":
            text += f", redrawn every {1e3 * float(found['force_interval']):g} ms"
        ends = ends_text(one)
        if ends is None:
            said = "no interval without a bootstrap"
        else:
            said = f"{float(found['confidence']):.0%} interval {ends}"
        print_row(label_of(name), f"{text}   {said}")


def print_intensity(value: float) -> None:
    """Print σ_F²·τ [N² s], which is what a recording tells of the force."""
    print_row(label_of("force_noise_intensity"), f"{value:.4g} N² s")


def print_warnings(texts: Iterable[str]) -> None:
    """Print warnings on stderr."""
    for text in texts:
        print_note(f"warning: {text}")


def print_figures(folder: Path) -> None:
    """Print where the figures of a run are."""
    print_row("figures", folder / "figures")


def print_report_next(*runs: Path) -> None:
    """Print the command that makes one page of some runs, which comes next."""
    print_next("report", *runs, "-o", "report.html")
