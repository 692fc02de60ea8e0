"""How work is cut into units: large enough to be worth sending, small enough for many workers."""

from __future__ import annotations

from hypothesis import given, strategies as st

from driftwalk.sweep.design import CUT, settings_per_unit

SETTINGS = st.integers(1, 200_000)
STEPS = st.floats(1.0, 1e12)


def cut(settings: int, block_steps: float) -> tuple[int, float]:
    """Return how many units there are, and how long one takes [s]."""
    size = settings_per_unit(settings, block_steps)
    return -(-settings // size), size * block_steps / CUT.block_steps_per_second


@given(settings=SETTINGS, block_steps=STEPS)
def test_no_unit_is_larger_than_can_be_lost(settings: int, block_steps: float) -> None:
    _, seconds = cut(settings, block_steps)
    assert seconds <= CUT.largest_s or settings_per_unit(settings, block_steps) == 1


@given(settings=SETTINGS, block_steps=STEPS)
def test_there_are_units_for_some_workers(settings: int, block_steps: float) -> None:
    units, _ = cut(settings, block_steps)
    assert units >= min(settings, CUT.fewest)


@given(settings=SETTINGS, block_steps=STEPS)
def test_units_are_no_smaller_than_need_be(settings: int, block_steps: float) -> None:
    """A second of work, unless many workers or the fewest units ask for less."""
    units, seconds = cut(settings, block_steps)
    one = block_steps / CUT.block_steps_per_second
    assert seconds + one > min(CUT.smallest_s, settings * one / CUT.fewest)
    if seconds + one < CUT.smallest_s:
        assert units <= 2 * CUT.fewest


def test_long_work_has_units_of_the_largest_size() -> None:
    # 10,000 settings of 4 s each: 11 hours of one core.
    units, seconds = cut(10_000, 4.0 * CUT.block_steps_per_second)
    assert (units, seconds) == (1000, 40.0)


def test_work_of_an_hour_is_cut_for_many_workers() -> None:
    # 961 settings of 1000 runs of 4 blocks for 5 minutes, as in the paper.
    units, seconds = cut(961, 1000 * 4 * 30_000.0)
    assert CUT.many <= units <= 1.5 * CUT.many
    assert 10.0 < seconds < 20.0


def test_groups_stay_together() -> None:
    assert settings_per_unit(1000, 120_000.0, multiple=25) == 50
    assert settings_per_unit(3, 1.0, multiple=25) == 25
