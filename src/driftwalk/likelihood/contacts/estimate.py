"""Estimate of the wall, from the contacts that the fit leaves out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.conditions import estimated_study
from driftwalk.core.run_stages import tell_nobody
from driftwalk.likelihood.contacts.lattice import search_walls
from driftwalk.likelihood.contacts.parabola import answer, is_undetermined
from driftwalk.likelihood.contacts.particles import Part, WallLikelihood
from driftwalk.likelihood.contacts.passages import Passages, passages_of, thinned
from driftwalk.likelihood.estimate import Estimate, estimate_of
from driftwalk.likelihood.flow_of_fit import fitted_flow
from driftwalk.likelihood.intervals import fitted_intervals
from driftwalk.likelihood.newton import Tell
from driftwalk.likelihood.solution import BREAKDOWN
from driftwalk.schema.answers.parts import undetermined
from driftwalk.schema.check import described
from driftwalk.schema.kinds.fit_numbers import WALL_NUMBERS

if TYPE_CHECKING:
    import xarray as xr


class ContactPolicy(NamedTuple):
    """How many contacts an estimate of the wall takes."""

    fewest: int = 8
    """Fewer passages along the wall say nothing of it. Chosen by hand."""
    most: int = 50
    """More are thinned to this many, evenly. Chosen by hand, for the time that they take."""


CONTACT: Final = ContactPolicy()


def estimate_wall(
    fit: xr.Dataset,
    recordings: Sequence[xr.Dataset],
    *,
    body: str | None = None,
    seed: int = 0,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Estimate restitution and friction of the wall from the contacts of the recordings of a fit.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`; the estimate needs the orientation in its state.
    recordings : sequence of xarray.Dataset
        Those that it was made of.
    body : str, optional
        The body, where a recording has several.
    seed : int
        Of the particles.
    tell : callable, optional
        Called with the number of walls that are done, their number, and the task.

    Returns
    -------
    xarray.Dataset
        The fit, with ``wall_contacts``, the number of passages along the wall, and with enough of
        them ``wall_restitution`` and ``wall_friction`` with their intervals. A wall that cannot be
        estimated is no error: the attribute ``wall_left_out`` says why.

    Raises
    ------
    InputError
        When the recordings are not those of the fit.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> fit = dw.fit_motion(recording)  # doctest: +SKIP
    >>> found = estimate_wall(fit, [recording])  # doctest: +SKIP
    >>> int(found["wall_contacts"])  # doctest: +SKIP
    0
    """
    unknown = undetermined(fit)
    # Recordings of another fit are the user's mistake, and no breakdown.
    estimate = None if unknown else estimate_of(fit, recordings, body=body)
    # An earlier estimate may have left some.
    earlier = [f"{one.name}{end}" for one in WALL_NUMBERS for end in ("", "_interval")]
    fit = fit.drop_vars(["wall_contacts", *earlier], errors="ignore")
    fit.attrs.pop("wall_left_out", None)
    if estimate is None:
        return fit.assign_attrs(wall_left_out=_stands_on(unknown))
    if fit.attrs["angle"] != "state":
        return fit.assign_attrs(wall_left_out=_no_orientation(fit.attrs["angle"]))
    try:
        found = [passages_of(estimate, one) for one in estimate.passes.series]
        count = sum(len(one.x) for one in found)
        fit = described(fit.assign(wall_contacts=((), np.int64(count))))
        if count < CONTACT.fewest:
            return fit.assign_attrs(wall_left_out=_too_few(count))
        data = _answer(fit, estimate, found, seed=seed, tell=tell or tell_nobody)
    except BREAKDOWN as error:
        return fit.assign_attrs(wall_left_out=f"the estimate of the wall failed: {error}")
    if is_undetermined(data):
        return fit.assign_attrs(wall_left_out=_all_alike(count))
    return described(fit.assign(data))


def _answer(
    fit: xr.Dataset, estimate: Estimate, found: Sequence[Passages], *, seed: int, tell: Tell
) -> dict[str, Any]:
    """Return restitution and friction, from the passages of each series."""
    count = sum(len(one.x) for one in found)
    intervals = fitted_intervals(fit)
    parts = [
        Part(
            thinned(passages, min(1.0, CONTACT.most / count)),
            fitted_flow(fit, interval=intervals.of_flow(series.flow)[0]),
            float(np.median(np.diff(series.time))),
        )
        for series, passages in zip(estimate.passes.series, found, strict=True)
        if len(passages.x)
    ]
    likelihood = WallLikelihood(estimated_study(fit), estimate.point, parts, seed)
    walls = search_walls(likelihood.log_likelihood, tell)
    return answer(walls, float(fit["confidence"]))


def _stands_on(unknown: Sequence[str]) -> str:
    """Return why a fit without its numbers says nothing of the wall."""
    return (
        f"the estimate of the wall needs {' and '.join(unknown)}, which this recording does not "
        "determine"
    )


def _no_orientation(angle: str) -> str:
    """Return why a fit without the orientation in its state says nothing of the wall."""
    if angle == "given":
        return (
            "the estimate of the wall needs the orientation in the state of the fit, and here it "
            'was an input: fit with `angle="state"`'
        )
    return (
        "the estimate of the wall needs the orientation of the block, and this fit used none: "
        'record it, or read the column that holds it (`columns`), and fit with `angle="state"`'
    )


def _too_few(count: int) -> str:
    """Return why so few contacts say nothing of the wall."""
    return (
        f"the estimate of the wall needs {CONTACT.fewest} contacts with it, and {count} can be "
        "followed: record for longer, at an even rate, or where the flow drives the block to the "
        "wall"
    )


def _all_alike(count: int) -> str:
    """Return why enough contacts say nothing of the wall."""
    return (
        f"the block passed along the wall {count} times, which does not tell one wall from "
        "another: the block hardly touched it, or moved as none would make it move; check the "
        "size of the tank (`tank`) and the side of the block (`side`)"
    )
