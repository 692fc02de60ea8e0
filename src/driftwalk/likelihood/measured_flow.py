"""A measured flow as prior of the fitted one: vectors on a grid, with errors and a common scale.

The vectors are ``m = k B c + e``: the fitted flow B c at the nodes, times the scale k of the
measurement (a ruler or frame interval that is off), and independent normal errors e. The best k of
every c, with a weak normal prior around 1, is known in closed form; what is left is a sum of
squares of the coefficients alone. See docs/explanation/likelihood.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError, argument_text
from driftwalk.core.units import in_percent
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.parameters import Amplitudes
from driftwalk.likelihood.measured_series import amplitudes_in, compressed
from driftwalk.likelihood.spline import Spline, products
from driftwalk.schema import FLAGS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class MeasuredPolicy(NamedTuple):
    """How errors are estimated, and when a measured flow contradicts the recording."""

    fewest_surplus: int = 50
    """Components of vectors beyond those that the spline takes up, from which their scatter tells
    the errors: to a tenth. Chosen by hand."""
    level: float = 0.0005
    """Chance below which the measured flow and the motion contradict each other: that of a
    criterion of the check."""
    tolerated: float = 0.02
    """Difference of the flows, over the speed, that is no contradiction: what lies between the
    knots. Measured: the exact flow of the bundled recording is 1 % off its best spline at the
    wall."""


MEASURED: Final = MeasuredPolicy()
NAMES: Final = ("u", "v")


@dataclass(frozen=True, eq=False)
class MeasuredFlow:
    """Measured vectors, and their sums of products with the bases of the spline."""

    x: Floats
    y: Floats
    velocity: Floats
    """Shape (2 layers, y, x), the mean and the modes; NaN where nothing was measured."""
    error: Floats
    """Standard deviations, same shape, as the fit takes them."""
    spline: Spline
    scale_std: float
    """Of the prior of the scale; 0 if it is exact."""
    source: str
    errors: str
    """Where the errors are from, in words."""
    normal: Floats
    """``B' W B`` of every component, shape (2 layers, n, n)."""
    right: Floats
    """``B' W m``, shape (2 layers, n)."""
    own: Floats
    """Coefficients of the least squares, shape (2 layers, n); the smallest where they are not
    unique."""
    rank: int
    """Coefficients that the vectors determine."""
    amplitudes: Amplitudes | None = None
    """Those of the modes in time; None of a steady flow."""

    @property
    def layers(self) -> int:
        """The mean, and the modes in time."""
        return len(self.velocity) // 2

    @property
    def count(self) -> int:
        """Number of vectors."""
        return int(np.isfinite(self.velocity).all(axis=0).sum())

    @property
    def sentence(self) -> str:
        """The vectors and their errors, for the user."""
        size = float(np.sqrt(np.nanmean(self.error**2)))
        known = f"scale known to {self.scale_std:.2g}" if self.scale_std > 0.0 else "scale exact"
        said = f"{self.source}: {self.count} vectors, errors of {1e3 * size:.2g} mm/s {self.errors}"
        if self.amplitudes is not None:
            speed = np.sqrt(np.nanmean(self.velocity.reshape(self.layers, -1) ** 2, axis=1))
            shares = ", ".join(in_percent(one) for one in speed[1:] / speed[0])
            said += f"; it changes in time, in modes of {shares} of the mean"
        return f"{said}; {known}"

    def scale(self, coefficients: Floats, determined: float) -> tuple[float, float]:
        """Return the best scale k for a flow, and the precision of k.

        A flow that is k times smaller is k times more likely under its prior of smoothness, for
        each coefficient that the vectors determine, though its true size is unknown. The term
        ``determined ln k`` takes that out.
        """
        if self.scale_std == 0.0:
            return 1.0, math.inf
        flow, weight = coefficients.reshape(len(self.own), -1), 1.0 / self.scale_std**2
        power = float(np.einsum("ka,kab,kb->", flow, self.normal, flow)) + weight
        middle = 0.5 * (float((flow * self.right).sum()) + weight) / power
        k = middle + math.sqrt(max(middle**2 - determined / power, 0.0))
        return k, max(power - determined / k**2, weight)

    def deviance(self, coefficients: Floats, determined: float) -> tuple[float, Floats, Floats]:
        """Return half the sum of squares, its negative gradient, and its curvature.

        The best k is a function of the coefficients, so their curvature is that with k projected
        out. The least squares' own sum, which no flow changes, is left out.
        """
        flow = coefficients.reshape(len(self.own), -1)
        k, precision = self.scale(coefficients, determined)
        off = self.own - k * flow
        pull = np.einsum("kab,kb->ka", self.normal, off)
        value = 0.5 * float((off * pull).sum()) + determined * math.log(k)
        if self.scale_std > 0.0:
            value += 0.5 * ((k - 1.0) / self.scale_std) ** 2
        # As k goes with the inverse of the flow's size, ``determined ln k`` bends upwards along it.
        bent = self.curvature(flow, k, precision + 2.0 * determined / k**2)
        return value, k * pull.ravel(), bent

    def determined(self, coefficients: Floats, covariance: Floats, before: float) -> float:
        """Return how many coefficients the vectors determine, of a flow with a covariance."""
        if self.scale_std == 0.0:
            return 0.0
        _, _, curvature = self.deviance(coefficients, before)
        size = len(curvature)
        return min(float((curvature * covariance[:size, :size]).sum()), float(self.rank))

    def curvature(self, flow: Floats, k: float, precision: float) -> Floats:
        """Return the curvature at a flow (2 layers, n) and a scale that is known to a precision."""
        size = self.spline.size
        found = np.zeros((flow.size, flow.size))
        for component in range(len(flow)):
            part = slice(component * size, (component + 1) * size)
            found[part, part] = k**2 * self.normal[component]
        along = np.einsum("kab,kb->ka", self.normal, flow).ravel()
        return np.asarray(found - (k**2 / precision) * np.outer(along, along))

    def stored(self) -> tuple[dict[str, Any], dict[str, str]]:
        """Return the variables and attributes with which a fit holds it."""
        on = ("measured_y", "measured_x")
        data: dict[str, Any] = {"measured_y": (on[0], self.y), "measured_x": (on[1], self.x)}
        words = {"measured_flow": self.source, "measured_flow_errors": self.errors}
        for end, values in (("", self.velocity), ("_error", self.error)):
            for k, name in enumerate(NAMES):
                data[f"measured_{name}{end}"] = (on, values[k])
                if self.amplitudes is not None:
                    data[f"measured_{name}_mode{end}"] = (("flow_mode", *on), values[k + 2 :: 2])
        if self.amplitudes is not None:
            words["mode_repeat"] = self.amplitudes.repeat
        return data, words


