"""One pass of the innovations filter over the recordings: likelihood, score and information.

The filter predicts each position from the past. Its innovations e_k are independent normals with
covariances S_k if the parameters are right, so twice the negative log likelihood is the sum of
``ln det S_k + e_k' S_k^-1 e_k``. The parameters are, in this order, the flow's coefficients,
ln C_d, and the noises: ln q (intensity of the stochastic acceleration), ln r (tracking noise) and,
where the angle is a part of the state, the logarithms of the force's lever and of the angle's
noise. For the first two the filter itself adds up the products of the derivatives of its
predictions; for the noises it is run again with slightly larger values, and the derivatives of S_k
enter as well. Where the pumps were switched each flow has coefficients of its own; a series is in
one flow and adds to the block of that flow alone, and to the parameters that all share.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.likelihood.law.departures import NUMBERS, STRENGTH_TERMS, STRENGTHS
from driftwalk.likelihood.spline import Floats, Spline

Flags = npt.NDArray[np.bool_]
Place = tuple[slice, slice]

LARGEST_STEP_S = 0.05
"""Longest step of the filter's integrator."""
LONGEST_GAP_S = 1.0
"""Longest gap that is predicted over; after a longer one the filter restarts."""
SETTLING_SAMPLES = 3
"""After the first one of a stretch, until the filter knows the velocity."""
STEP = 1e-4
"""Relative change of a noise for the derivatives by it."""
MOST_CHANGE = 100 * STEP
"""Of a variance by such a step. Where it is more, one pass restarted and the other did not."""

MOST_CHANGE_FAR = 1.0
"""The same for a number that is tried far from its value."""
LEAST_COMPARABLE = 0.95
"""Part of the samples that a pair of passes has to compare; else its step is too long."""
LARGEST_OVER_MEDIAN = 8.0
"""Largest change of a variance over the median one: a wrong time counts with the squared speed."""


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
    flow: int = 0
    """Number of the flow that the water has meanwhile."""
    recording: int = 0
    """Number of the recording, which may be cut into several series."""
    near_wall: int = 0
    """Intervals that are left out because the block may touch the wall."""
    angle: Floats = field(default_factory=lambda: np.zeros(0))
    """The angle, with holes filled in; zeros where there is none."""
    span: float = 0.0
    """Time of the recording's last sample, counted from its first [s]."""

    @property
    def settled(self) -> Flags:
        """Which samples are not the first ones of a stretch, shape (n,).

        Where the filter begins, and after a contact with the wall, it allows for any velocity. So
        its next errors are far smaller than it expects, and places where it often begins, which are
        those at the wall, would seem to have less noise.
        """
        begins = np.concatenate([[True], np.diff(self.time) > LONGEST_GAP_S])
        begins |= self.excluded != 0
        settled = ~begins
        for later in range(1, SETTLING_SAMPLES + 1):
            settled[later:] &= ~begins[:-later]
        return settled

    def part(self, first: int, end: int) -> Series:
        """Return the samples from a first one on, before an end."""
        columns = ("time", "x", "y", "theta", "omega", "excluded", "angle")
        return replace(self, **{name: getattr(self, name)[first:end] for name in columns})


@dataclass(frozen=True)
class Body:
    """The block and the water."""

    side: float
    mass: float
    depth: float
    strips: int
    water_density: float
    linear_speed: float
    """Speed [m/s] at which linear drag is as strong as the quadratic one in its place."""
    drag_speed: float
    """Speed [m/s] at which C_d holds, whatever the power of the drag."""
    orientation: str
    """"state", "given" or "none": the track's angle is measured like the position, is an input, or
    is not used."""


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
        """Return a number of a departure, that of the model where nothing else is said."""
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


class Pair(NamedTuple):
    """Two passes that differ in one parameter alone."""

    one: dict[str, Any]
    other: dict[str, Any]
    step: float
    """By how much the parameter differs."""
    most_change: float = MOST_CHANGE
    """Of a variance; where it is more, the two cannot be compared."""
    wave: Floats | None = None
    """How much of the difference counts at each sample, shape (n,); all of it by default."""

    @property
    def comparable(self) -> Flags:
        """Return which samples both passes have used, with nearly the same variances."""
        near = _beside(self.one, self.other, self.most_change)
        return _used(self.one) & _used(self.other) & near

    @property
    def excess(self) -> float:
        """Return how many times too long the step is for most samples to be comparable."""
        both = _used(self.one) & _used(self.other)
        if not both.any() or np.mean(self.comparable[both]) >= LEAST_COMPARABLE:
            return 1.0
        median = float(np.median(_changes(self.one, self.other)[both]))
        return max(1.0, LARGEST_OVER_MEDIAN * median / self.most_change)


