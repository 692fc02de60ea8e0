"""A block that a camera films at 100 Hz, with a leap and a contact; made up, and no simulation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from fit_worlds import coarse_study

from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import series_of
from driftwalk.likelihood.spline import lay_spline
from driftwalk.schema import Track

SAMPLES, LEAP, CONTACT = 300, 120, 200


def filmed_fast() -> Passes:
    """Return passes over three seconds of a bent path."""
    study = coarse_study()
    time = 0.01 * np.arange(SAMPLES)
    noise = np.random.default_rng(1)
    x = 0.06 * np.cos(0.9 * time) + 2e-4 * noise.normal(size=SAMPLES)
    y = 0.06 * np.sin(0.7 * time) + 2e-4 * noise.normal(size=SAMPLES)
    x[LEAP] += 0.03
    theta = 0.8 * time + 8e-3 * noise.normal(size=SAMPLES)
    (series,) = series_of([Track(time, x, y, theta)], study, "state")
    excluded = series.excluded.copy()
    excluded[CONTACT] = 1
    spline = lay_spline(outline_of(study.tank.to_arena()), side=0.03, spacing=0.05)
    return Passes([replace(series, excluded=excluded)], Body(study, "state"), spline)


def point_of(passes: Passes) -> Point:
    """Return a point with a flow that is drawn at random."""
    flow = np.random.default_rng(2).normal(
        0.0, 0.02, (2, passes.spline.rows, passes.spline.columns)
    )
    return Point(
        flow, math.log(0.5), math.log(2e-3), math.log(2.5e-4), math.log(3e-3), math.log(0.01)
    )
