"""What the command line's tracker does hangs on the picture, not on the metres."""

from __future__ import annotations

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.recordings.tracking_parts import tracker_for
from driftwalk.track.types import Detection

FRAMES = 400


def jerky_path() -> np.ndarray:
    """Return a path [px] that stops and starts at once, as animals do; synthetic."""
    random = np.random.default_rng(5)
    moves = np.repeat(random.random(FRAMES // 10) < 0.4, 10)
    angle = np.repeat(random.uniform(-np.pi, np.pi, FRAMES // 10), 10)
    step = 6.0 * moves[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.cumsum(step, axis=0) % 300 + random.normal(0, 0.3, (FRAMES, 2))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("px_per_m", [20.0, 500.0, 1500.0, 50_000.0])
def test_what_is_kept_does_not_depend_on_the_scale(px_per_m: float) -> None:
    """A body that starts and turns at once, alone in the picture, loses no sample at any scale."""
    options = TrackingOptions(source="video", markers="blob", scale=1 / px_per_m, bodies=1)
    camera = dw.track.Camera.from_scale(640, 480, px_per_m=px_per_m)
    tracker = tracker_for(options, camera, None)
    spread = np.diag([0.1, 0.1, np.nan]) / px_per_m**2
    for frame, (column, row) in enumerate(np.unwrap(jerky_path(), period=300, axis=0)):
        x, y = column / px_per_m, row / px_per_m
        tracker.step(frame / 30.0, [Detection(x, y, column, row, np.nan, spread, 700.0, score=1.0)])
    found = tracker.finish()
    assert np.isfinite(found["x"].values).mean() == 1.0
    assert not found["ambiguous"].values.any()
