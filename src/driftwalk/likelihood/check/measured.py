"""A measured flow that contradicts the motion: the fit without it, and how the two flows differ."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.likelihood.flow_intervals import fitted_flow
from driftwalk.likelihood.measured_flow import MeasuredFlow
from driftwalk.schema import FLAGS
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr


class PlacementPolicy(NamedTuple):
    """Where a measured flow is looked for in the fitted one."""

    farthest_m: float = 0.04
    """Largest shift along an axis. Chosen by hand: a length of the usual block and more."""
    step_m: float = 0.005
    """Between shifts. Chosen by hand: a quarter of the usual distance between knots."""
    agrees: float = 0.9
    """Correlation of two flows from which on they are the same. With errors of 5 % that of a
    measured flow with the fitted one is 0.99. Chosen by hand."""
    covers: float = 0.5
    """Share of the fitted nodes that a placement has to cover for its correlation to count. Chosen
    by hand."""


PLACEMENT: Final = PlacementPolicy()


class Placement(NamedTuple):
    """How a measured flow is turned, mirrored and shifted, in words, and how well it fits then."""

    words: str
    correlation: float


def best_placement(measured: MeasuredFlow, free: xr.Dataset) -> Placement:
    """Return where the measured flow fits a flow that was fitted without it best."""
    flow = fitted_flow(free, interval=0)
    known = flow["flag"].values == FLAGS["measured"]
    x, y = flow["x"].values, flow["y"].values
    want = np.stack([flow[name].values for name in ("u", "v")])
    enough = PLACEMENT.covers * np.count_nonzero(known)
    return max(
        (
            Placement(words, _correlation(moved, want, known & there, enough))
            for words, moved, there in _moved(measured, x, y)
        ),
        key=lambda one: one.correlation,
    )


def _moved(measured: MeasuredFlow, x: Floats, y: Floats) -> Iterator[tuple[str, Floats, Bools]]:
    """Yield the flow turned, mirrored and shifted: words, velocities, where it was measured."""
    spline = measured.spline
    own = measured.own[:2].reshape(2, spline.rows, spline.columns)
    count = round(PLACEMENT.farthest_m / PLACEMENT.step_m)
    shifts = PLACEMENT.step_m * np.arange(-count, count + 1)
    known = np.pad(np.isfinite(measured.velocity[0]), 1)
    for mirrored, (sign_x, sign_y) in _SIGNS.items():
        for shift_x in shifts:
            for shift_y in shifts:
                at_x, at_y = sign_x * x + shift_x, sign_y * y + shift_y
                there = known[np.ix_(_nearest(measured.y, at_y), _nearest(measured.x, at_x))]
                moved = spline.values(own, at_x, at_y)
                words = mirrored
                if shift_x or shift_y:
                    words = (
                        f"{mirrored}{' and ' if mirrored else ''}shifted by "
                        f"{-1e3 * sign_x * shift_x:.0f} mm in x and "
                        f"{-1e3 * sign_y * shift_y:.0f} mm in y"
                    ).replace("-0 mm", "0 mm")
                yield words, np.stack([sign_x * moved[0], sign_y * moved[1]]), there


def _nearest(nodes: Floats, places: Floats) -> Integers:
    """Return the nodes nearest to places, counted from 1; 0 or one more beyond the ends."""
    found = np.rint((places - nodes[0]) / (nodes[1] - nodes[0])).astype(np.intp) + 1
    return np.asarray(np.clip(found, 0, nodes.size + 1))


_SIGNS: Final = {
    "": (1.0, 1.0),
    "mirrored in x": (-1.0, 1.0),
    "mirrored in y": (1.0, -1.0),
    "turned by 180°": (-1.0, -1.0),
}
"""Factors of the axes."""


def _correlation(moved: Floats, want: Floats, known: Bools, enough: float) -> float:
    """Return the correlation of two flows where both are known; -1 where that is too little."""
    if np.count_nonzero(known) < enough:
        return -1.0
    one, other = moved[:, known], want[:, known]
    size = math.sqrt(float((one**2).sum() * (other**2).sum()))
    return float((one * other).sum()) / size if size > 0.0 else -1.0


def left_out_sentence(measured: MeasuredFlow, free: xr.Dataset) -> str:
    """Return what is said where the recording alone is explained: C_d, and how the flows differ."""
    found = best_placement(measured, free)
    drag = fitted_value(free, "drag_coefficient")
    low, high = free["interval"].sel(parameter="drag_coefficient").values
    how = "it is another flow than the one that moves the block"
    if found.correlation > PLACEMENT.agrees and found.words:
        how = (
            f"{found.words} it is the one that moves the block (correlation "
            f"{found.correlation:.2f})"
        )
    return (
        "the measured flow contradicts the motion: nothing contradicts the model without it, "
        f"with a C_d of {drag:.3g} ({low:.3g} to {high:.3g}); {how}"
    )