def measured_flow(
    field: xr.Dataset,
    study: Study,
    spline: Spline,
    *,
    sources: tuple[str, ...] = (),
    duration: float = 0.0,
) -> MeasuredFlow:
    """Return a flow field as prior of the fit; refuse one that is no measurement.

    `sources` are those of the recordings: a flow that was taken from one of them is none. The
    frames of a flow that changes in time have to cover the `duration` of the recording [s].
    """
    _require_measurement(field, study, sources)
    field = compressed(field, study, duration=duration)
    amplitudes = amplitudes_in(field)
    x, y = (field[axis].values.astype(np.float64) for axis in "xy")
    at_x, at_y = (axis.ravel() for axis in np.meshgrid(x, y))
    inside = outline_of(study.tank.to_arena()).depth(at_x, at_y).reshape(y.size, x.size) >= 0.0
    there = inside & (field["flag"].values == FLAGS["measured"])
    velocity = np.where(there, _layers(field, "{}", "{}_mode"), np.nan)
    stated = study.fit.flow_error_m_s
    error, words = None, ""
    if stated != "auto":
        error, words = np.where(there, np.full_like(velocity, stated), np.nan), "as stated"
    elif all(f"{name}_standard_error" in field for name in NAMES):
        found = _layers(field, "{}_standard_error", "{}_mode_error")
        known = there & np.isfinite(found).all(axis=0) & (found > 0.0).all(axis=0)
        if known.any():
            there = known
            error = np.where(there, found, np.nan)
            velocity = np.where(there, velocity, np.nan)
            words = str(field.attrs.get("errors", "from the file"))
    if not there.any():
        raise InputError(
            "no vector of the measured flow lies in the tank: is its origin the centre of the "
            "tank, and its scale right?"
        )
    unit = np.where(there, np.ones_like(velocity), np.nan)
    taken = unit if error is None else error
    solved = [
        _least_squares(spline, x, y, velocity[k : k + 2], taken[k : k + 2])
        for k in range(0, len(velocity), 2)
    ]
    surplus = 2 * int(there.sum()) - max(one.rank for one in solved)
    if error is None and surplus < MEASURED.fewest_surplus:
        raise InputError(
            f"the measured flow has {int(there.sum())} vectors in the tank, too few to tell their "
            f"errors from their scatter: state them with {argument_text('flow_error', '2mm/s')}"
        )
    factors = [1.0] * len(solved)
    if surplus >= MEASURED.fewest_surplus:
        factors = [math.sqrt(one.squares / surplus) for one in solved]
    if error is None:
        error, words = factors[0] * unit, "estimated from their scatter around smooth flow"
    else:
        # The flow has details that the knots are too far apart for; the fit cannot follow them.
        factors = [one if one > 1.001 else 1.0 for one in factors]
        error = np.repeat(factors, 2)[:, None, None] * error
        if max(factors) > 1.0:
            words += f", times {max(factors):.2g} as they scatter more around smooth flow"
    sizes = [one if one > 0.0 else 1.0 for one in factors]
    normal, right = (
        np.concatenate([one[k] / size**2 for one, size in zip(solved, sizes, strict=True)])
        for k in (0, 1)
    )
    return MeasuredFlow(
        x, y, velocity, error, spline, study.fit.flow_scale_std,
        str(field.attrs.get("source", "flow")), words, normal, right,
        np.concatenate([one.own for one in solved]), sum(one.rank for one in solved), amplitudes,
    )  # fmt: skip


