"""A number of the law stays open only where the undisturbed part of the recording asks for it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from fit_worlds import coarse_study, recording

from driftwalk.flow.arena import outline_of
from driftwalk.likelihood import fit as fitting
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.law.confounders import objections_to
from driftwalk.likelihood.law.forward_selection import least_effects
from driftwalk.likelihood.newton import Mode
from driftwalk.likelihood.preparation import PreparedRecordings, prepare

Value = tuple[float, float]


def mode(value: Value, *, converged: bool = True) -> Mode:
    found = SimpleNamespace(value_of=lambda _: value, converged=converged, point=None, weights=None)
    return cast(Mode, found)


def series(left_out: float) -> Series:
    """Return a thousand samples of which some are left out."""
    time = 0.1 * np.arange(1000)
    excluded = (np.arange(1000) < 1000 * left_out).astype(np.uint8)
    return Series(time, time, time, time, time, excluded)


def objection(alone: Mode | None, *, left_out: float = 0.6) -> str:
    """Return why a power of 2.47 ± 0.02 was not opened, given what is found without the wall."""
    passes = SimpleNamespace(series=[series(0.0)], flows=2)
    search: Any = SimpleNamespace(passes=passes)
    search.of = lambda _: SimpleNamespace(shortened=lambda: SimpleNamespace(find=find))

    def find(*_: Any, **__: Any) -> Mode | None:
        return alone

    selection: Any = SimpleNamespace(
        search=search, least=least_effects(0.03), scores=SimpleNamespace(passes=passes)
    )
    found = objections_to(mode((2.47, 0.02)), ["drag_power"], selection, lambda: [series(left_out)])
    return found.get("drag_power", "")


def test_a_power_that_the_contacts_imitate_is_not_opened() -> None:
    """Without them it is 2 within its error; or other than it was; or not to be had."""
    assert "2.47 ± 0.02 was not opened: in the 40 % of the intervals" in objection(
        mode((2.05, 0.05))
    )
    assert "it is 2.8 ± 0.03" in objection(mode((2.8, 0.03)))
    assert "do not determine it" in objection(None)
    assert "do not determine it" in objection(mode((2.47, 0.05), converged=False))


def test_a_power_that_is_the_same_without_them_stays() -> None:
    assert objection(mode((2.44, 0.05))) == ""


def test_where_nothing_disturbs_nothing_is_tried() -> None:
    assert objection(None, left_out=0.01) == ""


@pytest.fixture(scope="module")
def ready() -> PreparedRecordings:
    track = recording(200.0)
    gap = np.delete(np.arange(track.sizes["time"]), np.arange(900, 905))
    return prepare([track.isel(time=gap)], coarse_study(), None, None)


def test_the_undisturbed_part_is_half_a_side_from_the_wall_and_not_next_to_a_gap(
    ready: PreparedRecordings,
) -> None:
    """The corners at the beginning of each interval, from the angle by hand."""
    (one,) = ready.undisturbed()
    side = ready.study.block.side_m
    outline = outline_of(ready.study.tank.to_arena())
    quarters = one.angle[:, None] + np.pi * (0.25 + 0.5 * np.arange(4))
    reach = side / np.sqrt(2.0)
    x, y = one.x[:, None] + reach * np.cos(quarters), one.y[:, None] + reach * np.sin(quarters)
    depth = np.min([outline.depth(x[:, k], y[:, k]) for k in range(4)], axis=0)
    free = np.flatnonzero(one.excluded[1:] == 0)
    assert 0 < free.size < np.count_nonzero(ready.series[0].excluded == 0)
    assert depth[free].min() >= 0.5 * side
    assert one.excluded[900:904].all()


def test_the_intervals_hold_those_of_a_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    ours = {"drag_coefficient": 0.4, "drag_coefficient_interval": [0.3, 0.5]}
    theirs = {"drag_coefficient": 0.6, "drag_coefficient_interval": [0.4, 0.9]}
    monkeypatch.setattr(fitting, "_parameter_facts", lambda *_: theirs)
    monkeypatch.setattr(fitting, "restricted_drag", lambda *_: None)
    alternative: Any = None
    assert fitting._with_alternative(ours, alternative, alternative, alternative) == {
        "drag_coefficient": 0.4,
        "drag_coefficient_interval": [0.3, 0.9],
    }
