"""The figures of a policy of control, and of its test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.figures.write import Figures
from driftwalk.plot.control import plot_control_run, plot_control_shares, plot_policy
from driftwalk.plot.parts import style
from driftwalk.plot.tank import plot_film_strip

if TYPE_CHECKING:
    import xarray as xr


def policy_figures(policy: xr.Dataset) -> Figures:
    """Return the figure of a policy.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.

    Returns
    -------
    dict of str to callable
        ``policy``.

    Examples
    --------
    ``write_figures(policy_figures(policy), "policy/figures")``
    """
    return {"policy": lambda: style.figure_of(plot_policy(policy))}


def trial_figures(control_test: xr.Dataset, path: xr.Dataset | None = None) -> Figures:
    """Return the figures of a test: the target over time, and the decisions of one run.

    Parameters
    ----------
    control_test : xarray.Dataset
        A `control_test`.
    path : xarray.Dataset, optional
        The `assembly_path` of the run that it shows.

    Returns
    -------
    dict of str to callable
        ``shares`` and ``run``, with `path` also ``film_strip``.

    Examples
    --------
    ``write_figures(trial_figures(found), "test/figures")``
    """
    figures: Figures = {
        "shares": lambda: style.figure_of(plot_control_shares(control_test)),
        "run": lambda: style.figure_of(plot_control_run(control_test)),
    }
    if path is not None:
        figures["film_strip"] = lambda: style.figure_of(plot_film_strip(path)[0])
    return figures
