"""A table that jumps is warned of by every command that works with it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import GRID, RECORDING, Done, here, leave_out_figures, refusal
from few_simulations import compare_after_little

from driftwalk.record import load
from driftwalk.schema import body_track

TANK = ("--tank", "30cm")


@pytest.fixture(scope="module")
def jumping(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return two pieces of the bundled recording as one: between them the body is elsewhere."""
    track = body_track(load(RECORDING))
    first = slice(0, 900)
    far = np.hypot(track.x - track.x[899], track.y - track.y[899])
    start = int(np.argmax(far[:-900]))
    rows = np.r_[first, start : start + 900]
    path = tmp_path_factory.mktemp("jumping") / "two.csv"
    table = np.column_stack(
        [np.arange(rows.size) / 30.0, track.x[rows], track.y[rows], track.theta[rows]]
    )
    np.savetxt(path, table, delimiter=",", header="t_s,x_m,y_m,theta_rad", comments="")
    return path


@pytest.fixture(autouse=True)
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    leave_out_figures(monkeypatch)


def warned(done: Done) -> dict:
    assert done.code == 0, done.err
    said = json.loads(done.out)
    (warning,) = [text for text in said["warnings"] if " jumps " in text]
    assert "jumps once" in warning
    assert "several bodies? Name the column that tells them apart (--columns body=NAME)" in warning
    assert "--max-speed " in warning
    return said


def test_info(jumping: Path) -> None:
    said = warned(here("info", jumping, "--json"))
    assert said["counts"]["impossible_steps"] == 1
    shown = here("info", jumping)
    assert "impossible steps left" in shown.out
    assert "warning: body '0' jumps once" in shown.err
    assert "--max-speed" in shown.err


def test_what_is_refused_is_one_line(jumping: Path, tmp_path: Path) -> None:
    words = ("--flow", tmp_path / "no.nc", "-o", tmp_path / "run")
    assert "no.nc" in refusal(here("calibrate", jumping, *TANK, *words))


@pytest.mark.slow
def test_fit(jumping: Path, tmp_path: Path) -> None:
    words = ("--spline-spacing", "5cm", "--no-check", "-o", tmp_path / "run", "--json")
    warned(here("fit", jumping, *TANK, *words))


@pytest.mark.slow
def test_calibrate(jumping: Path, tmp_path: Path) -> None:
    (tmp_path / "grid.toml").write_text(GRID)
    words = ("--study", tmp_path / "grid.toml", "-o", tmp_path / "run", "--json")
    done = here("calibrate", jumping, *TANK, *words)
    warned(done)
    # Before the work, too: it may take hours.
    assert "warning: body '0' jumps once" in done.err


@pytest.mark.slow
def test_compare_models(jumping: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compare_after_little(monkeypatch)
    words = ("--models", "inertial", "--bootstrap", "0", "-o", tmp_path / "run", "--json")
    done = here("compare-models", jumping, *TANK, *words)
    warned(done)
    assert "warning: body '0' jumps once" in done.err
