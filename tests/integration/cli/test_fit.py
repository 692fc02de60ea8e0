"""`driftwalk fit`: what it prints and writes, what uses its flow, and what it refuses.

The recording is the bundled one, which another engine simulated.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import DATA, FIT, RECORDING, Done, answer, here, refusal

import driftwalk as dw
from driftwalk.schema.answers.facts import facts_of

SECOND = DATA / "recording_second_seed.csv"
REQUIRED = (
    *("drag_coefficient", "drag_coefficient_interval", "force_std_N", "force_std_N_interval"),
    *("force_interval_s", "force_noise_intensity_N2_s", "tracking_noise_m", "wall_share"),
    *("tracking_noise_m_interval", "warnings"),
)


@pytest.mark.slow
def test_json_holds_what_is_promised(fitted: tuple[Path, Done]) -> None:
    found = answer(fitted[1])
    assert set(REQUIRED) <= found.keys()
    assert found["force_interval_s"] == 0.016
    assert found["duration_s"] == pytest.approx(300.0)
    assert found["outliers"] == found["jumps_removed"] == found["dropped_frames"] == 0
    for key in ("drag_coefficient", "force_std_N", "tracking_noise_m"):
        low, high = found[f"{key}_interval"]
        assert low < found[key] < high
    truth = dw.tank30_truth()
    # Five minutes: C_d has an sd of some 10 %, the others of 4 and 1 %; 4 sd each.
    assert found["drag_coefficient"] == pytest.approx(truth["drag_coefficient"], rel=0.5)
    assert found["force_std_N"] == pytest.approx(truth["force_std_N"], rel=0.12)
    assert found["tracking_noise_m"] == pytest.approx(truth["tracking_noise_m"], rel=0.05)


@pytest.mark.slow
def test_defaults_that_decide_a_number_are_said_and_warned_of(fitted: tuple[Path, Done]) -> None:
    opening = "block of side 3 cm (default); mass 11.6 g (default); wetted depth 3 cm (default); "
    assert f"{opening}force redrawn every 16 ms (--force-interval)\n" in fitted[1].err
    warnings = [text for text in answer(fitted[1])["warnings"] if " not stated: " in text]
    assert len(warnings) == 1
    assert warnings[0].endswith("state --mass, --side and --tank")


@pytest.mark.slow
def test_the_run_directory_is_whole(fitted: tuple[Path, Done]) -> None:
    folder = fitted[0]
    for name in ("fit.nc", "flow.nc", "recording.nc", "manifest.json"):
        assert (folder / name).stat().st_size > 0
    for name in ("flow", "trajectory"):
        assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
        assert (folder / "figures" / f"{name}.svg").stat().st_size > 1000
    with xr.open_dataset(folder / "fit.nc", engine="h5netcdf") as stored:
        assert stored.attrs["kind"] == "fit"
        assert facts_of(stored)["drag_coefficient"] == answer(fitted[1])["drag_coefficient"]
        flow = dw.load_flow(folder / "flow.nc")
        assert dw.fitted_flow(stored)["u"].values == pytest.approx(flow["u"].values)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_simulate_and_assemble_take_its_flow(fitted: tuple[Path, Done], tmp_path: Path) -> None:
    flow = fitted[0] / "flow.nc"
    done = here("simulate", "--flow", flow, "--duration", "5s", "-o", tmp_path / "run.nc")
    assert done.code == 0, done.err
    options = ("--blocks", "2", "--runs", "4", "--duration", "5s", "--film", "none")
    done = here("assemble", "--flow", flow, *options, "-o", tmp_path / "blocks")
    assert done.code == 0, done.err


@pytest.mark.slow
def test_a_finished_run_is_not_done_again(fitted: tuple[Path, Done]) -> None:
    done = here(*FIT, "-o", fitted[0])
    assert done.code == 2
    assert "--overwrite" in done.err


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_several_recordings(fitted: tuple[Path, Done], tmp_path: Path) -> None:
    done = here("fit", SECOND, *FIT[1:], "-o", tmp_path / "two", "--json")
    both, one = answer(done), answer(fitted[1])
    assert both["recordings"] == 2
    assert both["duration_s"] == pytest.approx(600.0)
    assert (tmp_path / "two" / "recording-2.nc").stat().st_size > 0
    widths = [np.ptp(np.log(found["drag_coefficient_interval"])) for found in (both, one)]
    assert widths[0] < 0.9 * widths[1]


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_people_read_the_answer(tmp_path: Path) -> None:
    done = here(*FIT, "--to", "100", "-o", tmp_path / "run", "--angle", "none", "--wall")
    assert done.code == 0, done.err
    assert "drag coefficient C_d" in done.out
    assert "redrawn every 16 ms" in done.out
    assert "no orientation was used" in done.err
    (wall,) = [line for line in done.out.splitlines() if line.startswith("wall ")]
    assert "needs the orientation" in wall
    assert wall.endswith("(--columns), and fit with --angle state")


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--to", "5s"), "has 51 positions"),
        (("--to", "0.1s"), "at least 3 are needed"),
        (("--tank", "12cm"), "outside the tank"),
        (("--angle", "sideways"), "--angle"),
        (("--confidence", "2"), "confidence"),
        (("--spline-spacing", "-1cm"), "--spline-spacing"),
        (("--body", "nobody"), "no such body"),
    ],
)
def test_mistakes_are_one_line(options: tuple[str, ...], words: str, tmp_path: Path) -> None:
    done = here("fit", RECORDING, "-o", tmp_path / "run", *options)
    assert words in refusal(done)
    assert not (tmp_path / "run").exists()
