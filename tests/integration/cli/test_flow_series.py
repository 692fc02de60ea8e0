"""A flow that ends before what is simulated in it, on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import xarray as xr
from command_line import RECORDING, here, leave_out_figures, refusal

import driftwalk as dw

BODY = ("--tank", "30cm", "--drag-coefficient", "0.4", "--force-std", "0.6mN")


@pytest.fixture(scope="module")
def series(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stream of 10 s that comes and goes."""
    path = tmp_path_factory.mktemp("flow") / "series.nc"
    frames = [dw.uniform_flow(speed, 0.0) for speed in (0.01, 0.03, 0.0, -0.02, 0.01)]
    time = xr.IndexVariable("time", [0.0, 2.5, 5.0, 7.5, 10.0], {"units": "s"})
    return dw.save_flow(xr.concat(frames, dim=time).assign_attrs(frames[0].attrs), path)


@pytest.fixture(autouse=True)
def _no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    leave_out_figures(monkeypatch)


def commands(series: Path, folder: Path) -> dict[str, tuple[object, ...]]:
    flow = ("--flow", series)
    runs = (*flow, "--blocks", 2, "--runs", 8, "--duration", "15s", "--threads", 1, *BODY)
    recording = (RECORDING, *flow, "--tank", "30cm", "--to", "60")
    return {
        "simulate": ("simulate", *flow, "--duration", "60s", *BODY, "-o", folder / "block.nc"),
        "assemble": ("assemble", *runs, "--film", "none", "-o", folder / "two"),
        "sensitivity": ("sensitivity", *runs, "-o", folder / "map"),
        "play": ("play", *flow, "--tank", "30cm"),
        "calibrate": ("calibrate", *recording, "-o", folder / "run"),
        "compare-models": ("compare-models", *recording, "-o", folder / "models"),
    }


@pytest.mark.parametrize(
    "name", ["simulate", "assemble", "sensitivity", "play", "calibrate", "compare-models"]
)
def test_a_flow_that_ends_is_refused(name: str, series: Path, tmp_path: Path) -> None:
    said = refusal(here(*commands(series, tmp_path)[name]))
    assert "the flow series spans 0 to 10 s" in said
    assert "--flow-repeat loop" in said
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("repeat", ["loop", "mirror", "hold"])
def test_how_it_goes_on_is_said(repeat: str, series: Path, tmp_path: Path) -> None:
    words = (*commands(series, tmp_path)["assemble"], "--flow-repeat", repeat)
    done = here(*words, "--json")
    assert done.code == 0, done.err
    unstated, said = json.loads(done.out)["warnings"]
    assert unstated.startswith("the mass and side were not stated: ")
    assert said.startswith("the flow series of 10 s ")
    assert "the intervals hold for" in said
    with xr.open_dataset(tmp_path / "two" / "assembly.nc", engine="h5netcdf") as found:
        assert found.attrs["flow_repeat"] == repeat
        begins = found["flow_start"].values
    assert (len(set(begins.tolist())) == 1) == (repeat == "hold")
    manifest = json.loads((tmp_path / "two" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["study"]["flow"]["repeat"] == repeat


def test_the_terminal_says_it_too(series: Path, tmp_path: Path) -> None:
    words = commands(series, tmp_path)["simulate"]
    done = here(*words, "--flow-repeat", "mirror", "--flow-start", "first", "--replicates", 2)
    assert done.code == 0, done.err
    assert "warning: the flow series of 10 s runs backwards and forwards in turns" in done.err
    assert "this one course of the water" in done.err


def test_a_wrong_word_is_refused(series: Path, tmp_path: Path) -> None:
    said = refusal(here(*commands(series, tmp_path)["simulate"], "--flow-repeat", "again"))
    assert "--flow-repeat" in said
