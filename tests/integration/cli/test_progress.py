"""The progress of every command of several stages: one bar, which never goes back."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from command_line import GRID, RECORDING, here
from few_simulations import compare_after_little, simulate_little

from driftwalk.cli.terminal.progress import ProgressReporter

Shares = Callable[..., list[float]]
TANK = ("--tank", "30cm")
BLOCKS = ("--blocks", "2", "--runs", "4", "--duration", "2s")


@pytest.fixture
def shares(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Shares:
    """Return a function that runs a command and gives what its bar was told."""

    def of(*words: object) -> list[float]:
        told: list[float] = []

        def hear(_: Any, done: float, total: float, text: str = "") -> None:
            told.append(done / total)

        with monkeypatch.context() as patch:
            patch.setattr(ProgressReporter, "__call__", hear)
            done = here(*words, "-o", tmp_path / "run", "--overwrite")
        assert done.code == 0, done.err
        return told

    return of


def assert_forward(told: list[float]) -> None:
    assert len(told) > 2
    assert all(one <= after for one, after in pairwise(told)), told
    assert told[0] < 0.5
    assert 0.7 < told[-1] <= 1.0


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_fit_with_all_that_it_can_do(shares: Shares) -> None:
    words = ("--to", "60s", "--compare-laws", "--wall", "--spline-spacing", "3cm")
    assert_forward(shares("fit", RECORDING, *TANK, *words))


@pytest.mark.study
@pytest.mark.usefixtures("no_figures")
def test_fit_that_searches_pieces_first(shares: Shares) -> None:
    """In every run: a fit with more stages, without pieces."""
    words = ("--from", "0", "--to", "1200s", "--spline-spacing", "3cm")
    assert_forward(shares("fit", RECORDING, *TANK, *words, "--no-check"))


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_calibrate_assemble_and_sensitivity(shares: Shares, tmp_path: Path) -> None:
    (tmp_path / "grid.toml").write_text(GRID, encoding="utf-8")
    grid = ("--study", tmp_path / "grid.toml", "--threads", "1")
    assert_forward(shares("calibrate", RECORDING, *TANK, "--to", "60s", *grid))
    (tmp_path / "run").rename(tmp_path / "calibrated")
    # The drawn parameters are simulated after the best ones: the bar began again there.
    assert_forward(shares("assemble", tmp_path / "calibrated", *BLOCKS, "--film", "none"))
    vary = ("--vary", "latching=collision,none", "--realisations", "2")
    assert_forward(shares("sensitivity", tmp_path / "calibrated", *BLOCKS, *vary))


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_models(shares: Shares, monkeypatch: pytest.MonkeyPatch) -> None:
    compare_after_little(monkeypatch)
    words = (RECORDING, *TANK, "--to", "60s", "--bootstrap", "10")
    assert_forward(shares("compare-models", *words, "--models", "inertial,active"))
    simulate_little(monkeypatch)
    assert_forward(shares("calibrate", *words, "--model", "run_tumble"))


@pytest.mark.slow
def test_fit_prints_its_answer_before_it_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The estimate first, then the verdict, then the places; nothing drawn before the verdict."""
    import driftwalk.figures
    from driftwalk.cli.main import main

    drawn: list[str] = []

    def draw(*_: Any, **__: Any) -> list[Path]:
        drawn.append(capsys.readouterr().out)
        return []

    monkeypatch.setattr(driftwalk.figures, "write_figures", draw)
    coarse = ("--to", "60s", "--spline-spacing", "3cm")
    words = ["fit", str(RECORDING), *TANK, *coarse, "-o", str(tmp_path / "run")]
    assert main(words) == 0
    assert "drag coefficient" in drawn[0]
    assert "verdict" in drawn[0]
    assert drawn[0].index("drag coefficient") < drawn[0].index("verdict")
    assert "flow.nc" in capsys.readouterr().out
