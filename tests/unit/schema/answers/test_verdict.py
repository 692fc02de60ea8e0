"""The verdict and the residuals of a check, kept in the fit that was checked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, recording
from unknown_names import unknown_names

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood import Judged, fit_motion, judge_fit
from driftwalk.page.sections.fit import fit_sections
from driftwalk.plot import residuals as plot_residual_map
from driftwalk.schema.answers.fit import BY_CELL, residuals_of
from driftwalk.schema.answers.verdict import Verdict, stored_verdict
from driftwalk.schema.check import check_dataset
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf

SECONDS = 120.0


@pytest.fixture(scope="module")
def judged() -> Judged:
    track = recording(SECONDS)
    return judge_fit(fit_motion(track, coarse_study()), [track])


@pytest.mark.slow
def test_the_fit_says_what_its_check_says(judged: Judged) -> None:
    fit, check = judged
    assert check is not None
    check_dataset(fit, "fit")
    assert unknown_names(fit) == []
    assert stored_verdict(fit) == stored_verdict(check)
    xr.testing.assert_identical(fit["p_value"], check["p_value"])


@pytest.mark.slow
def test_residuals_come_back_as_they_were(judged: Judged) -> None:
    fit, check = judged
    assert check is not None
    found = residuals_of(fit)
    assert residuals_of(check) is check
    for name in (*BY_CELL, "x", "y", "component"):
        assert found[name].dims == check[name].dims
        np.testing.assert_array_equal(found[name].values, check[name].values)
        assert found[name].attrs == check[name].attrs
    assert found.attrs["cell_size_m"] == check.attrs["cell_size_m"]
    assert found.attrs["arena"] == check.attrs["arena"]


@pytest.mark.slow
def test_nothing_of_the_fit_is_lost(judged: Judged) -> None:
    plain = fit_motion(recording(SECONDS), coarse_study())
    xr.testing.assert_identical(judged.fit[list(plain.variables)], plain)


@pytest.mark.slow
def test_what_is_stored_is_what_is_in_memory(judged: Judged, tmp_path: Path) -> None:
    path = tmp_path / "fit.nc"
    path.write_bytes(netcdf_bytes(judged.fit))
    xr.testing.assert_identical(open_netcdf(path), judged.fit)


@pytest.mark.slow
@pytest.mark.parametrize("show", ["mean", "noise"])
def test_the_map_of_the_fit_is_that_of_the_check(judged: Judged, show: str) -> None:
    fit, check = judged
    assert check is not None
    drawn = [
        plot_residual_map(one, show=show).collections[0].get_array()  # type: ignore[arg-type]
        for one in (fit, check)
    ]
    np.testing.assert_array_equal(*drawn)


@pytest.mark.slow
def test_the_flow_of_a_fit_is_drawn_as_its_flow_field(judged: Judged) -> None:
    drawn = [dw.plot.flow(one) for one in (judged.fit, dw.fitted_flow(judged.fit))]
    colours = [ax.collections[0].get_array() for ax in drawn]
    np.testing.assert_array_equal(*colours)
    with pytest.raises(InputError, match="2 flows: draw one"):
        dw.plot.flow(judged.fit.expand_dims(flow=["a", "b"]))


@pytest.mark.slow
def test_a_fit_that_could_not_be_checked_says_why() -> None:
    track = recording(SECONDS)
    fit = fit_motion(track, coarse_study())
    other = track.isel(time=slice(0, 100))
    found = judge_fit(fit, [other])
    assert found.check is None
    why = found.fit.attrs["check_left_out"]
    assert stored_verdict(found.fit) == Verdict("cannot tell", (why,))
    with pytest.raises(InputError, match="not checked") as error:
        residuals_of(found.fit)
    assert why in str(error.value)


@pytest.mark.slow
def test_residuals_of_something_else_are_refused(judged: Judged) -> None:
    with pytest.raises(InputError, match="got trajectory"):
        residuals_of(recording(SECONDS))
    with pytest.raises(InputError, match="check_model makes a"):
        residuals_of(fit_motion(recording(SECONDS), coarse_study()))


@pytest.mark.slow
def test_the_page_of_a_fit_in_memory_has_the_verdict(judged: Judged) -> None:
    fit, check = judged
    assert check is not None
    sections = fit_sections(fit)
    assert f"Verdict: {check['verdict'].values}" in " ".join(sections[0]["paragraphs"])
    assert "check" not in [part["id"] for part in sections]
    unchecked = fit_sections(fit_motion(recording(SECONDS), coarse_study()))
    assert "check" in [part["id"] for part in unchecked]


@pytest.mark.slow
def test_the_notebook_checks_unless_told_not_to() -> None:
    track = recording(SECONDS)
    assert "verdict" in dw.fit(track, coarse_study())
    assert "verdict" not in dw.fit(track, coarse_study(), check=False)
