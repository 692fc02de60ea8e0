"""The steps of the recording that a run is compared with, as its finished calibration has them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.comparison import apply_steps, joint_density, plan_steps
from driftwalk.conditions.recorded import sample_times
from driftwalk.schema import body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Floats = npt.NDArray[np.float64]


class LiveStepsPolicy(NamedTuple):
    """The histograms of a recording's steps on a live page, with the bins of a calibration."""

    bins: int = 32
    """Chosen by hand."""
    excerpt_s: float = 30.0
    """Of the path that is drawn; chosen by hand."""
    length_share: float = 0.999
    """Share of the step lengths that the bins hold before they reach further; chosen by hand."""
    length_reach: float = 1.5
    """How much further, as a factor; chosen by hand."""
    angle_share: float = 0.98
    """The same of turning angles; chosen by hand."""
    angle_reach: float = 2.5
    """The same of turning angles; chosen by hand."""


LIVE_STEPS: Final = LiveStepsPolicy()


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

    def density(self, points: Floats | None = None) -> Floats:
        """Return the share of steps in every bin: of the recording, or of others."""
        length, angle = (self.points if points is None else points).T
        return joint_density(
            length, angle, step_length_edge=self.length_edge, turning_angle_edge=self.angle_edge
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
        Its [steps] says how steps are formed.
    body : str, optional
        The body, where the recording has several.

    Raises
    ------
    InputError
        When no steps can be formed.
    """
    track = body_track(recording, body)
    time = track.time - track.time[0]
    interval = study.steps.step_interval_s
    plan = plan_steps(time, step_interval=None if interval == "auto" else float(interval))
    found = apply_steps(plan, track.x, track.y)
    points = np.column_stack([found.step_length, found.turning_angle])
    length_limit = LIVE_STEPS.length_reach * float(
        np.quantile(points[:, 0], LIVE_STEPS.length_share)
    )
    angle_limit = LIVE_STEPS.angle_reach * float(
        np.quantile(np.abs(points[:, 1]), LIVE_STEPS.angle_share)
    )
    angle_limit = min(np.pi, angle_limit) or np.pi
    # The samples of the worlds, which need not have the recording's gaps.
    sampled = sample_times(track, study)
    return RecordedSteps(
        name=str(recording.attrs.get("source", "recording")),
        step_interval=plan.step_interval,
        points=points,
        length_edge=np.linspace(0.0, length_limit or 1.0, LIVE_STEPS.bins + 1),
        angle_edge=np.linspace(-angle_limit, angle_limit, LIVE_STEPS.bins + 1),
        excerpt_time=sampled[sampled <= LIVE_STEPS.excerpt_s],
    )
