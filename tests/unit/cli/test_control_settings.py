"""Modes of `driftwalk control plan` of a fit with three named flows, each with its own σ_F."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from made_up_fit import made_up_fit

import driftwalk as dw
from driftwalk.assembly import ModeSource, make_modes
from driftwalk.cli.assembly.control import settings_of
from driftwalk.cli.inputs.model_source import Source, assembly_source
from driftwalk.cli.options.study import StudyOptions
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS
from driftwalk.likelihood import fitted_flow
from driftwalk.schema import build_flow_field
from driftwalk.schema.kinds.fit import FIT

FORCES_N = [6e-4, 2e-4, 4e-4]


@pytest.fixture(scope="module")
def switched(tmp_path_factory: pytest.TempPathFactory) -> tuple[xr.Dataset, Path]:
    """Return a fit of flows that are 1, 2 and 3 times one another, and its file."""
    fit = made_up_fit(flows=("low", "middle", "high"))
    names = ["ln_drag_coefficient", "ln_noise_intensity"]
    factor = xr.DataArray([1.0, 2.0, 3.0], dims="flow")
    fit = fit.assign(
        u=(factor * fit["u"]).assign_attrs(fit["u"].attrs),
        v=(factor * fit["v"]).assign_attrs(fit["v"].attrs),
        covariance=(("log_parameter", "other_log_parameter"), 0.01 * np.eye(2)),
        interval_flow=("fit_interval", [0, 1, 2]),
        switching_time=("switch", [600.0, 1200.0]),
        recording_start=0.0,
        cell_size=0.01,
        **{
            f"flow_force_std{end}": ("flow", share * np.array(FORCES_N))
            for end, share in (("", 1.0), ("_low", 0.9), ("_high", 1.1))
        },
    )
    fit = fit.assign_coords(log_parameter=names, other_log_parameter=names)
    study = dw.Study(tank={"diameter_m": 0.3})
    fit.attrs |= {"schema_version": FIT.version, "study": study.to_toml()}
    path = tmp_path_factory.mktemp("fit") / "fit.nc"
    fit.to_netcdf(path, engine="h5netcdf")
    return fit, path


def settings(
    path: Path, flow: Path | None = None, **tank: object
) -> tuple[Source, list[ModeSource], list[str]]:
    """Return the model of a fit, its modes and their warnings."""
    given = StudyOptions(None, {f"tank.{key}": value for key, value in tank.items()}, ASSEMBLY_KEYS)
    source = assembly_source(path, flow, given)
    return source, *settings_of(source, "", flow)


def test_each_flow_has_its_force_and_no_warning_of_it(switched: tuple[xr.Dataset, Path]) -> None:
    source, modes, warnings = settings(switched[1])
    assert [one.name for one in modes] == ["low", "middle", "high"]
    assert [one.study.forces.force_std_N for one in modes] == FORCES_N
    assert [text for text in source.warnings if text not in warnings] == [source.first_force]


def test_each_flow_is_stretched_to_a_larger_tank(switched: tuple[xr.Dataset, Path]) -> None:
    fit, path = switched
    _, modes, warnings = settings(path, diameter_m=0.6)
    for one, u in zip(modes, fit["u"].values, strict=True):
        np.testing.assert_array_equal(one.flow["u"], u)
        np.testing.assert_allclose(one.flow["x"], 2.0 * fit["x"])
    assert make_modes(modes).size == 3
    assert any("stretched to 0.6 m" in text for text in warnings)


@pytest.mark.parametrize("changes", [False, True])
def test_a_given_flow_takes_the_place_of_all(
    changes: bool, switched: tuple[xr.Dataset, Path], tmp_path: Path
) -> None:
    """One that changes in time is refused; a steady one is taken with σ_F of the first flow."""
    fit, path = switched
    flow = fitted_flow(fit, interval=1)
    if changes:
        frames = {name: np.stack(2 * [flow[name].values]) for name in ("u", "v", "flag")}
        attrs = {"arena": flow.attrs["arena"]}
        flow = build_flow_field(flow["x"], flow["y"], time=[0.0, 1.0], **frames, attrs=attrs)
    dw.save_flow(flow, tmp_path / "flow.nc")
    source, modes, warnings = settings(path, tmp_path / "flow.nc")
    assert len(modes) == 1
    assert modes[0].study.forces.force_std_N == FORCES_N[0]
    np.testing.assert_array_equal(modes[0].flow["u"], flow["u"])
    assert source.first_force in warnings
    assert "the one of flow low is taken for all" in str(source.first_force)
    if changes:
        with pytest.raises(InputError, match="changes in time"):
            make_modes(modes, flow_scales=[0.0, 1.0])
