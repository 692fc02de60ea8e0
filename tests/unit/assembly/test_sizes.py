"""Sizes of assemblies, against counts over worlds on the lattice that are made in another way."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import xarray as xr
from lattice_runs import UNIT, Run, random_run
from scipy import stats
from synthetic_assembly import free_polyominoes

from driftwalk.assembly import assembly_sizes, replay_events
from driftwalk.assembly.outcomes.sizes import compactness
from driftwalk.core.errors import InputError

DURATION = 50.0


def times_of(run: Run) -> list[float]:
    """The events come at 1, 2, ... s."""
    return [float(event) for event in range(1, len(run.worlds))]


def dataset(runs: list[Run], blocks: int) -> xr.Dataset:
    """Return the `assembly` of such runs."""
    slots = blocks - 1
    block = np.full((len(runs), slots, 2), -1)
    face, time = block.copy(), np.full((len(runs), slots), np.nan)
    cell = np.zeros((len(runs), blocks, 2), dtype=int)
    quarter, label = (np.zeros((len(runs), blocks), dtype=int) for _ in range(2))
    for index, run in enumerate(runs):
        number = len(run.blocks)
        if number:
            block[index, :number], face[index, :number] = run.blocks, run.faces
            time[index, :number] = times_of(run)
        for lowest, members in run.worlds[-1].assemblies.items():
            for one, (place, turned) in members.items():
                cell[index, one] = (round(place.real), round(place.imag))
                quarter[index, one], label[index, one] = turned, lowest
    made = replay_events(
        [len(run.blocks) for run in runs], block, face, cell=cell, quarter=quarter, assembly=label
    )
    return xr.Dataset(
        {
            "outcome": ("run", made.outcome),
            "event_time": (("run", "event"), time),
            "event_shape": (("run", "event", "part"), made.event_shape),
        },
        coords={"class": list(made.classes), "shape": list(made.shapes)},
        attrs={"kind": "assembly", "blocks": blocks, "duration_s": DURATION},
    )


def perimeter(cells: set[complex]) -> int:
    return sum(cell + step not in cells for cell in cells for step in UNIT)


def least_perimeter(n: int) -> int:
    """Return the least of all rectangles that n squares fit into."""
    return min(2 * (a + -(-n // a)) for a in range(1, n + 1))


def sizes_in(world: object) -> list[int]:
    return [len(members) for members in world.assemblies.values()]  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    rng = np.random.default_rng(5)
    return [random_run(20, rng, stop=1.5) for _ in range(12)]


def test_what_stands_at_the_end_is_what_a_count_over_the_worlds_gives(runs: list[Run]) -> None:
    found = assembly_sizes(dataset(runs, 20))
    assert found["size"].values.tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 9, 17]
    assert found["size_to"].values.tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 16, 20]
    counted = [Counter(sizes_in(run.worlds[-1])) for run in runs]
    for first, last, number, share in zip(
        *(found[name].values for name in ("size", "size_to", "number", "block_share")), strict=True
    ):
        group = range(first, last + 1)
        per_run = [sum(count[size] for size in group) for count in counted]
        blocks = [sum(size * count[size] for size in group) for count in counted]
        assert number == pytest.approx(np.mean(per_run))
        assert share == pytest.approx(np.mean(blocks) / 20)
    assert float(found["block_share"].sum()) == pytest.approx(1.0)


def test_the_growth_is_what_the_worlds_were_at_each_time(runs: list[Run]) -> None:
    """An event at that very time has happened."""
    times = [0.0, 0.5, 1.0, 4.0, 9.5, 30.0]
    found = assembly_sizes(dataset(runs, 20), times=times, confidence=0.8)
    for at, time in enumerate(times):
        then = [run.worlds[sum(one <= time for one in times_of(run))] for run in runs]
        sizes = [sizes_in(world) for world in then]
        for name, per_run in {
            "mean_size": [np.mean(row) for row in sizes],
            "largest_share": [max(row) / 20 for row in sizes],
            "free_share": [row.count(1) / 20 for row in sizes],
        }.items():
            one = found.isel(time=at)
            assert float(one[name]) == pytest.approx(np.mean(per_run))
            if np.ptp(per_run) > 0:
                low, high = stats.t.interval(
                    0.8, len(runs) - 1, loc=np.mean(per_run), scale=stats.sem(per_run)
                )
                most = 20.0 if name == "mean_size" else 1.0
                assert float(one[f"{name}_low"]) == pytest.approx(max(low, 0.0))
                assert float(one[f"{name}_high"]) == pytest.approx(min(high, most))


def compactness_of(world: object) -> float:
    """By definition: the least perimeter over that of the cells, of four blocks and more."""
    shapes = [
        {place for place, _ in members.values()}
        for members in world.assemblies.values()  # type: ignore[attr-defined]
        if len(members) >= 4
    ]
    if not shapes:
        return float("nan")
    ratio = [least_perimeter(len(cells)) / perimeter(cells) for cells in shapes]
    return float(np.average(ratio, weights=[len(cells) for cells in shapes]))


def test_compactness_is_that_of_the_cells(runs: list[Run]) -> None:
    per_run = [one for run in runs if (one := compactness_of(run.worlds[-1])) == one]
    found = assembly_sizes(dataset(runs, 20)).attrs
    assert found["compactness"] == pytest.approx(np.mean(per_run))
    assert found["compactness_runs"] == len(per_run)
    assert found["compactness_low"] < found["compactness"] < found["compactness_high"] <= 1.0


def test_compactness_over_time_leaves_out_runs_that_have_none_yet(runs: list[Run]) -> None:
    times = [0.0, 2.0, 9.5, 12.0, 15.0, 30.0]
    found = assembly_sizes(dataset(runs, 20), times=times)
    known = []
    for at, time in enumerate(times):
        then = [run.worlds[sum(one <= time for one in times_of(run))] for run in runs]
        values = np.array([compactness_of(world) for world in then])
        own = values[np.isfinite(values)]
        known.append(own.size)
        one = found.isel(time=at)
        expected = own.mean() if own.size else np.nan
        assert float(one["compactness"]) == pytest.approx(expected, nan_ok=True)
        if own.size > 1 and np.ptp(own) > 0:
            reach = stats.t.ppf(0.95, own.size - 1) * stats.sem(own)
            assert float(one["compactness_low"]) == pytest.approx(max(own.mean() - reach, 0.0))
    assert known[0] == 0
    assert any(0 < one < len(runs) for one in known)


@pytest.mark.parametrize("size", range(4, 8))
def test_the_most_compact_of_all_polyominoes_has_one(size: int) -> None:
    values = [compactness(name) for name in free_polyominoes(size)]
    assert max(values) == 1.0
    row = compactness("x" * size)
    assert (
        min(values) == pytest.approx(row) == pytest.approx(least_perimeter(size) / (2 * size + 2))
    )


def test_two_blocks() -> None:
    """In two of five runs they join, at 10 and at 30 s."""
    none = [-1, -1, -1]
    two = xr.Dataset(
        {
            "event_time": (("run", "event"), [[10.0], [30.0], [np.nan], [np.nan], [np.nan]]),
            "event_shape": (("run", "event", "part"), [[[0, 0, 1]], [[0, 0, 1]], *[[none]] * 3]),
            "outcome": ("run", [0, 0, 1, 1, -1]),
        },
        coords={"class": ["2", "1+1"], "shape": ["1", "2"]},
        attrs={"kind": "assembly", "blocks": 2, "duration_s": DURATION},
    )
    found = assembly_sizes(two, times=[0.0, 10.0, 50.0])
    assert found["number"].values.tolist() == [1.0, 0.5]
    assert found["block_share"].values.tolist() == [0.5, 0.5]
    assert found["mean_size"].values.tolist() == [1.0, 1.25, 1.5]
    assert found["largest_share"].values.tolist() == [0.5, 0.625, 0.75]
    assert found["free_share"].values.tolist() == [1.0, 0.75, 0.5]
    assert (found.attrs["runs"], found.attrs["left_out"]) == (4, 1)
    assert found.attrs["compactness_runs"] == 0
    assert np.isnan(found.attrs["compactness"])


def test_a_single_run_has_no_interval(runs: list[Run]) -> None:
    found = assembly_sizes(dataset(runs[:1], 20))
    assert np.isfinite(found["mean_size"]).all()
    assert np.isnan(found["mean_size_low"]).all()
    assert np.isnan(found["number_high"]).all()


@pytest.mark.slow
def test_intervals_hold_as_often_as_they_say() -> None:
    """Blocks pair or not by a coin: the mean of the shares is known here."""
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(80):
        joined = rng.random(30) < 0.4
        sample = xr.Dataset(
            {
                "event_time": (("run", "event"), np.where(joined, 1.0, np.nan)[:, np.newaxis]),
                "event_shape": (
                    ("run", "event", "part"),
                    np.where(joined[:, np.newaxis], [0, 0, 1], -1)[:, np.newaxis],
                ),
                "outcome": ("run", np.where(joined, 0, 1)),
            },
            coords={"class": ["2", "1+1"], "shape": ["1", "2"]},
            attrs={"kind": "assembly", "blocks": 2, "duration_s": DURATION},
        )
        end = assembly_sizes(sample, times=[DURATION]).isel(time=0)
        held += float(end["free_share_low"]) <= 0.6 <= float(end["free_share_high"])
    # Binomial(80, 0.9): within three standard deviations, of which one is 2.7.
    assert 64 <= held <= 79


@pytest.mark.parametrize("confidence", [0.0, 1.0, 1.5])
def test_a_confidence_out_of_range_is_refused(runs: list[Run], confidence: float) -> None:
    with pytest.raises(InputError, match="confidence must lie between 0 and 1"):
        assembly_sizes(dataset(runs, 20), confidence=confidence)


def test_runs_without_any_outcome_are_refused(runs: list[Run]) -> None:
    broken = dataset(runs, 20)
    broken["outcome"][:] = -1
    with pytest.raises(InputError, match="no run with an outcome"):
        assembly_sizes(broken)
