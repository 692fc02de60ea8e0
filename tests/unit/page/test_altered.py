"""Pages of runs whose data are in another form than this version writes: something is shown."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from finished_run import write_finished_run

from driftwalk.page import report_page
from driftwalk.viewer.watch.run_page import RunSource

Alter = Callable[[xr.Dataset], xr.Dataset]
OTHER_FORM = "not in the form that this version of driftwalk reads"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_finished_run(tmp_path_factory.mktemp("altered") / "run")


def scalar(name: str) -> Alter:
    return lambda data: data.drop_vars(name).assign({name: 3.0})


def text(name: str) -> Alter:
    return lambda data: data.assign({name: (data[name].dims, np.full(data[name].shape, "<x>"))})


def three(name: str) -> Alter:
    return lambda data: data.assign({name: ("three", np.ones(3))})


def attribute(name: str, value: object) -> Alter:
    return lambda data: data.assign_attrs({name: value})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "alter", "lost", "kept"),
    [
        ("calibration.nc", scalar("ks_distance"), {"map"}, {"recording-1", "flow"}),
        ("calibration.nc", text("estimate"), {"summary"}, {"flow"}),
        ("calibration.nc", lambda d: d.isel(force_std=slice(0, 0)), {"map"}, {"flow"}),
        # Read outside of any section: nothing but the manifest is left, and the reason.
        ("calibration.nc", three("position_noise"), {"summary"}, {"manifest"}),
        ("flow.nc", text("u"), {"flow"}, {"map", "recording-1"}),
        ("recording.nc", lambda d: d.assign(x=np.nan * d["x"]), {"map"}, {"summary", "flow"}),
        ("recording.nc", attribute("arena", np.ones(3)), {"recording-1"}, {"summary", "flow"}),
    ],
)
def test_what_is_in_another_form_costs_its_section(
    finished: Path, tmp_path: Path, file: str, alter: Alter, lost: set[str], kept: set[str]
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(finished, folder)
    data = xr.load_dataset(finished / file, engine="h5netcdf")
    (folder / file).unlink()
    alter(data).to_netcdf(folder / file, engine="h5netcdf")
    page = report_page(folder)
    empty = {part["id"] for part in page["sections"] if OTHER_FORM in part.get("reason", "")}
    shown = {part["id"] for part in page["sections"] if part["kind"] != "empty"}
    assert lost <= empty
    assert kept <= shown
    json.dumps(page)
    # Neither does a page that is watched end with it.
    assert RunSource(folder).greeting()[0]["page"]["sections"] == page["sections"]
