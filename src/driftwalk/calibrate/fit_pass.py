"""One pass of the innovations filter over the recordings: likelihood, score and information.

The filter predicts each position from the past. Its innovations e_k are independent normals with
covariances S_k if the parameters are right, so twice the negative log likelihood is the sum of
``ln det S_k + e_k' S_k^-1 e_k``. The parameters are, in this order, the flow's coefficients,
ln C_d, ln q (intensity of the stochastic acceleration) and ln r (tracking noise). For the first two
the filter itself gives the derivatives of its predictions; for the other two it is run again with
slightly larger values, and the derivatives of S_k enter as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.calibrate.fit_spline import Floats, Spline

Flags = npt.NDArray[np.bool_]

LARGEST_STEP_S = 0.05
"""Longest step of the filter's integrator."""
LONGEST_GAP_S = 1.0
"""Longest gap that is predicted over; after a longer one the motion is found anew."""
SAMPLES_AT_ONCE = 2048
"""Rows of derivatives that are held at a time: some 20 MB."""
STEP = 1e-4
"""Relative change of q and r for their derivatives."""


@dataclass(frozen=True, eq=False)
class Series:
    """One track as the filter takes it, shapes (n,)."""

    time: Floats
    x: Floats
    y: Floats
    theta: Floats
    omega: Floats
    excluded: npt.NDArray[np.uint8]
    """Samples that end an interval which is left out."""


@dataclass(frozen=True)
class Body:
    """The block and the water."""

    side: float
    mass: float
    depth: float
    strips: int
    water_density: float
    orientation: str
    """"given" or "none": whether the track's angle turns the block's faces."""


@dataclass(frozen=True, eq=False)
class Point:
    """Values of everything that is estimated."""

    coefficients: Floats
    """Of the flow, shape (2, rows, columns) [m/s]."""
    log_drag: float
    """ln C_d."""
    log_intensity: float
    """ln q, q in m^2/s^3."""
    log_noise: float
    """ln r, r in m."""

    def moved(self, step: Floats) -> Point:
        """Return the point after a step in (coefficients, ln C_d, ln q, ln r)."""
        return Point(
            self.coefficients + step[:-3].reshape(self.coefficients.shape),
            self.log_drag + float(step[-3]),
            self.log_intensity + float(step[-2]),
            self.log_noise + float(step[-1]),
        )


class Sums(NamedTuple):
    """What a pass adds up over all samples."""

    deviance: float
    """Negative log likelihood, without its constant."""
    score: Floats
    """Its derivatives, with the sign turned."""
    information: Floats
    """Expected second derivatives."""
    used: int
    """Samples whose innovations were used."""


@dataclass(frozen=True, eq=False)
class Passes:
    """Runs the filter over the recordings of one tank.

    Attributes
    ----------
    series : sequence of Series
        The recordings.
    body : Body
        The block.
    spline : Spline
        Knots of the flow.
    """

    series: Sequence[Series]
    body: Body
    spline: Spline

    def sums(self, point: Point, *, noise: str = "with") -> Sums:
        """Return likelihood, score and information at a point.

        Parameters
        ----------
        point : Point
            Where.
        noise : {"with", "without"}
            Whether the last two parameters, ln q and ln r, have derivatives; without them score
            and information end with ln C_d.
        """
        size = 2 * self.spline.size + (3 if noise == "with" else 1)
        deviance, used = 0.0, 0
        score, information = np.zeros(size), np.zeros((size, size))
        for series in self.series:
            filters = [self._filter(series, point, sensitivities=True)]
            if noise == "with":
                more = replace(point, log_intensity=point.log_intensity + STEP)
                filters.append(self._filter(series, more))
                more = replace(point, log_noise=point.log_noise + STEP)
                filters.append(self._filter(series, more))
            for start in range(0, series.time.size, SAMPLES_AT_ONCE):
                count = min(SAMPLES_AT_ONCE, series.time.size - start)
                found = [one.run(count) for one in filters]
                part = _part(found)
                deviance += part.deviance
                score += part.score
                information += part.information
                used += part.used
        return Sums(deviance, score, information, used)

    def innovations(self, point: Point) -> list[tuple[Floats, Flags]]:
        """Return each recording's whitened innovations, shape (n, 2), and which were used."""
        found = [self._filter(series, point).run(series.time.size) for series in self.series]
        return [(_whiten(one["innovation"], one["covariance"]), _used(one)) for one in found]

    def _filter(self, series: Series, point: Point, *, sensitivities: bool = False) -> Any:
        body, spline = self.body, self.spline
        return _core.InnovationsFilter(
            series.time,
            series.x,
            series.y,
            series.theta,
            series.omega,
            series.excluded,
            side=body.side,
            mass=body.mass,
            depth=body.depth,
            strips=body.strips,
            water_density=body.water_density,
            origin_x=spline.origin_x,
            origin_y=spline.origin_y,
            spacing=spline.spacing,
            columns=spline.columns,
            rows=spline.rows,
            coefficients=np.ascontiguousarray(point.coefficients),
            drag_coefficient=math.exp(point.log_drag),
            noise_intensity=math.exp(point.log_intensity),
            position_noise=math.exp(point.log_noise),
            largest_step=LARGEST_STEP_S,
            longest_gap=LONGEST_GAP_S,
            orientation=body.orientation,
            sensitivities=sensitivities,
        )


