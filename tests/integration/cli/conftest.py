"""A run that several test files look at, and runs without the figures, which take most of a run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import FIT, GRID, RECORDING, Done, here, leave_out_figures
from made_once import made_once, shared_folder


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return the run directory of a fit with its check and all figures, and what it printed."""
    folder = shared_folder("fit", tmp_path_factory.mktemp("fit")) / "run"
    return folder, made_once("fit", lambda: here(*FIT, "-o", folder, "--json"))


@pytest.fixture(scope="session")
def calibrated_minute(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return the run directory of a calibration of a minute without figures, and what it printed.

    It has a flow field of its own. Tests that change it take a copy.
    """
    place = shared_folder("calibrate", tmp_path_factory.mktemp("calibrate"))

    def make() -> Done:
        place.mkdir(exist_ok=True)
        (place / "study.toml").write_text(GRID, encoding="utf-8")
        with pytest.MonkeyPatch.context() as patch:
            leave_out_figures(patch)
            return here(
                *("calibrate", RECORDING, "--to", "60s", "--study", place / "study.toml"),
                *("--tank", "30cm", "--threads", "1", "--out", place / "run"),
            )

    done = made_once("calibrate", make)
    assert done.code == 0, done.err
    return place / "run", done


@pytest.fixture(scope="module")
def undrawn() -> Iterator[None]:
    """Leave out figures and films in this process until the module ends."""
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        yield


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out figures and films in this process for one test, which does not look at them."""
    leave_out_figures(monkeypatch)
