"""Cleaning: what is dropped, what becomes a gap, and what is counted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import describe, load
from driftwalk.record.cleaning import clean
from driftwalk.record.cleaning.clean import clean_body
from driftwalk.record.raw import RawBody
from driftwalk.schema import body_track


def body(time: Any, x: Any, y: Any = None) -> RawBody:
    x = np.array(x, dtype=float)
    return RawBody("0", np.array(time, dtype=float), x, x * 0 if y is None else np.array(y, float))


def test_of_duplicate_times_the_last_row_is_kept() -> None:
    cleaned, counts = clean_body(body([0, 1, 1, 1, 2], [0, 1, 2, 3, 4]), separate=True)
    np.testing.assert_array_equal(cleaned.clock, [0, 1, 2])
    np.testing.assert_array_equal(cleaned.x, [0, 3, 4])
    assert (counts.rows, counts.duplicates_dropped, counts.samples) == (5, 2, 3)
    assert counts.times_in_two_places == 1


def test_unsorted_times_are_an_error_unless_sorting_is_asked_for() -> None:
    with pytest.raises(
        InputError, match=r"row 3 of body '0': 2 s is followed by 1 s.*`sort=\"sort\"`"
    ):
        clean_body(body([0, 2, 1, 3], [0, 2, 1, 3]))
    cleaned, counts = clean_body(body([0, 2, 1, 3], [0, 2, 1, 3]), sort="sort")
    np.testing.assert_array_equal(cleaned.x, [0, 1, 2, 3])
    assert counts.unsorted == 1
    with pytest.raises(InputError, match="'error' or 'sort'"):
        clean_body(body([0, 1], [0, 1]), sort="yes")


def test_sorting_keeps_the_last_of_duplicate_times_in_the_file() -> None:
    cleaned, _ = clean_body(body([1, 0, 1], [10, 0, 11]), sort="sort", separate=True)
    np.testing.assert_array_equal(cleaned.x, [0, 11])


def test_rows_without_time_and_positions_that_are_not_finite() -> None:
    cleaned, counts = clean_body(body([0, np.nan, 1, 2], [0, 1, np.inf, 3], [0, 0, 0, np.nan]))
    np.testing.assert_array_equal(cleaned.clock, [0, 1, 2])
    np.testing.assert_array_equal(np.isfinite(cleaned.x), [True, False, False])
    np.testing.assert_array_equal(np.isfinite(cleaned.y), [True, False, False])
    assert (counts.without_time, counts.missing, counts.samples) == (1, 2, 1)


def test_times_too_close_are_found_part_by_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each part is one longer than the others begin apart, so that no difference is left out."""
    sizes: list[int] = []
    difference = np.diff

    def counted(values: np.ndarray) -> np.ndarray:
        sizes.append(values.size)
        return difference(values)

    monkeypatch.setattr(clean, "PART", 4)
    monkeypatch.setattr(clean.np, "diff", counted)
    time = np.arange(11.0)
    clean._refuse_closest(body(time, time))
    assert sizes == [5, 5, 3]
    for close in range(10):
        time = np.arange(11.0)
        time[close + 1 :] += 1e-13 - 1.0
        with pytest.raises(InputError, match=rf"apart, at {close} s"):
            clean._refuse_closest(body(time, time))


def test_a_window_in_time() -> None:
    cleaned, counts = clean_body(body(range(10), range(10)), start=2.0, stop=5.0)
    np.testing.assert_array_equal(cleaned.clock, [2, 3, 4, 5])
    assert counts.outside_window == 6


def test_a_jump_becomes_a_gap_and_an_excursion_is_removed_whole() -> None:
    x = [0.0, 0.1, 0.2, 5.0, 5.1, 5.2, 0.6, 0.7]
    cleaned, counts = clean_body(body(range(8), x), max_speed=0.5)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(cleaned.x)), [3, 4, 5])
    assert counts.jumps_removed == 3
    assert counts.missing == 0
    with pytest.raises(InputError, match="`max_speed` must be above zero"):
        clean_body(body(range(8), x), max_speed=0.0)


def test_everything_is_counted_in_the_dataset(tmp_path: Path) -> None:
    path = tmp_path / "synthetic.csv"
    path.write_text("t,x,y\n0,0,0\n2,2,0\n1,1.5,0\n1,1.5,0\n3,,\n4,90,0\n5,5,0\n6,6,0\n")
    dataset = load(path, sort="sort", max_speed=3.0, stop=5.0)
    counts = json.loads(dataset.attrs["counts"])
    expected = {
        "rows_in_file": 8,
        "rows": 8,
        "without_time": 0,
        "unsorted": 1,
        "duplicates_dropped": 1,
        "times_in_two_places": 0,
        "outside_window": 1,
        "missing": 1,
        "jumps_removed": 1,
        "samples": 4,
    }
    assert {key: counts[key] for key in expected} == expected
    assert counts["per_body"]["0"]["jumps_removed"] == 1
    np.testing.assert_array_equal(body_track(dataset).x, [0.0, 1.5, 2.0, 5.0])
    with pytest.raises(InputError, match="`start` and `stop`"):
        load(path, sort="sort", start=100.0)


def test_describe_states_clock_gaps_and_speed(tmp_path: Path) -> None:
    time = np.delete(np.arange(200) * 0.1, slice(50, 60))
    rows = "\n".join(f"{t:.1f},{0.02 * t:.6f},0,{0.3 * t:.6f}" for t in time)
    (tmp_path / "a.csv").write_text("t,x,y,theta\n" + rows + "\n")
    described = describe(load(tmp_path / "a.csv"))
    found = described["bodies"]["0"]
    assert found["samples"] == 190
    assert found["rate_Hz"] == pytest.approx(10.0)
    assert (found["gaps"], found["longest_gap_s"]) == (1, pytest.approx(1.1))
    assert found["gap_time_share"] == pytest.approx(1.0 / 19.9)
    assert found["speed_mean_m_s"] == pytest.approx(0.02, rel=1e-3)
    assert found["turn_rate_mean_rad_s"] == pytest.approx(0.3, rel=1e-3)
    assert found["x_max_m"] == pytest.approx(0.02 * 19.9)
    assert described["counts"]["samples"] == 190
    json.dumps(described, allow_nan=False)


@pytest.mark.parametrize("text", ["t,x,y\n0,1,2\n", "t,x,y\n0,,\n1,,\n", "t,x,y\n0,1,2\n1,1,2\n"])
def test_describe_does_without_samples(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    described = describe(load(tmp_path / "a.csv"))
    assert described["bodies"]["0"]["position_noise_m"] is None
    json.dumps(described, allow_nan=False)