def _used(found: dict[str, Any]) -> Flags:
    return np.asarray(found["used"], dtype=bool)


def _part(found: list[dict[str, Any]]) -> Sums:
    """Add up one range of samples; the first filter is the one at the point itself."""
    base = found[0]
    used = np.logical_and.reduce([_used(one) for one in found])
    covariance = base["covariance"][used]
    white = np.asarray(base["whitened"]).reshape(-1, 2)[used]
    determinant = covariance[:, 0] * covariance[:, 2] - covariance[:, 1] ** 2
    deviance = 0.5 * float(np.log(determinant).sum() + (white**2).sum())
    rows = np.repeat(used, 2)
    # Rows of samples that are not used are zero already, unless another filter left them out.
    jacobian = (
        base["jacobian"] if used.sum() == _used(base).sum() else base["jacobian"] * rows[:, None]
    )
    size = jacobian.shape[1] + len(found) - 1
    information, score = np.zeros((size, size)), np.zeros(size)
    information[: jacobian.shape[1], : jacobian.shape[1]] = jacobian.T @ jacobian
    score[: jacobian.shape[1]] = jacobian.T @ np.asarray(base["whitened"])
    if len(found) > 1:
        _add_noise(found, used, white, information, score)
    return Sums(deviance, score, information, int(used.sum()))


def _add_noise(
    found: list[dict[str, Any]], used: Flags, white: Floats, information: Floats, score: Floats
) -> None:
    """Fill in the last rows and columns: the derivatives by ln q and ln r."""
    base = found[0]
    covariance = base["covariance"][used]
    changes, spreads = [], []
    for other in found[1:]:
        change = (base["innovation"][used] - other["innovation"][used]) / STEP
        changes.append(_whiten(change, covariance).ravel())
        spreads.append(_spread((other["covariance"][used] - covariance) / STEP, covariance))
    columns = np.stack(changes, axis=1)
    first = -len(changes)
    cross = base["jacobian"][np.repeat(used, 2)].T @ columns
    information[:first, first:], information[first:, :first] = cross, cross.T
    # tr(AB) of symmetric 2x2 matrices, stored as xx, xy, yy.
    traces = np.einsum("akc,bkc,c->ab", spreads, spreads, [1.0, 2.0, 1.0])
    information[first:, first:] = columns.T @ columns + 0.5 * traces
    excess = [(_quadratic(one, white) - one[:, 0] - one[:, 2]).sum() for one in spreads]
    score[first:] = columns.T @ white.ravel() + 0.5 * np.array(excess)


def _whiten(innovation: Floats, covariance: Floats) -> Floats:
    """Return L^-1 e with L L' = S, rows (xx, xy, yy) of S; shape (n, 2)."""
    first = np.sqrt(covariance[:, 0])
    lean = covariance[:, 1] / first
    second = np.sqrt(covariance[:, 2] - lean**2)
    along = innovation[:, 0] / first
    return np.column_stack([along, (innovation[:, 1] - lean * along) / second])


def _spread(change: Floats, covariance: Floats) -> Floats:
    """Return L^-1 dS L^-T as rows (xx, xy, yy)."""
    first = np.sqrt(covariance[:, 0])
    lean = covariance[:, 1] / covariance[:, 0]
    second = np.sqrt(covariance[:, 2] - lean * covariance[:, 1])
    cross = change[:, 1] - lean * change[:, 0]
    return np.column_stack(
        [
            change[:, 0] / covariance[:, 0],
            cross / (first * second),
            (change[:, 2] - lean * change[:, 1] - lean * cross) / second**2,
        ]
    )


def _quadratic(matrix: Floats, vector: Floats) -> Floats:
    return np.asarray(
        matrix[:, 0] * vector[:, 0] ** 2
        + 2.0 * matrix[:, 1] * vector[:, 0] * vector[:, 1]
        + matrix[:, 2] * vector[:, 1] ** 2
    )