def _layers(field: xr.Dataset, mean: str, mode: str) -> Floats:
    """Return variables of the mean and of the modes, u and v in turn, shape (2 layers, y, x)."""
    found = np.stack([field[mean.format(name)].values for name in NAMES])
    if "amplitude" not in field:
        return found
    modes = np.stack([field[mode.format(name)].values for name in NAMES], axis=1)
    return np.concatenate([found, modes.reshape(-1, *found.shape[1:])])


def _require_measurement(field: xr.Dataset, study: Study, sources: tuple[str, ...]) -> None:
    if study.fit.switching_times_s:
        raise InputError(
            "a measured flow holds for one setting of the pumps: fit each interval between the "
            f"switching times separately, with its own flow ({argument_text('flow', 'FILE')})"
        )
    method, source = (str(field.attrs.get(name, "")) for name in ("method", "source"))
    if "likelihood" in method:
        raise InputError(
            "the flow was fitted to a recording and is no measurement of the water: fit both "
            "recordings together (driftwalk fit FIRST SECOND)"
        )
    if method != "file" and source and source in sources:
        raise InputError(
            f"the flow was taken from the recording itself ({source}), which would count twice: "
            "leave it out, or give one that was measured by other means"
        )


class _Solved(NamedTuple):
    normal: Floats
    right: Floats
    own: Floats
    rank: int
    squares: float


def _least_squares(
    spline: Spline, x: Floats, y: Floats, velocity: Floats, error: Floats
) -> _Solved:
    """Return the sums of products, and the spline that fits the vectors best."""
    along_x, along_y = spline.design(x, y)
    weight = np.where(np.isfinite(error), 1.0 / np.where(error > 0.0, error, np.inf) ** 2, 0.0)
    values = np.where(weight > 0.0, velocity, 0.0)
    normal = np.stack([products(one, along_x, along_y) for one in weight])
    pairs = zip(weight, values, strict=True)
    right = np.stack([(along_y.T @ (one * value) @ along_x).ravel() for one, value in pairs])
    own, rank, squares = np.zeros_like(right), 0, 0.0
    for k in range(2):
        spread, base = np.linalg.eigh(normal[k])
        known = spread > 1e-9 * spread[-1]
        own[k] = (base[:, known] / spread[known]) @ (base[:, known].T @ right[k])
        rank += int(known.sum())
        off = values[k] - along_y @ own[k].reshape(spline.rows, spline.columns) @ along_x.T
        squares += float((weight[k] * off**2).sum())
    return _Solved(normal, right, own, rank, squares)