class Sums(NamedTuple):
    """Sums of a pass over all samples."""

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
    flows : int
        Number of flows.
    """

    series: Sequence[Series]
    body: Body
    spline: Spline
    flows: int = 1

    def columns_of(self, flow: int, others: int) -> tuple[Place, Place]:
        """Return where the derivatives in one flow stand among those in all.

        Parameters
        ----------
        flow : int
            The flow.
        others : int
            Number of parameters that are not coefficients of a flow.

        Returns
        -------
        tuple
            For the coefficients and for the others: their place in one flow, and among all.
        """
        count = 2 * self.spline.size
        shared = self.flows * count
        return (
            (slice(0, count), slice(flow * count, (flow + 1) * count)),
            (slice(count, count + others), slice(shared, shared + others)),
        )

    def sums(self, point: Point, *, noise: str = "with", tried: Sequence[str] = ()) -> Sums:
        """Return likelihood, score and information at a point.

        Parameters
        ----------
        point : Point
            Where.
        noise : {"with", "without"}
            Whether the noises and opened numbers have derivatives; without them score and
            information end with ln C_d.
        tried : sequence of str
            Closed numbers that have derivatives too, after all the others.
        """
        names = [*point.extras, *tried] if noise == "with" else []
        others = 1 + len(names)
        size = 2 * self.spline.size * self.flows + others
        deviance, used = 0.0, 0
        score, information = np.zeros(size), np.zeros((size, size))
        for series in self.series:
            one = self._sums_of(series, point.in_flow(series.flow), names)
            places = self.columns_of(series.flow, others)
            for own, row in places:
                score[row] += one.score[own]
                for own_column, column in places:
                    information[row, column] += one.information[own, own_column]
            deviance, used = deviance + one.deviance, used + one.used
        return Sums(deviance, score, information, used)

    def _sums_of(self, series: Series, point: Point, names: list[str]) -> Sums:
        base = self._run(series, point)
        others = self._pairs(series, point, names, base)
        used = np.logical_and.reduce([_used(base), *(pair.comparable for pair in others)])
        white, changes, spreads = _noise_derivatives(base, others, used)
        right = np.zeros((used.size, white.shape[1], 1 + len(changes)))
        right[used] = np.stack([white, *changes], axis=-1)
        found = self._filter(series, point, sensitivities=True).sums(used.astype(np.uint8), right)
        deviance = 0.5 * float((white**2).sum()) + float(
            np.log(np.einsum("aan->an", factor(base["covariance"][used]))).sum()
        )
        count = len(found["information"])
        size = count + len(names)
        score, information = np.empty(size), np.empty((size, size))
        score[:count] = found["products"][0]
        information[:count, :count] = found["information"]
        information[count:, :count] = found["products"][1:]
        information[:count, count:] = found["products"][1:].T
        for k, (change, spread) in enumerate(zip(changes, spreads, strict=True)):
            bent = np.einsum("abn,na,nb->", spread, white, white, optimize=True)
            score[count + k] = (change * white).sum() + 0.5 * (bent - np.einsum("aan->", spread))
            for other in range(len(names)):
                information[count + k, count + other] = (change * changes[other]).sum() + 0.5 * (
                    spread * spreads[other]
                ).sum()
        return Sums(deviance, score, information, int(used.sum()))

    def _pairs(
        self, series: Series, point: Point, names: Sequence[str], base: dict[str, Any]
    ) -> list[Pair]:
        """Return two passes for each parameter.

        A closed cosine of the flow's strength changes so slowly that a change of the strength for
        good does as well, times the cosine.
        """
        waves = [name for name in names if name in STRENGTHS and name not in point.opened]
        steady = self._beside_base(series, point, "strength_0", base) if waves else None
        found = []
        for name in names:
            if steady is not None and name in waves:
                found.append(steady._replace(wave=_cosine(series, STRENGTHS.index(name) + 1)))
            else:
                found.append(self._beside_base(series, point, name, base))
        return found

    def _beside_base(self, series: Series, point: Point, name: str, base: dict[str, Any]) -> Pair:
        """Return two passes that differ in one parameter alone."""
        if name not in NUMBERS:
            return Pair(base, self._at(series, point, name, point.extras[name] + STEP), STEP)
        number, value = NUMBERS[name], point.number(name)
        most = MOST_CHANGE if number.trial is None else MOST_CHANGE_FAR
        if number.trial is not None and name not in point.opened:
            low, high = number.tried_from(value)
            one = base if low == value else self._at(series, point, name, low)
            return Pair(one, self._at(series, point, name, high), high - low, most)

        def one_step_on(step: float) -> Pair:
            high = value + step
            return Pair(base, self._at(series, point, name, high), high - value, most)

        pair = one_step_on(number.step)
        # Where positions are known to some micrometres, a tenth of a millisecond is a long step.
        return pair if pair.excess <= 1.0 else one_step_on(number.step / pair.excess)

    def _at(self, series: Series, point: Point, name: str, value: float) -> dict[str, Any]:
        return self._run(series, point.with_extra(name, value))

    def innovations(self, point: Point) -> list[tuple[Floats, Flags]]:
        """Return each recording's whitened innovations, shape (n, D), and which were used.

        D is 3 with the angle in the state, else 2. The innovation of a missing angle is 0.
        """
        found = [self._run(series, point.in_flow(series.flow)) for series in self.series]
        return [(_whitened(one), _used(one)) for one in found]

    def states(self, series: Series, point: Point) -> Floats:
        """Return coordinates and velocities after each sample, shape (n, 2 D); NaN without."""
        return np.asarray(self._run(series, point)["state"])

    def strength_products(self, series: Series, point: Point) -> tuple[Floats, Floats]:
        """Return products of the errors with their derivatives by the strength of the flow.

        Returns
        -------
        products, squares : ndarray, shape (n,)
            Of whitened errors and derivatives, and of the derivatives with themselves; 0 where a
            sample is not used.
        """
        base = self._run(series, point)
        pair = self._beside_base(series, point, "strength_0", base)
        used = pair.comparable
        white, (change,), _ = _noise_derivatives(base, [pair], used)
        products, squares = np.zeros(used.size), np.zeros(used.size)
        products[used] = (white * change).sum(axis=1)
        squares[used] = (change**2).sum(axis=1)
        return products, squares

    def _run(self, series: Series, point: Point) -> dict[str, Any]:
        return dict(self._filter(series, point).run(series.time.size))

    def _filter(self, series: Series, point: Point, *, sensitivities: bool = False) -> Any:
        body, spline = self.body, self.spline
        pose: dict[str, float] = {}
        if point.log_lever is not None and point.log_angle_noise is not None:
            pose["force_lever"] = math.exp(point.log_lever)
            pose["angle_noise"] = math.exp(point.log_angle_noise)
        x, y, theta = corrected(series, point)
        share = point.number("linear_share")
        return _core.InnovationsFilter(
            series.time,
            x,
            y,
            theta,
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
            strength=_strength(series, point),
            quadratic=1.0 - share,
            linear=0.25 * share * body.linear_speed,
            water_acceleration=point.number("water_acceleration"),
            water_spin=point.number("water_spin"),
            drag_power=point.number("drag_power"),
            drag_speed=body.drag_speed,
            time_noise=math.sqrt(point.number("time_variance")),
            force_memory=point.number("force_memory"),
            **pose,
        )


def corrected(series: Series, point: Point) -> tuple[Floats, Floats, Floats]:
    """Return the centre of mass and the angle of its faces, for what the camera says."""
    across, along = point.number("marker_x"), point.number("marker_y")
    offset = point.number("angle_offset")
    x, y, theta = series.x, series.y, series.theta
    if across or along:
        cosine, sine = np.cos(series.angle), np.sin(series.angle)
        x = x - (across * cosine - along * sine)
        y = y - (across * sine + along * cosine)
    if offset:
        theta = theta - offset
    return x, y, theta


def _strength(series: Series, point: Point) -> Floats | None:
    """Return the strength of the flow at the samples; nothing where it is 1 all the time."""
    terms = {k: point.number(f"strength_{k}") for k in range(STRENGTH_TERMS + 1)}
    waves = point.number("pulse_cosine"), point.number("pulse_sine")
    if not any(terms.values()) and not any(waves):
        return None
    strength = np.ones_like(series.time)
    for k, term in terms.items():
        strength += term * _cosine(series, k)
    phase = 2.0 * np.pi * point.number("pulse_frequency") * series.time
    return np.asarray(strength + waves[0] * np.cos(phase) + waves[1] * np.sin(phase))


def _cosine(series: Series, number: int) -> Floats:
    """Return one of the cosines over the recording, at the samples."""
    return np.asarray(np.cos(number * np.pi * series.time / max(series.span, 1e-300)))


def _whitened(found: dict[str, Any]) -> Floats:
    white = forward(factor(found["covariance"]), found["innovation"].T).T
    # To the filter a missing angle is one measured where it was predicted, with an enormous error.
    return np.where(found["innovation"] == 0.0, 0.0, white)


def _used(found: dict[str, Any]) -> Flags:
    return np.asarray(found["used"], dtype=bool)


def _beside(base: dict[str, Any], other: dict[str, Any], most: float = MOST_CHANGE) -> Flags:
    """Return which innovations have nearly the variances that they have in the other pass."""
    # A change that is not a number is not a near one.
    return np.asarray(_changes(base, other) <= most, dtype=bool)


def _changes(base: dict[str, Any], other: dict[str, Any]) -> Floats:
    """Return the largest relative change of a variance at each sample, shape (n,)."""
    one, two = (np.einsum("aan->an", unpacked(found["covariance"])) for found in (base, other))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray((np.abs(two - one) / one).max(axis=0))


def log_densities(passes: Passes, series: Series, point: Point) -> Floats:
    """Return the logarithm of the predicted density of each sample, shape (n,); NaN without one.

    Those that the filter takes for mistakes have one, too: a law pays for what it cannot predict.
    """
    found = passes._run(series, point)
    there = np.isfinite(found["innovation"]).all(axis=1) & (series.excluded == 0)
    root = factor(found["covariance"][there])
    white = forward(root, found["innovation"][there].T)
    size = len(white)
    density = np.full(there.size, np.nan)
    density[there] = -0.5 * (white**2).sum(axis=0) - np.log(np.einsum("aan->an", root)).sum(axis=0)
    return density - 0.5 * size * math.log(2.0 * math.pi)


def _noise_derivatives(
    base: dict[str, Any], others: Sequence[Pair], used: Flags
) -> tuple[Floats, list[Floats], list[Floats]]:
    """Return whitened innovations (n, D), their derivatives by the noises, and those of S.

    The derivatives of S are whitened from both sides, L^-1 dS L^-T, shape (D, D, n).
    """
    root = factor(base["covariance"][used])
    white = forward(root, base["innovation"][used].T).T
    changes, spreads = [], []
    for one, other, step, _, wave in others:
        per = 1.0 / step if wave is None else wave[used, None] / step
        change = (one["innovation"][used] - other["innovation"][used]) * per
        changes.append(forward(root, change.T).T)
        widening = unpacked((other["covariance"][used] - one["covariance"][used]) * per)
        half = forward(root, widening)
        spreads.append(forward(root, half.transpose(1, 0, 2)))
    return white, changes, spreads


def unpacked(lower: Floats) -> Floats:
    """Return symmetric matrices (D, D, n) from their lower parts (n, D (D + 1) / 2), row by row."""
    count = {3: 2, 6: 3}[lower.shape[1]]
    full = np.empty((count, count, lower.shape[0]))
    for column, (a, b) in enumerate(zip(*np.tril_indices(count), strict=True)):
        full[a, b] = full[b, a] = lower[:, column]
    return full


def factor(lower: Floats) -> Floats:
    """Return the Cholesky factors L (D, D, n), L L' the matrices of which these are lower parts."""
    full = unpacked(lower)
    root = np.zeros_like(full)
    for a in range(len(full)):
        for b in range(a + 1):
            rest = full[a, b] - (root[a, :b] * root[b, :b]).sum(axis=0)
            root[a, b] = np.sqrt(rest) if a == b else rest / root[b, b]
    return root


def forward(root: Floats, right: Floats) -> Floats:
    """Return L^-1 b for n triangular L (D, D, n) and b (D, n), or (D, m, n)."""
    found = np.empty_like(right)
    for a in range(len(root)):
        rest = right[a].copy()
        for b in range(a):
            rest -= root[a, b] * found[b]
        found[a] = rest / root[a, a]
    return found
