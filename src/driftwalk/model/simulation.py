"""Settings of a simulation: time step, length, sampling, start, seed."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import field_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import Quantity, Section, Seed


class Pose(Section):
    """A pose: position [m] and orientation [rad] in the frame of the tank's centre."""

    section_name: ClassVar[str] = "simulation.start"

    x_m: Annotated[float, Quantity("m")] = 0.0
    """Position x."""
    y_m: Annotated[float, Quantity("m")] = 0.0
    """Position y."""
    theta_rad: Annotated[float, Quantity("rad")] = 0.0
    """Orientation, counter-clockwise from x."""


class Simulation(Section):
    """Settings of a simulation: time step, length, sampling, start, seed."""

    section_name: ClassVar[str] = "simulation"

    time_step_s: Annotated[float | Literal["auto"], Quantity("s", gt=0, le=0.1)] = "auto"
    """Time step; divides the force interval.

    Time step of the integrator; "auto" is the largest whole divisor of force_interval_s up to 10
    ms. A step that does not divide the interval is an error.
    """
    duration_s: Annotated[float, Quantity("s", gt=0, le=1e7)] = 1800.0
    """Length of a simulated trajectory."""
    sample_rate_Hz: Annotated[float, Quantity("Hz", gt=0, le=1e5)] = 10.0
    """Sampling rate of a simulation without a recording's time stamps."""
    replicates: Annotated[int, Quantity("1", ge=1, le=10_000_000, whole=True)] = 1
    """Trajectories with the same parameters and different random numbers."""
    seed: Seed = 1
    """Seed of the random numbers; the same seed gives the same bits."""
    start: Literal["random"] | Pose = "random"
    """First pose: "random", anywhere in the tank, or a pose such as { x_m = 0.0, y_m = 0.0,
    theta_rad = 0.0 }. The block starts at rest."""

    @field_validator("start", mode="before")
    @classmethod
    def _pose_or_word(cls, start: Any) -> Any:
        if isinstance(start, str) and start != "random":
            raise ConfigurationError(f'expected "random" or a pose, got {start!r}')
        return Pose(**start) if isinstance(start, dict) else start


def resolve_time_step(time_step_s: float | Literal["auto"], *, force_interval_s: float) -> float:
    """Return the integrator's time step [s].

    Parameters
    ----------
    time_step_s : float or "auto"
        A step that divides the force interval, or "auto": the largest whole divisor of the
        interval that is not above 10 ms (16 ms gives 8 ms).
    force_interval_s : float
        How long one draw of the stochastic force lasts [s].

    Raises
    ------
    ConfigurationError
        When a step that was named does not divide the interval.

    Examples
    --------
    >>> resolve_time_step("auto", force_interval_s=0.016)
    0.008
    """
    if time_step_s == "auto":
        # The margin keeps an interval such as 0.03, which is not a binary fraction, at three steps.
        parts = max(1, math.ceil(force_interval_s / 0.010 - 1e-9))
        return force_interval_s / parts
    ratio = force_interval_s / time_step_s
    parts = round(ratio)
    if parts < 1 or abs(ratio - parts) > 1e-6 * ratio:
        raise ConfigurationError(
            f"time_step_s = {time_step_s:g} does not divide force_interval_s = "
            f"{force_interval_s:g}: {ratio:.6g} steps in an interval; use a whole divisor or "
            '"auto" (`simulation.time_step_s="auto"`)'
        )
    return force_interval_s / parts
