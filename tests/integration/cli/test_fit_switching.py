"""`driftwalk fit --switching-times`: from the recording to the figures of every flow, and back."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import Done, answer, here, refusal
from switching_worlds import (
    DRAG,
    FORCES_N,
    START_S,
    SWITCH_S,
    true_flows,
    two_flows,
    two_settings,
)

import driftwalk as dw
from driftwalk.runs.fit import figures_of_fit

COARSE = ("--force-interval", "10ms", "--spline-spacing", "3cm", "--angle", "given")
SWITCH = ("--switching-times", f"{START_S + SWITCH_S:g}s")


def written(track: xr.Dataset, path: Path) -> Path:
    """Write a track as a table."""
    columns = [track["time"].values, *(track[name].values[:, 0] for name in ("x", "y", "theta"))]
    np.savetxt(path, np.column_stack(columns), "%.7f", ",", header="t,x,y,theta", comments="")
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(two_flows(), tmp_path_factory.mktemp("recording") / "switched.csv")


@pytest.fixture(scope="module")
def finished(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    folder = tmp_path_factory.mktemp("fit") / "run"
    return folder, here("fit", recording, *COARSE, *SWITCH, "-o", folder, "--json")


@pytest.mark.slow
def test_the_model_with_the_switch_explains_the_recording(finished: tuple[Path, Done]) -> None:
    """A right model fails once in fifty; C_d within 4 of its standard deviations."""
    found = answer(finished[1])
    assert found["verdict"] == "explains", found["verdict_reasons"]
    assert found["switching_times_s"] == [START_S + SWITCH_S]
    assert found["recordings"] == 1
    sd = found["drag_coefficient_relative_std"]
    assert abs(np.log(found["drag_coefficient"] / DRAG)) < 4.0 * sd


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_without_the_switch_it_does_not(recording: Path, tmp_path: Path) -> None:
    """The steps alone do not show it: under the law of a floating body they come out right."""
    how = (*COARSE, "--flow-strength", "constant", "--pressure-gradient", "on")
    found = answer(here("fit", recording, *how, "-o", tmp_path / "s", "--json"))
    assert found["verdict"] == "does not explain"
    assert any("the motion changes" in reason for reason in found["verdict_reasons"])


@pytest.mark.slow
def test_all_flows_have_one_scale_of_colours(finished: tuple[Path, Done]) -> None:
    fit, track = (xr.load_dataset(finished[0] / name) for name in ("fit.nc", "recording.nc"))
    figures = figures_of_fit(fit, track, body=None, check=None)
    tops = [figures[f"flow_{one}"]().axes[0].collections[0].get_clim() for one in "AB"]
    assert tops[0] == tops[1]


@pytest.mark.slow
def test_the_run_directory_holds_every_flow(finished: tuple[Path, Done]) -> None:
    folder = finished[0]
    for name in ("flow_A", "flow_B", "trajectory", "check_map"):
        assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
    assert not (folder / "figures" / "flow.png").exists()
    flow = dw.load_flow(folder / "flow.nc")
    assert flow["time"].values == pytest.approx([SWITCH_S, SWITCH_S], abs=1e-5)
    for frame, truth in zip((0, 1), true_flows(), strict=True):
        measured = flow["flag"].values[frame] == 1
        assert measured.sum() > 200
        there = truth.interp(x=flow["x"], y=flow["y"])
        off = (flow["u"].values[frame] - there["u"].values)[measured]
        assert np.sqrt((off**2).mean()) < 0.2 * np.sqrt((there["u"].values[measured] ** 2).mean())
    with xr.open_dataset(folder / "fit.nc", engine="h5netcdf") as stored:
        assert dw.fitted_flow(stored, interval=1)["u"].values == pytest.approx(flow["u"].values[1])
        check = dw.check_model(stored, dw.load(folder / "recording.nc"), replicates=4)
        assert check["verdict"] == "explains"


@pytest.mark.slow
def test_others_take_the_flow(finished: tuple[Path, Done], tmp_path: Path) -> None:
    flow = finished[0] / "flow.nc"
    done = here("simulate", "--flow", flow, "--duration", "5s", "-o", tmp_path / "run.nc")
    assert done.code == 0, done.err


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_people_read_which_flow_was_when(recording: Path, tmp_path: Path) -> None:
    middle = START_S + SWITCH_S
    times = f"{middle - 100:g},{middle:g}"
    words = (*COARSE, "--switching-times", times, "--flow-labels", "first,first2,last")
    precision = ("--precision", "0.001", "--no-check")
    done = here("fit", recording, *words, *precision, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    assert f"first, first2, last, switched at {middle - 100:g} s, {middle:g} s" in done.out
    assert "for 0.1 % about" in done.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--switching-times", "600,10"), "must increase"),
        (("--switching-times", "soon"), "--switching-times"),
        (("--switching-times", "9000"), "switching time 9000 s is outside the recording"),
        (("--switching-times", "100,101"), "the interval from 100 s to 101 s has 10 positions"),
        (("--switching-times", "100", "--flow-labels", "A"), "flow_labels has 1 name"),
        (("--flow-labels", "A,B"), "flow_labels has 2 names"),
        (("--precision", "2"), "drag_coefficient_precision"),
        (("--to", "55"), "10 to 30 min give C_d to 10 %"),
    ],
)
def test_mistakes_are_one_line(
    options: tuple[str, ...], words: str, recording: Path, tmp_path: Path
) -> None:
    done = here("fit", recording, "-o", tmp_path / "run", *options)
    assert words in refusal(done)
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_named_flows_have_a_force_each(tmp_path: Path) -> None:
    """Four sd each; a right model fails its check once in fifty."""
    track = written(two_settings(2), tmp_path / "pumps.csv")
    words = ("fit", track, *COARSE, *SWITCH, "--flow-labels", "low,high", "-o", tmp_path / "run")
    done = here(*words)
    assert done.code == 0, done.err
    assert "force in flow low σ_F" in done.out
    assert "force in flow high σ_F" in done.out
    found = answer(here("info", tmp_path / "run", "--json"))
    assert found["verdict"] == "explains", found["verdict_reasons"]
    sd = np.log(np.divide(found["flow_force_std_high_N"], found["flow_force_std_low_N"])) / 3.29
    assert (abs(np.log(np.divide(found["flow_force_std_N"], FORCES_N))) < 4.0 * sd).all()
    assert here("report", tmp_path / "run", "-o", tmp_path / "page.html").code == 0
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "force in flow high" in page
    # Each named flow is a mode of control, with its force.
    plan = (*("--blocks", "2", "--target", "2", "--by", "10s", "--rounds", "1"), "--worlds", "20")
    done = here("control", "plan", tmp_path / "run", *plan, "-o", tmp_path / "policy")
    assert done.code == 0, done.err
    assert "flow_settings" not in done.err
    policy = xr.load_dataset(tmp_path / "policy" / "policy.nc")
    assert policy["mode"].values.tolist() == ["low", "high"]
    np.testing.assert_allclose(policy["force_std"][:, 0], found["flow_force_std_N"])
    # The draws are as uncertain as the force of each flow; 99 of them give the sd to 7 %.
    spread = np.log(policy["force_std"]).std("draw")
    np.testing.assert_allclose(spread / spread[0], sd / sd[0], rtol=1e-6)
    shutil.copytree(tmp_path / "run", tmp_path / "again")
    both = here(
        "control", "plan", tmp_path / "run", tmp_path / "again", *plan, "-o", tmp_path / "4"
    )
    assert both.code == 0, both.err
    names = xr.load_dataset(tmp_path / "4" / "policy.nc")["mode"].values.tolist()
    assert names == ["run low", "run high", "again low", "again high"]
