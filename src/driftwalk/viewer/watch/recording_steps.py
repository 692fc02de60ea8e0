"""The steps of the recording that a run is compared with, as its finished calibration has them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from driftwalk.comparison import StepDistance, joint_density
from driftwalk.comparison.statistic import BINS
from driftwalk.conditions.recorded import sample_times
from driftwalk.core.arrays import Floats
from driftwalk.schema import body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class RecordedSteps(NamedTuple):
    """A recording's steps, and the bins of step length and turning angle."""

    name: str
    """Where it is from."""
    step_interval: float
    """Time between the points of a step [s]."""
    points: Floats
    """Step lengths [m] and turning angles [rad], (pairs, 2)."""
    length_edge: Floats
    """[m]"""
    angle_edge: Floats
    """[rad]"""
    excerpt_time: Floats
    """Times [s] of a world's first half minute, from its first sample on."""

    def density(self) -> Floats:
        """Return the share of the recording's steps in every bin."""
        return joint_density(
            *self.points.T, step_length_edge=self.length_edge, turning_angle_edge=self.angle_edge
        )


def recorded_steps(
    recording: xr.Dataset, study: Study, *, body: str | None = None
) -> RecordedSteps:
    """Return the steps of a recording.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        For the interval of steps, and whether simulations take over the recording's gaps.
    body : str, optional
        The body, where there are several.

    Raises
    ------
    InputError
        When there are several bodies and none is named, or it forms fewer than 30 pairs of steps.
    """
    track = body_track(recording, body)
    interval = study.steps.step_interval_s
    found = StepDistance().prepare(
        track, step_interval=None if interval == "auto" else float(interval)
    )
    # The samples of the worlds, which need not have the recording's gaps.
    sampled = sample_times(track, study)
    return RecordedSteps(
        name=str(recording.attrs.get("source", "recording")),
        step_interval=found.plan.step_interval,
        points=found.steps,
        length_edge=np.linspace(0.0, found.length_limit or 1.0, BINS + 1),
        angle_edge=np.linspace(-found.angle_limit, found.angle_limit, BINS + 1),
        # As the excerpts of a calibration.
        excerpt_time=sampled[sampled <= 30.0],
    )
