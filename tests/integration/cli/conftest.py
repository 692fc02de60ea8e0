"""A run that several test files look at, and runs without the figures, which take most of a run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import FIT, Done, here, leave_out_figures
from made_once import made_once, shared_folder


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return the run directory of a fit with its check and all figures, and what it printed."""
    folder = shared_folder("fit", tmp_path_factory.mktemp("fit")) / "run"
    return folder, made_once("fit", lambda: here(*FIT, "-o", folder, "--json"))


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
