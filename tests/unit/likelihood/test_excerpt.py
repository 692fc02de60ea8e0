"""Excerpts of recordings, on which a search comes near its end."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fit_worlds import coarse_study, driven

from driftwalk.flow.arena import outline_of
from driftwalk.likelihood import newton
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Body
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.fit import fit_motion
from driftwalk.likelihood.newton import EXCERPT, beginning, pieces, thinned
from driftwalk.likelihood.preparation import series_of
from driftwalk.likelihood.spline import lay_spline
from driftwalk.schema import body_track


def _passes(seconds: float) -> Passes:
    study = coarse_study()
    outline = outline_of(study.tank.to_arena())
    track = body_track(driven(1, seconds, {}))
    series = series_of([track], study, "state")
    return Passes(series, Body(study, "state"), lay_spline(outline, side=0.03, spacing=0.03))


@pytest.mark.slow
def test_pieces_come_from_all_over_a_long_recording() -> None:
    few = pieces(_passes(0.11 * EXCERPT.worth_factor * EXCERPT.near_samples))
    assert few is not None
    assert {one.time.size for one in few} == {EXCERPT.piece_samples}
    assert len(few) == EXCERPT.near_samples // EXCERPT.piece_samples
    whole = _passes(0.11 * EXCERPT.worth_factor * EXCERPT.near_samples).series[0]
    first = [one.time[0] for one in few]
    assert first[0] == whole.time[0]
    assert few[-1].time[-1] == whole.time[-1]
    assert np.ptp(np.diff(first)) < 0.2
    assert np.min(np.diff(first)) > 0.1 * EXCERPT.piece_samples


def test_a_short_recording_is_searched_as_a_whole() -> None:
    assert pieces(_passes(60.0)) is None


def test_of_many_short_recordings_little_would_be_left_out() -> None:
    passes = _passes(60.0)
    assert pieces(replace(passes, series=40 * passes.series)) is None
    long = _passes(600.0)
    few = pieces(replace(long, series=5 * long.series))
    assert few is not None
    assert sum(one.time.size for one in few) == 5 * 2 * EXCERPT.piece_samples


def test_a_thinned_series_leaves_out_what_it_holds_of_left_out_intervals() -> None:
    series = _passes(60.0).series[0]
    series.excluded[[0, 7, 200, 201, 599]] = 1
    thin = series.thinned(0.3)
    np.testing.assert_array_equal(thin.time, series.time[::3])
    held = [series.excluded[max(k - 2, 0) : k + 1].max() for k in range(0, series.time.size, 3)]
    np.testing.assert_array_equal(thin.excluded[:-1], held[:-1])
    assert series.thinned(0.1) is series


@pytest.mark.slow
def test_a_law_searched_on_samples_further_apart_gives_the_same_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each ends within 0.15 standard deviations of the mode of all samples."""
    recording = driven(1, 90.0, {}, interval=0.02)
    study = coarse_study()
    found = fit_motion(recording, study)
    monkeypatch.setattr(newton, "EXCERPT", EXCERPT._replace(interval_s=0.0))
    whole = fit_motion(recording, study)
    assert int(found["samples_used"]) == int(whole["samples_used"]) > 2000
    width = np.ptp(whole["interval"].values, axis=1) / 3.29
    apart = np.abs(found["estimate"].values - whole["estimate"].values)
    known = ~np.isin(whole["parameter"].values, ["force_lever", "added_mass_share"])
    assert (apart < 0.3 * width)[known].all()


@pytest.mark.study
def test_a_search_by_way_of_pieces_ends_where_one_of_the_whole_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each ends within 0.15 standard deviations of the mode, as its last step is below 0.25.

    In every run the fit of the front page, of half an hour, begins with pieces.
    """
    study = coarse_study()
    recording = driven(1, 1200.0, {})
    found = fit_motion(recording, study)
    # Two steps without the noises, two with them, and what the last nat takes.
    assert int(found["iterations"]) <= 6
    monkeypatch.setattr(newton, "pieces", lambda passes: None)
    whole = fit_motion(recording, study)
    assert int(whole["iterations"]) > int(found["iterations"])
    width = np.ptp(whole["interval"].values, axis=1) / 3.29
    apart = np.abs(found["estimate"].values - whole["estimate"].values)
    # The lever may be known from its prior alone, and the added mass is stated.
    found_out = ~np.isin(whole["parameter"].values, ["force_lever", "added_mass_share"])
    assert (apart < 0.3 * width)[found_out].all()


def of_samples(*sizes: int, interval: float = 0.1, flows: int = 1) -> Any:
    """Return recordings of so many samples; the x of a sample is its number, y its recording."""
    series = []
    for number, size in enumerate(sizes):
        index = np.arange(float(size))
        left_out = np.zeros(size, dtype=np.uint8)
        series.append(
            Series(
                interval * index, index, 0.0 * index + number, index, index, left_out, angle=index
            )
        )
    return SimpleNamespace(series=series, flows=flows)


def spans(found: Any) -> list[tuple[int, int, int]]:
    """Return recording, first sample and the sample after the last of each series."""
    return [(int(one.y[0]), int(one.x[0]), int(one.x[-1]) + 1) for one in found]


def test_each_recording_gives_pieces_in_proportion_to_its_length() -> None:
    """Of 30,000 samples 3600 in pieces of 300: one in 2500 samples, one at least."""
    few = pieces(of_samples(250, 20_000, 301, 1000, 10_000, 300))
    assert few is not None
    found = spans(few)
    # What is as short as a piece is one; the middle of a longer one, if it gives one alone.
    assert found[0] == (0, 0, 250)
    assert (2, 0, 300) in found
    assert (3, 350, 650) in found
    assert found[-1] == (5, 0, 300)
    for recording, size, count in ((1, 20_000, 8), (4, 10_000, 4)):
        own = [one for one in found if one[0] == recording]
        assert len(own) == count
        first, end = np.array([one[1:] for one in own]).T
        assert (end - first == EXCERPT.piece_samples).all()
        assert (first[0], end[-1]) == (0, size)
        assert np.ptp(np.diff(first)) <= 1
    assert len(found) == 16


@pytest.mark.parametrize(("samples", "some"), [(8999, False), (9000, True)])
def test_pieces_are_worth_their_search_where_they_are_two_fifths(samples: int, some: bool) -> None:
    assert (pieces(of_samples(samples)) is not None) == some


def test_laws_are_compared_on_the_first_three_thousand_samples() -> None:
    assert spans(beginning(of_samples(2000, 700, 2000, 500))) == [
        (0, 0, 2000), (1, 0, 700), (2, 0, 300)
    ]  # fmt: skip
    # A little more than that is not cut, and flows are told from each other by all samples.
    for whole in (of_samples(1800, 1800), of_samples(4000, 4000, flows=2)):
        assert beginning(whole) is whole.series


def test_a_fast_camera_is_thinned_and_a_slow_one_is_left_as_it_is() -> None:
    passes = _passes(60.0)
    assert thinned(passes) is passes
    fast = replace(passes, series=of_samples(100, interval=0.02).series)
    (thin,) = thinned(fast).series
    np.testing.assert_array_equal(thin.x, np.arange(0, 100, 5))
    assert thinned(fast).body is passes.body
