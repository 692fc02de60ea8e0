"""Synthetic likelihood of the summaries of a recording: by a local emulator, and at one setting.

The emulator says how summaries depend on a model's parameters in a small trust region, from
simulations there. Their means are linear or quadratic functions of the parameters, as the
simulations support; what is left has a covariance. Where that is so, the setting of a recording is
the least-squares one, each summary weighed by its covariance: the maximum of the synthetic
likelihood (Wood, Nature 466 (2010) 1102).

An emulator's covariance holds what its quadratic misses, and differs from one trust region to the
next. So models are compared without one: by simulations of one setting each, all with the same
number of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats

Form = Literal["slopes", "squares", "products"]
FORMS: Final[tuple[Form, ...]] = ("slopes", "squares", "products")
"""A plane, with the square of each parameter, and with the products of two."""


class SyntheticLikelihoodPolicy(NamedTuple):
    """How mean and covariance of the summaries come from simulations."""

    shrunk: float = 0.05
    """Part of the correlations of the summaries that is taken away: they come from simulations.
    Chosen by hand."""
    constant: float = 1e-9
    """A summary that varies by less than this part of its size says nothing. Chosen by hand: far
    above the rounding of float64."""
    simulations: int = 512
    """That give mean and covariance: some four for each summary. Chosen by hand."""


SYNTHETIC: Final = SyntheticLikelihoodPolicy()


class Solution(NamedTuple):
    """The setting that fits summaries best."""

    setting: Floats
    """In the unit cube, shape (parameters,)."""
    place: Floats
    """The same in the trust region: 0 is its centre, 1 its boundary."""
    discrepancy: float
    """Sum of the squares of what is left, in standard deviations."""
    std: Floats
    """Standard deviations by the curvature there, in parts of the ranges."""
    log_volume: float
    """Logarithm of the determinant of the covariance that belongs to them."""


@dataclass(frozen=True, eq=False)
class LocalEmulator:
    """The summaries of a model in a trust region.

    Attributes
    ----------
    centre, width : ndarray, shape (parameters,)
        The trust region, in the unit cube.
    form : {"slopes", "squares", "products"}
        What is fitted.
    coefficients : ndarray, shape (summaries, coefficients)
        Of the whitened summaries.
    whitening : ndarray, shape (summaries, summaries)
        Makes what is left of the summaries independent, with variance 1.
    used : ndarray of bool
        Which summaries say anything.
    freedom : int
        Simulations less the coefficients of a summary's mean: what the covariance comes from.
    """

    centre: Floats
    width: Floats
    form: Form
    coefficients: Floats
    whitening: Floats
    used: Bools
    freedom: int

    @property
    def error_inflation(self) -> float:
        """Factor by which errors are larger than the likelihood says.

        The covariance of the summaries comes from simulations. Its inverse is too large on average
        (Hartlap et al., Astron. Astrophys. 464 (2007) 399), and its errors scatter the estimate
        (Percival et al., Mon. Not. R. Astron. Soc. 439 (2014) 2531, Eq. 18).
        """
        count, parameters = self.summaries, self.centre.size
        more = self.freedom - count
        # With three or fewer the moments of an inverse Wishart matrix do not exist.
        if more <= 3:
            return float("inf")
        inverse = self.freedom / (more - 1.0)
        first, second = (top / (more * (more - 3.0)) for top in (2.0, more - 1.0))
        scatter = 1.0 + second * (count - parameters)
        return float(np.sqrt(inverse * scatter / (1.0 + first + second * (parameters + 1.0))))

    @property
    def summaries(self) -> int:
        """How many summaries say anything."""
        return int(self.used.sum())

    @property
    def log_variance(self) -> float:
        """Logarithm of the determinant of the covariance of what is left of the summaries.

        Discrepancies count in standard deviations, which differ from one emulator to another. With
        this added, two of them compare: it is -2 log of the likelihood, but for a constant.
        """
        return -2.0 * float(np.linalg.slogdet(self.whitening)[1])

    def whitened(self, summaries: Floats) -> Floats:
        """Return summaries as they are compared."""
        return np.asarray(self.whitening @ summaries[self.used])

    def discrepancies(self, settings: Floats, summaries: Floats) -> Floats:
        """Return how far summaries are from those expected at each setting, shape (settings,)."""
        place = (settings - self.centre) / self.width
        left = _basis(place, self.form) @ self.coefficients.T - self.whitened(summaries)
        return np.asarray((left**2).sum(axis=1))

    def solve(
        self,
        summaries: Floats,
        *,
        reach: float,
        start: Floats | None = None,
        held: tuple[int, float] | None = None,
    ) -> Solution:
        """Return the setting that fits summaries best."""
        from scipy.optimize import least_squares

        low = np.maximum(-reach, (0.0 - self.centre) / self.width)
        high = np.minimum(reach, (1.0 - self.centre) / self.width)
        wanted = self.whitened(summaries)

        def left(place: Floats) -> Floats:
            return np.asarray(self.coefficients @ _basis(place[None], self.form)[0] - wanted)

        def slope(place: Floats) -> Floats:
            return np.asarray(self.coefficients @ _basis_slope(place, self.form))

        begin = np.zeros(low.size) if start is None else (start - self.centre) / self.width
        inside = 1e-6 * (high - low)
        if held is not None:
            # A range that is next to nothing: the solver takes no bounds that are equal.
            index, value = held
            place = (value - self.centre[index]) / self.width[index]
            low[index], high[index] = place - 1e-9, place + 1e-9
            inside[index] = 0.5e-9
        begin = np.clip(begin, low + inside, high - inside)
        found = least_squares(left, begin, jac=slope, bounds=(low, high), max_nfev=40)
        # A trust region as wide as its standard deviation keeps the inverse finite.
        slopes = slope(found.x)
        curvature = slopes.T @ slopes + np.eye(begin.size)
        return Solution(
            setting=self.centre + found.x * self.width,
            place=found.x,
            discrepancy=2.0 * float(found.cost),
            std=np.sqrt(np.diag(np.linalg.inv(curvature))) * self.width,
            log_volume=2.0 * float(np.log(self.width).sum())
            - float(np.linalg.slogdet(curvature)[1]),
        )


def fit_emulator(
    settings: Floats, summaries: Floats, *, centre: Floats, width: Floats
) -> LocalEmulator:
    """Return the summaries of a model as a function of its parameters."""
    place = (settings - centre) / width
    form = _best_form(place, summaries)
    basis = _basis(place, form)
    coefficients, *_ = np.linalg.lstsq(basis, summaries, rcond=None)
    left = summaries - basis @ coefficients
    freedom = max(len(settings) - basis.shape[1], 1)
    spread = np.sqrt((left**2).sum(axis=0) / freedom)
    used = spread > SYNTHETIC.constant * (np.abs(summaries).max(axis=0) + SYNTHETIC.constant)
    scaled = left[:, used] / spread[used]
    correlation = shrunk_correlation(scaled, freedom)
    whitening = np.linalg.cholesky(np.linalg.inv(correlation)).T / spread[used]
    return LocalEmulator(
        centre, width, form, whitening @ coefficients[:, used].T, whitening, used, freedom
    )


def shrunk_correlation(scaled: Floats, freedom: int) -> Floats:
    """Return the correlations of summaries of simulations, less a part of each.

    Examples
    --------
    >>> shrunk_correlation(np.array([[1.0, 1.0], [-1.0, -1.0]]), 2).round(2).tolist()
    [[1.0, 0.95], [0.95, 1.0]]
    """
    one = np.eye(scaled.shape[1])
    return (1.0 - SYNTHETIC.shrunk) * (scaled.T @ scaled) / freedom + SYNTHETIC.shrunk * one


def _best_form(place: Floats, summaries: Floats) -> Form:
    """Return the form that foretells simulations best which it has not seen.

    Coefficients that a trust region does not need cost: nine parameters have 36 products, and with
    256 simulations their errors are larger than what they describe.
    """
    # Fewer than four simulations for each coefficient determine none of them well.
    known = [one for one in FORMS if len(place) >= 4 * _basis(place[:1], one).shape[1]]
    tried = known or FORMS[:1]
    errors = [_foretold(_basis(place, one), summaries) for one in tried]
    return tried[int(np.argmin(errors))]


def _foretold(basis: Floats, summaries: Floats) -> float:
    """Return the mean logarithm of the squared errors of summaries, each left out in turn."""
    orthogonal, _ = np.linalg.qr(basis)
    own = np.minimum((orthogonal**2).sum(axis=1), 0.99)
    left = (summaries - orthogonal @ (orthogonal.T @ summaries)) / (1.0 - own)[:, None]
    spread = left.std(axis=0)
    used = spread > SYNTHETIC.constant * (np.abs(summaries).max(axis=0) + SYNTHETIC.constant)
    return float(np.log(spread[used]).mean()) if used.any() else 0.0


def _basis(place: Floats, form: Form) -> Floats:
    """Return 1, each coordinate, and where the form has them, its square and products of two."""
    columns = [np.ones((len(place), 1)), place]
    if form != "slopes":
        columns.append(place**2)
    if form == "products":
        first, second = np.triu_indices(place.shape[1], 1)
        columns.append(place[:, first] * place[:, second])
    return np.concatenate(columns, axis=1)


def _basis_slope(place: Floats, form: Form) -> Floats:
    """Return the derivatives of `_basis`, shape (coefficients, parameters)."""
    count = place.size
    rows = [np.zeros((1, count)), np.eye(count)]
    if form != "slopes":
        rows.append(np.diag(2.0 * place))
    if form == "products":
        first, second = np.triu_indices(count, 1)
        mixed = np.zeros((first.size, count))
        at = np.arange(first.size)
        mixed[at, first] = place[second]
        mixed[at, second] = place[first]
        rows.append(mixed)
    return np.concatenate(rows)


class SyntheticLikelihood(NamedTuple):
    """Summaries of a recording, compared with simulations of one setting."""

    discrepancy: float
    """Sum of squares of the deviations of the recording's summaries, in standard deviations."""
    own_discrepancies: Floats
    """The same of simulated recordings that gave neither mean nor covariance."""
    log_variance: float
    """Logarithm of the determinant of the covariance."""


