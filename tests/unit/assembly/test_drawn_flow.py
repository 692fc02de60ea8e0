"""Flow fields drawn from standard errors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from scipy.stats import kstest

import driftwalk as dw
from driftwalk.assembly.runs.draws import draw_flow, has_standard_error

ERROR = 2e-3


@pytest.fixture(scope="module")
def flow() -> xr.Dataset:
    """Return a vortex in which the left half was measured, with errors that grow with y."""
    field = dw.vortex_flow(1.0)
    known = (field["x"] < 0) & (field["v"] == field["v"])
    error = xr.where(known, ERROR * (1.0 + (field["y"] > 0)), np.nan).transpose("y", "x")
    return field.assign(u_standard_error=error, v_standard_error=error)


@pytest.mark.false_alarm(1.2e-3)
def test_each_measured_node_moves_by_its_standard_error(
    flow: xr.Dataset, fresh_seed: Callable[[int], int]
) -> None:
    """Normal with the stated width at 2 x 1250 nodes; false alarm 1e-3."""
    drawn = draw_flow(flow, seed=fresh_seed(1), trial=1, draw=0)
    moves = []
    for name in ("u", "v"):
        error = flow[f"{name}_standard_error"].values
        known = np.isfinite(error)
        change = (drawn[name] - flow[name]).values
        assert (change[~known] == 0.0).all()
        moves.append(change[known] / error[known])
    together = np.concatenate(moves)
    assert together.size > 2000
    assert kstest(together, "norm").pvalue > 1e-3
    # The components, and neighbours, are drawn apart: correlation of n numbers has width n^-1/2.
    assert abs(np.corrcoef(*moves)[0, 1]) < 4.0 / np.sqrt(moves[0].size)
    assert abs(np.corrcoef(moves[0][1:], moves[0][:-1])[0, 1]) < 4.0 / np.sqrt(moves[0].size)
    np.testing.assert_array_equal(drawn["flag"], flow["flag"])


def test_a_draw_depends_on_its_address_alone(flow: xr.Dataset) -> None:
    fields = {
        address: draw_flow(flow, seed=address[0], trial=address[1], draw=address[2])["u"].values
        for address in ((1, 1, 0), (2, 1, 0), (1, 2, 0), (1, 1, 1))
    }
    again = draw_flow(flow, seed=1, trial=1, draw=0)["u"].values
    np.testing.assert_array_equal(fields[1, 1, 0], again)
    assert all((field != again).any() for key, field in fields.items() if key != (1, 1, 0))


def test_which_fields_state_an_error(flow: xr.Dataset) -> None:
    assert has_standard_error(flow)
    assert not has_standard_error(dw.tank30_flow())
    assert not has_standard_error(flow.assign(v_standard_error=flow["u"] * np.nan))
    extracted = dw.conditions.recording_flow(dw.tank30_recording(), dw.Study())
    assert has_standard_error(extracted)
