"""A fit together with the answer to the question whether its model explains the recordings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from driftwalk.core.errors import InputError, reason_of
from driftwalk.likelihood.check.run import check_model
from driftwalk.likelihood.solution import BREAKDOWN
from driftwalk.schema.answers.verdict import with_verdict

if TYPE_CHECKING:
    import xarray as xr


class Judged(NamedTuple):
    """A fit that was checked."""

    fit: xr.Dataset
    """A `fit`, with the verdict in it; where no check could be made, its attribute
    ``check_left_out`` says why."""
    check: xr.Dataset | None
    """The `model_check`; None where it could not be made."""


def judge_fit(
    fit: xr.Dataset, recordings: Sequence[xr.Dataset], *, body: str | None = None
) -> Judged:
    """Check a fit and keep the verdict in it.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    recordings : sequence of xarray.Dataset
        The fitted recordings, in the same order.
    body : str, optional
        The body, where a recording has several.

    Returns
    -------
    Judged
        The `fit` with the verdict, and the `model_check`. A fit that cannot be checked is no
        error: its attribute ``check_left_out`` says why.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> found = judge_fit(dw.fit_motion(recording), [recording])  # doctest: +SKIP
    >>> bool(found.fit["explained"])  # doctest: +SKIP
    True
    """
    try:
        check = check_model(fit, recordings, body=body)
    except InputError as error:
        return Judged(fit.assign_attrs(check_left_out=str(error)), None)
    except BREAKDOWN as error:
        why = f"the model cannot be checked: the check broke down ({reason_of(error)})"
        return Judged(fit.assign_attrs(check_left_out=why), None)
    return Judged(with_verdict(fit, check), check)
