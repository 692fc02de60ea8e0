"""How good the likelihood fit has to be on the bundled recordings, made by another engine."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from fit_worlds import DRAG, FORCE_N, NOISE_M, TRUTH

import driftwalk as dw
from driftwalk.flow import bilinear
from driftwalk.schema.answers.facts import facts_of


def block_mean(flow: xr.Dataset, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the flow averaged over a block of 3 cm, at four angles, at some places."""
    offsets = (np.arange(6) + 0.5) / 6 * 0.03 - 0.015
    along, across = (part.ravel() for part in np.meshgrid(offsets, offsets))
    angles = np.arange(4)[:, None] * np.pi / 8
    dx = (np.cos(angles) * along - np.sin(angles) * across).ravel()
    dy = (np.sin(angles) * along + np.cos(angles) * across).ravel()
    found = bilinear(flow, (x[:, None] + dx).ravel(), (y[:, None] + dy).ravel())
    return np.asarray(found).reshape(x.size, dx.size, 2).mean(axis=1)


def visited(recording: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the 6-mm cells with three samples or more that no corner could have at the wall."""
    x, y = (recording[name].values[:, 0] for name in ("x", "y"))
    free = np.hypot(x, y) < TRUTH["tank_radius_m"] - 0.03 / np.sqrt(2.0) - 0.002
    edges = np.linspace(-0.15, 0.15, 51)
    count, _, _ = np.histogram2d(y[free], x[free], bins=(edges, edges))
    rows, columns = np.nonzero(count >= 3)
    centres = (edges[1:] + edges[:-1]) / 2
    return centres[columns], centres[rows]


@pytest.mark.study
@pytest.mark.parametrize(
    ("realisation", "angle", "most_drag", "most_flow"),
    [
        ("first", "state", 0.05, 0.02),
        ("second", "given", 0.1, 0.04),
    ],
)
def test_half_an_hour_of_the_bundled_recording(
    realisation: str, angle: str, most_drag: float, most_flow: float
) -> None:
    """Measured: C_d +2 and +3 %, flow 0.6 and 0.7 % with the angle in the state, else -3 and 3 %.

    The engine's explicit drag acts as 2 % more C_d than was set. The README's example fits the same
    recording in every run.
    """
    recording = dw.tank30_recording(realisation)
    study = dw.apply_overrides(dw.Study(), {"forces.force_interval_s": TRUTH["force_interval_s"]})
    fit = dw.fit_motion(recording, study, angle=angle)
    assert facts_of(fit)["drag_coefficient"] == pytest.approx(DRAG, rel=most_drag)
    assert facts_of(fit)["force_std_N"] == pytest.approx(FORCE_N, rel=0.03)
    assert facts_of(fit)["tracking_noise_m"] == pytest.approx(NOISE_M, rel=0.03)
    assert facts_of(fit)["iterations"] <= 12
    assert fit.attrs.get("angle_disagreement_std", 0.0) < 3.0
    x, y = visited(recording)
    assert x.size > 300
    flow, truth = (block_mean(one, x, y) for one in (dw.fitted_flow(fit), dw.tank30_flow()))
    error = np.sqrt(((flow - truth) ** 2).sum() / (truth**2).sum())
    assert error <= most_flow
