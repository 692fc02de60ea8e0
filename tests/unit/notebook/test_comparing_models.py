"""`driftwalk.compare_models` in memory and in a run directory, and its words for mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr
from few_simulations import compare_after_little

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError, InputError


@pytest.fixture(scope="module")
def recorded() -> xr.Dataset:
    return dw.tank30_recording().sel(time=slice(0.0, 20.0))


@pytest.mark.slow
def test_a_folder_gives_what_memory_gives(
    recorded: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compare_after_little(monkeypatch)
    in_memory = dw.compare_models(recorded, "inertial", seed=3, threads=2)
    told: list[str] = []
    stored = dw.compare_models(
        recorded,
        ["inertial"],
        seed=3,
        folder=tmp_path / "run",
        progress=lambda done, total, text="": told.append(text),
    )
    assert repr(in_memory).splitlines()[0] == repr(stored).splitlines()[0]
    xr.testing.assert_identical(in_memory, stored)
    assert in_memory.attrs["seed"] == 3
    assert "inertial" in told
    assert (tmp_path / "run" / "figures" / "models.png").exists()


def test_mistakes_are_said(recorded: xr.Dataset) -> None:
    with pytest.raises(ConfigurationError, match="inertail"):
        dw.compare_models(recorded, "inertail")
    with pytest.raises(InputError, match="body"):
        dw.compare_models(recorded, "inertial", body="nobody")
