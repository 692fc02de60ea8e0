"""The parameter vector of the fit: flow, ln C_d, noises, and numbers of departures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from driftwalk.likelihood.filter.departures import NUMBERS
from driftwalk.likelihood.spline import Floats


@dataclass(frozen=True, eq=False)
class Point:
    """Values of everything that is estimated."""

    coefficients: Floats
    """Of the flow, shape (2, rows, columns) [m/s]; (flows, 2, rows, columns) with several flows."""
    log_drag: float
    """ln C_d."""
    log_intensity: float
    """ln q, q in m^2/s^3."""
    log_noise: float
    """ln r, r in m."""
    log_lever: float | None = None
    """Logarithm of the rms distance [m] from the centre at which the stochastic force acts; with
    the angle in the state only."""
    log_angle_noise: float | None = None
    """Logarithm of the noise of the angle [rad]; with the angle in the state only."""
    opened: Mapping[str, float] = field(default_factory=dict)
    """Numbers of departures from the model that are estimated too (`NUMBERS`)."""
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Those that have a known value other than the model's."""

    @property
    def noises(self) -> dict[str, float]:
        """Names and values of the noises, in the order of the parameters."""
        names = ("log_intensity", "log_noise", "log_lever", "log_angle_noise")
        found = {name: getattr(self, name) for name in names}
        return {name: value for name, value in found.items() if value is not None}

    @property
    def extras(self) -> dict[str, float]:
        """Names and values of everything but coefficients and ln C_d, in the parameters' order."""
        return {**self.noises, **self.opened}

    def number(self, name: str) -> float:
        """Return a number of a departure; the model's where it is neither opened nor fixed."""
        return self.opened.get(name, self.fixed.get(name, NUMBERS[name].model))

    def with_extra(self, name: str, value: float) -> Point:
        """Return the point with another value of a noise or of a number."""
        if name in NUMBERS:
            return replace(self, opened={**self.opened, name: value})
        changed: dict[str, Any] = {name: value}
        return replace(self, **changed)

    def in_flow(self, flow: int) -> Point:
        """Return the point with the coefficients of one flow alone."""
        if self.coefficients.ndim == 3:
            return self
        return replace(self, coefficients=self.coefficients[flow])

    def moved(self, step: Floats) -> Point:
        """Return the point after a step in (coefficients, ln C_d, noises, numbers)."""
        size = self.coefficients.size
        moved = replace(
            self,
            coefficients=self.coefficients + step[:size].reshape(self.coefficients.shape),
            log_drag=self.log_drag + float(step[size]),
        )
        for (name, old), change in zip(self.extras.items(), step[size + 1 :], strict=True):
            value = old + float(change)
            if name in NUMBERS:
                value = min(max(value, NUMBERS[name].low), NUMBERS[name].high)
            moved = moved.with_extra(name, value)
        return moved
