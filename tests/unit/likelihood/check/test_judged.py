"""What a judged fit says of a block that stays in one place, and of an angle counted clockwise."""

from __future__ import annotations

import numpy as np
import pytest
from euler_blocks import DEPTH_M, FORCE_INTERVAL_S, MASS_KG, SIDE_M, euler_recordings
from fit_worlds import coarse_study, recording

import driftwalk as dw
from driftwalk.likelihood import judge_fit
from driftwalk.likelihood.check import run
from driftwalk.model import apply_overrides

SEEN = "the block seems to turn against the water"


def sink(x: np.ndarray, y: np.ndarray, _: float) -> tuple[np.ndarray, np.ndarray]:
    return -0.6 * (x - 0.03), -0.6 * (y + 0.02)


@pytest.mark.slow
def test_a_block_in_a_sink_tells_nothing_of_the_flow() -> None:
    (track,) = euler_recordings(
        sink, worlds=1, seconds=200.0, seed=3, start=(0.03, -0.02), force_N=0.3e-3
    )
    study = apply_overrides(
        coarse_study(),
        {
            "block.side_m": SIDE_M,
            "block.mass_kg": MASS_KG,
            "block.depth_m": DEPTH_M,
            "forces.force_interval_s": FORCE_INTERVAL_S,
        },
    )
    found = judge_fit(dw.fit_motion(track, study), [track])
    assert found.check is not None
    assert found.check["verdict"] == "cannot tell"
    said = " ".join(found.check["verdict_reason"].values)
    assert "times its own area" in said
    assert "record it on a wider path" in said


@pytest.mark.slow
def test_an_angle_counted_clockwise_is_advised_to_be_negated() -> None:
    track = recording(200.0)
    track["theta"] = -track["theta"]
    found = judge_fit(dw.fit_motion(track, coarse_study()), [track])
    reasons = found.fit["verdict_reason"].values
    (warning,) = (text for text in reasons if text.startswith(SEEN))
    assert warning.endswith("negate the angle, or turn y upwards")
    assert "with the angle negated the model explains the recording, C_d is 0.39" in warning
    assert found.fit["verdict"] != "explains"
    assert warning not in found.fit["warning"].values


@pytest.mark.slow
def test_advice_that_does_not_help_is_not_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """The angle is right, and a chance correlation says otherwise."""
    track = recording(120.0)
    fit = dw.fit_motion(track, coarse_study())
    facts = {"spin_correlation": -0.5}
    warning = run.against_water(facts)
    fit = fit.assign(spin_correlation=((), -0.5)).assign_coords(warning=("warning", [warning]))
    found = judge_fit(fit, [track])
    (said,) = found.fit["warning"].values
    assert said == f"{warning}; the fit was repeated with the angle negated, and that is no better"
    assert found.fit["verdict"] == "explains"