def synthetic_likelihood_at(
    simulate: Callable[[Floats], Floats], recorded: Floats, setting: Floats, replicates: int
) -> SyntheticLikelihood:
    """Compare a recording's summaries with simulations of one setting.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> def simulate(settings):
    ...     return settings + random.normal(size=settings.shape)
    >>> found = synthetic_likelihood_at(simulate, np.array([0.5, 3.5]), np.array([0.5, 0.5]), 100)
    >>> usual = np.quantile(found.own_discrepancies, 0.95)
    >>> round(found.discrepancy), bool(found.discrepancy > usual)
    (9, True)
    """
    seen = simulate(np.tile(setting, (SYNTHETIC.simulations + replicates, 1)))
    known, others = seen[: SYNTHETIC.simulations], seen[SYNTHETIC.simulations :]
    mean = known.mean(axis=0)
    spread = np.sqrt(known.var(axis=0, ddof=1))
    root = np.linalg.cholesky(
        shrunk_correlation((known - mean) / spread, SYNTHETIC.simulations - 1)
    )
    apart = np.linalg.solve(root, ((np.vstack([recorded, others]) - mean) / spread).T)
    discrepancies = (apart**2).sum(axis=0)
    return SyntheticLikelihood(
        discrepancy=float(discrepancies[0]),
        own_discrepancies=discrepancies[1:],
        log_variance=2.0 * float(np.log(np.diag(root)).sum() + np.log(spread).sum()),
    )
