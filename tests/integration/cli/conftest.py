"""Runs without their figures, which take most of the time of a short one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from command_line import FIGURE_WRITERS


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


def leave_out_figures(patch: pytest.MonkeyPatch) -> None:
    """Put functions that draw nothing in the place of those that a command calls."""
    for name in FIGURE_WRITERS:
        patch.setattr(f"driftwalk.{name}", lambda *folders, **datasets: [])
