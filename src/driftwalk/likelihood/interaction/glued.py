"""Fits of glued blocks: the drag of hidden faces, and the length over which stirring is shared.

A dimer, or any rigid polyomino, in the water of an earlier fit of one block, whose posterior, a
normal law of flow and ln C_d, is the prior:

- *Drag of hidden faces*: the share h of a free face's drag that a face between two blocks feels is
  a number of the fit like any other, because the water pushes along and across the body's length.
- *Stirring that is shared*: with the correlation rho(r) = exp(-r²/2L²) of the forces on two blocks
  at a distance r, the force on the body has the variance sigma² sum rho_ij, and its torque has
  sigma² sum rho_ij r_i·r_j. Noise intensity and lever of the body, against the intensity of one
  block, give rho of two blocks side by side: of a dimer q_2 / q_1 = (1 + rho) / 2 and
  lever² = (a²/4) (1 - rho) / (1 + rho). Their errors go together: too strong a force comes with
  too short a lever. rho has a uniform prior, and an interval of highest density.

See docs/how-to/dimer.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError, argument_text
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.interval_inflation import INFLATION
from driftwalk.likelihood.newton import Mode
from driftwalk.likelihood.preparation import Estimate, PreparedRecordings
from driftwalk.likelihood.prior import Earlier
from driftwalk.likelihood.start import Starts, first_point
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class GluedPolicy(NamedTuple):
    """How the correlation is searched."""

    first_share: float = 0.5
    """Share of hidden drag at which the search begins; chosen by hand."""
    most_correlation: float = 0.995
    """Largest correlation of the forces on two blocks side by side: a length of ten sides; chosen
    by hand."""
    nodes: int = 2001
    """Of the posterior of the correlation; chosen by hand."""
    quantiles: int = 100
    """Values of the length that are kept, each for the same share of its posterior. A prediction
    draws from them; 1000 runs take 40 draws. Chosen by hand."""


GLUED: Final = GluedPolicy()


class EarlierFit(NamedTuple):
    """A finished fit of one block in the same water, and its recordings."""

    fit: xr.Dataset
    recordings: Sequence[xr.Dataset]


def glued_study(study: Study, earlier: xr.Dataset) -> Study:
    """Return the study of a glued body with the numbers of an earlier fit of one block.

    Tank, water, law and the block come from the earlier fit, and the mass once for each cell where
    it is not stated; shape, reading and [fit] from the study.

    Parameters
    ----------
    study : Study
        Of the glued body.
    earlier : xarray.Dataset
        A `fit` of one square block.

    Raises
    ------
    InputError
        When the body is not glued, or the earlier fit is not one of a single block.

    Examples
    --------
    >>> glued_study(study, fit).block.mass_kg  # doctest: +SKIP
    0.0232
    """
    from driftwalk.conditions.study import fitted_law, is_stated
    from driftwalk.model import apply_overrides, parse_study

    cells = len(study.block.body().cells)
    one = parse_study(earlier.attrs["study"])
    if cells < 2 or len(one.block.body().cells) > 1:
        raise InputError(
            "an earlier fit of one block is used only in a fit of glued blocks "
            f"({argument_text('block.shape', 'xx')}); to fit several recordings of one block "
            "together: driftwalk fit FIRST SECOND"
        )
    side = study.block.side_m
    if is_stated(study, "block.side_m") and abs(side / one.block.side_m - 1.0) > 1e-6:
        raise InputError(
            f"the glued blocks have sides of {1e3 * side:.4g} mm, and the block of the earlier fit "
            f"one of {1e3 * one.block.side_m:.4g} mm: state the side once, in the earlier fit"
        )
    block = {"block.side_m": one.block.side_m, "block.depth_m": one.wetted_depth_m}
    if not is_stated(study, "block.mass_kg"):
        block["block.mass_kg"] = cells * one.block.mass_kg
    law: dict[str, Any] = {
        # A power is that of the earlier fit, not to be estimated again.
        "fit.law": "auto" if earlier.attrs["drag_law"] == "power" else earlier.attrs["drag_law"],
        "fit.pressure_gradient": "on" if earlier.attrs["force_law"] == "floating body" else "off",
        "fit.force_memory_s": "white",
        "fit.flow_strength": "constant",
    }
    known = {str(name) for name in earlier["parameter"].values}
    for key, name in (("added_mass_share", "added_mass_share"), ("force_memory_s", "force_memory")):
        if name in known:
            law[f"fit.{key}"] = fitted_value(earlier, name)
    law = {key: value for key, value in law.items() if not is_stated(study, key)}
    sections = {"tank": one.tank, "water": one.water, "forces": one.forces}
    return apply_overrides(study.model_copy(update=sections), block | law | fitted_law(earlier))


def earlier_prior(ready: PreparedRecordings, before: Estimate) -> Earlier:
    """Return the posterior of the earlier fit as the prior of flow and ln C_d."""
    if ready.passes.spline != before.passes.spline:
        raise InputError(
            "the earlier fit has other knots for the flow: tank and the distance of the "
            "knots must be the same"
        )
    sums = before.passes.sums(before.point, noise="without")
    precision = before.prior.add(sums, before.point, before.weights).information
    centre = np.append(before.point.coefficients.ravel(), before.point.log_drag)
    return Earlier(centre, precision, before.weights)


def glued_start(ready: PreparedRecordings, before: Estimate) -> Starts:
    """Return where the search begins: flow and drag of one block, noises of the recording."""
    cells = len(ready.study.block.body().cells)
    point = replace(
        first_point(ready),
        coefficients=before.point.coefficients,
        log_drag=before.point.log_drag,
        log_intensity=before.point.log_intensity - math.log(cells),
    )
    return Starts(point, (point,))


class SharedStirring(NamedTuple):
    """The forces that neighbouring bodies share."""

    facts: Mapping[str, Any] = {}
    """Correlation at one side, length, and how far the data depart from the kernel."""
    variables: Mapping[str, Any] = {}
    """Variables of the fit: quantiles of the length, and for free bodies the correlation of the
    forces at distances, with intervals."""
    warnings: Sequence[str] = ()


def glued_stirring(
    ready: PreparedRecordings, mode: Mode, point: Point, before: Estimate, earlier: EarlierFit
) -> SharedStirring:
    """Return the correlation of the forces side by side, and the length, with intervals."""
    body = ready.passes.body
    names = ["log_intensity", *(["log_lever"] if point.log_lever is not None else [])]
    observed = np.array([getattr(point, name) for name in names])
    observed[0] -= before.point.log_intensity
    # A lever of forces on each block is known as well as they are, and its error goes with theirs.
    factors = INFLATION.without_angle if point.log_lever is None else INFLATION.with_angle
    covariance = factors[1] ** 2 * mode.values_of(names)[1]
    # Of ln C_d, ln q, ln r, ...
    covariance[0, 0] += float(earlier.fit["covariance"][1, 1])
    nodes = np.linspace(0.0, GLUED.most_correlation, GLUED.nodes)
    expected = np.array([_expected(float(rho), body) for rho in nodes])[:, : len(observed)]
    off = expected - observed
    squares = np.einsum("na,ab,nb->n", off, np.linalg.inv(covariance), off)
    rho = most_likely(nodes, -0.5 * squares, ready.study.fit.confidence)
    facts = stirring_facts(rho, [_length_of(one, body.side) for one in rho])
    if len(observed) > 1:
        facts["stirring_misfit_std"] = math.sqrt(float(squares.min()))
    lengths = np.array([_length_of(float(one), body.side) for one in nodes])
    return SharedStirring(facts, length_quantiles(lengths, -0.5 * squares))


def stirring_facts(correlation: Sequence[float], length: Sequence[float]) -> dict[str, Any]:
    """Return the correlation at one side and the length [m], each with the ends of its interval."""
    facts: dict[str, Any] = {}
    for name, one in (("stirring_correlation", correlation), ("stirring_length_m", length)):
        facts |= {name: one[0], f"{name}_interval": [*one[1:]]}
    return facts


def length_quantiles(lengths: Floats, log_density: Floats) -> dict[str, Any]:
    """Return the variable with the length at the middles of equal shares of its posterior [m]."""
    share = np.cumsum(np.exp(log_density - log_density.max()))
    middles = (np.arange(GLUED.quantiles) + 0.5) / GLUED.quantiles
    drawn = lengths[np.searchsorted(share, middles * share[-1])]
    return {"stirring_length_quantile": ("stirring_quantile", drawn)}


def _expected(rho: float, body: Body) -> tuple[float, float]:
    """Return the logarithms of the intensity over that of one block, and of the lever [m]."""
    length, outline = _length_of(rho, body.side), body.outline
    ratio = 2.0 * math.log(outline.force_share(length) / len(outline.cells))
    return ratio, math.log(max(outline.force_lever_m(length), 1e-12))


def _length_of(rho: float, side: float) -> float:
    """Return the length [m] for a correlation at a distance of one side [m]; 0 for none."""
    return 0.0 if rho <= 0.0 else side / math.sqrt(-2.0 * math.log(rho))


def most_likely(nodes: Floats, log_density: Floats, confidence: float) -> tuple[float, ...]:
    """Return the most likely node, and the ends of the interval of highest density."""
    density = np.exp(log_density - log_density.max())
    order = np.argsort(-density)
    inside = np.searchsorted(np.cumsum(density[order]), confidence * density.sum())
    within = order[: int(inside) + 1]
    return tuple(float(nodes[k]) for k in (order[0], within.min(), within.max()))
