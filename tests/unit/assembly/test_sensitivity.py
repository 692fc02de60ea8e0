"""Outcomes over settings: every setting against `assemble` by hand, whatever the order.

The oracles are plain: `assemble` of one setting with the same random numbers, counting with
`collections.Counter`, medians by sorting, l1 distances by a loop.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
import xarray as xr
from small_sensitivity import FLOW, REALISATIONS, RUNS, by_hand, small

import driftwalk as dw
from driftwalk.assembly.runs.run import assemble
from driftwalk.assembly.sensitivity import settings as engine
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import ShardStore
from driftwalk.sweep import MemoryStore

AXES = {"drag_coefficient": [0.2, 1.0], "force_std": [0.0, 5e-4, 2e-3]}


@pytest.fixture(scope="module")
def study() -> dw.Study:
    return small()


@pytest.fixture(scope="module")
def reference(study: dw.Study) -> xr.Dataset:
    return dw.sensitivity_reference(study, FLOW)


@pytest.fixture(scope="module")
def found(study: dw.Study, reference: xr.Dataset) -> xr.Dataset:
    return dw.sensitivity_map(study, FLOW, axes=AXES, reference=reference)


def counts(assembly: xr.Dataset) -> Counter[str]:
    names = assembly["class"].values
    return Counter(str(names[index]) for index in assembly["outcome"].values)


def median(times: np.ndarray) -> float:
    """Return the time of the run in the middle, NaN when fewer than half have one."""
    known = sorted(times[np.isfinite(times)])
    half = (len(times) + 1) // 2
    return float(known[half - 1]) if len(known) >= half else float("nan")


def test_every_setting_is_a_run_of_assemble(study: dw.Study, found: xr.Dataset) -> None:
    assert found["proportion"].dims == ("drag_coefficient", "force_std", "class")
    assert found["class"].values.tolist() == ["I3", "L3", "2+1", "1+1+1"]
    for drag in AXES["drag_coefficient"]:
        for force in AXES["force_std"]:
            one = found.sel(drag_coefficient=drag, force_std=force)
            alone = by_hand(study, int(one["trial"]), drag_coefficient=drag, force_std=force)
            expected = counts(alone)
            values = dict(zip(found["class"].values, one["count"].values.tolist(), strict=True))
            assert {name: n for name, n in values.items() if n} == dict(expected)
            assert int(one["runs"]) == RUNS
            assert float(one["complete"]) == pytest.approx((expected["I3"] + expected["L3"]) / RUNS)
            for event in ("first_contact", "completion"):
                np.testing.assert_equal(
                    float(one[f"{event}_median"]), median(alone[f"{event}_time"].values)
                )
    # The runs differ enough for a mistake to show.
    assert len(np.unique(found["count"].values.reshape(-1, 4), axis=0)) > 3


def test_the_medians_are_those_of_class_times(study: dw.Study, found: xr.Dataset) -> None:
    one = found.isel(drag_coefficient=1, force_std=2)
    times = dw.class_times(by_hand(study, int(one["trial"]), drag_coefficient=1.0, force_std=2e-3))
    for event in ("first_contact", "completion"):
        np.testing.assert_equal(float(one[f"{event}_median"]), times.attrs[f"{event}_median_s"])


def test_the_reference_is_its_realisations(study: dw.Study, reference: xr.Dataset) -> None:
    each = reference["realisation_count"].values
    total = np.zeros(each.shape[1], dtype=int)
    for number in range(REALISATIONS):
        expected = counts(by_hand(study, (2 << 32) + number))
        names = [str(name) for name in reference["class"].values]
        assert [expected[name] for name in names] == each[number].tolist()
        total += each[number]
    assert reference["count"].values.tolist() == total.tolist()
    assert reference.attrs["runs"] == RUNS * REALISATIONS
    pairs = [np.abs(each[a] - each[b]).sum() / RUNS for a in range(REALISATIONS) for b in range(a)]
    assert reference.attrs["mean_pairwise_l1"] == pytest.approx(np.mean(pairs))
    np.testing.assert_allclose(reference["standard_deviation"], np.std(each / RUNS, axis=0, ddof=1))


def test_expected_pairwise_distance_by_enumeration() -> None:
    """Two blocks have two classes, so all pairs of counts can be summed over."""
    from scipy.stats import binom

    two = dw.sensitivity_reference(small(assembly={"blocks": 2, "duration_s": 4.0}), FLOW)
    p = float(two["proportion"][0])
    assert 0 < p < 1
    k = np.arange(RUNS + 1)
    weight = binom.pmf(k, RUNS, p)
    exact = float((np.abs(k[:, None] - k) * np.outer(weight, weight)).sum() * 2 / RUNS)
    # 20,000 drawn pairs: four standard errors, a false alarm in 1 of 15,000 seeds, and it is one.
    spread = float(np.sqrt((np.square(k[:, None] - k) * np.outer(weight, weight)).sum()) * 2 / RUNS)
    assert two.attrs["expected_pairwise_l1"] == pytest.approx(exact, abs=4 * spread / 20_000**0.5)


def test_distances_and_floors(found: xr.Dataset, reference: xr.Dataset) -> None:
    known = reference["proportion"].values
    for index in np.ndindex(2, 3):
        share = found["proportion"].values[index]
        expected = sum(abs(a - b) for a, b in zip(share, known, strict=True))
        assert found["l1_distance"].values[index] == pytest.approx(expected)
    floor = dw.l1_noise_floor(reference, RUNS, RUNS * REALISATIONS)
    assert found.attrs["noise_floor_mean"] == floor.mean
    assert found.attrs["noise_floor_95"] == floor.quantile
    in_floors = dw.assembly.l1_in_floors(
        found["proportion"].values, known, runs=RUNS, reference_runs=RUNS * REALISATIONS
    )
    np.testing.assert_allclose(found["l1_in_floors"], in_floors)
    facts = found.attrs
    assert (facts["reference_drag_coefficient"], facts["reference_force_std_N"]) == (0.45, 1e-3)
    assert (facts["reference_runs"], facts["reference_tank_diameter_m"]) == (36, 0.16)


def test_no_random_number_is_used_twice(found: xr.Dataset, reference: xr.Dataset) -> None:
    trials = found["trial"].values.ravel().tolist()
    assert len(set(trials)) == len(trials)
    assert not set(trials) & {0, 1, *range(2 << 32, (2 << 32) + REALISATIONS)}


@pytest.mark.slow
def test_bits_depend_on_nothing_else(
    study: dw.Study, found: xr.Dataset, reference: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One setting per unit, a run or two per call of the core, and another number of threads."""
    monkeypatch.setattr(engine, "settings_per_unit", lambda *_: 1)
    for at_once in (3, 15):
        monkeypatch.setattr(engine, "BLOCKS_AT_ONCE", at_once)
        again = dw.sensitivity_map(study, FLOW, axes=AXES, reference=reference, threads=1)
        xr.testing.assert_identical(again, found)


class Killed(Exception):
    pass


def test_continues_after_a_kill(
    study: dw.Study,
    found: xr.Dataset,
    reference: xr.Dataset,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Any,
) -> None:
    monkeypatch.setattr(engine, "settings_per_unit", lambda *_: 2)
    told: list[tuple[int, int]] = []

    def stop(done: int, total: int) -> None:
        told.append((done, total))
        if done == 4:
            raise Killed

    def run(progress: Any) -> xr.Dataset:
        store = ShardStore(tmp_path / "map", fingerprint={"seed": 5})
        return dw.sensitivity_map(
            study, FLOW, axes=AXES, reference=reference, store=store, progress=progress
        )

    with pytest.raises(Killed):
        run(stop)
    assert told == [(0, 6), (2, 6), (4, 6)]
    later: list[int] = []
    again = run(lambda done, _: later.append(done))
    assert later == [4, 6]
    xr.testing.assert_identical(again, found)


@pytest.mark.slow
def test_axes_of_another_kind() -> None:
    """Blocks, tank and latching: classes united, trials counted on, worlds told apart."""
    study = small(tank={"diameter_m": 0.2})
    axes = {
        "latching": ["collision", "none"],
        "blocks": [2, 3],
        "tank_diameter": [0.16, 0.2],
        "drag_coefficient": [0.3, 1.0],
    }
    reference = dw.sensitivity_reference(study, FLOW)
    found = dw.sensitivity_map(study, FLOW, axes=axes, reference=reference)
    assert found["l1_distance"].dims == ("tank_diameter", "blocks", "latching", "drag_coefficient")
    assert found["class"].values.tolist() == ["I3", "L3", "2", "2+1", "1+1", "1+1+1"]
    assert found["trial"].values.ravel().tolist() == list(range(1 << 32, (1 << 32) + 16))
    for place in np.ndindex(2, 2, 2, 2):
        one = found.isel(dict(zip(found["l1_distance"].dims, place, strict=True)))
        varied = {
            "tank.diameter_m": float(one["tank_diameter"]),
            "assembly.blocks": int(one["blocks"]),
            "assembly.latching": str(one["latching"].values),
        }
        alone = by_hand(
            dw.apply_overrides(study, varied),
            int(one["trial"]),
            drag_coefficient=float(one["drag_coefficient"]),
        )
        names = found["class"].values
        seen = {n: c for n, c in zip(names, one["count"].values.tolist(), strict=True) if c}
        assert seen == dict(counts(alone))
        assert np.isnan(float(one["l1_distance"])) == (int(one["blocks"]) == 2)
    none = found.sel(latching="none")
    assert (none["complete"] == 0).all()
    assert {"blocks", "latching", "arena"} & set(found.attrs) == set()


def test_flows_are_compared_by_name(study: dw.Study, reference: xr.Dataset) -> None:
    flows = {"left": dw.uniform_flow(-0.05, 0.0), "still": dw.uniform_flow(0.0, 0.0)}
    found = dw.sensitivity_map(study, FLOW, axes={"flow": flows}, reference=reference)
    assert found["flow"].values.tolist() == ["left", "still"]
    for name, flow in flows.items():
        one = found.sel(flow=name)
        alone = assemble(study, flow, runs=RUNS, seed=5, trial=int(one["trial"]))
        seen = dict(zip(found["class"].values, one["count"].values.tolist(), strict=True))
        assert {n: c for n, c in seen.items() if c} == dict(counts(alone))


def test_many_blocks_list_what_occurred(reference: xr.Dataset) -> None:
    """Beyond 8 blocks class names come from the runs, and differ from unit to unit."""
    study = small(tank={"diameter_m": 0.3}, assembly={"blocks": 9}, sensitivity={"runs": 5})
    axes = {"drag_coefficient": [0.2, 0.6, 1.0]}
    own = dw.sensitivity_reference(study, FLOW)
    found = dw.sensitivity_map(study, FLOW, axes=axes, reference=own, store=MemoryStore())
    occurred = set()
    for drag in axes["drag_coefficient"]:
        one = found.sel(drag_coefficient=drag)
        alone = assemble(
            study, FLOW, runs=5, seed=5, trial=int(one["trial"]), drag_coefficient=drag
        )
        seen = dict(zip(found["class"].values, one["count"].values.tolist(), strict=True))
        assert {n: c for n, c in seen.items() if c} == dict(counts(alone))
        occurred |= set(counts(alone))
    assert set(found["class"].values) == occurred | set(own["class"].values)


def test_sobol_outputs_are_the_shares(study: dw.Study) -> None:
    bounds = {"drag_coefficient": (0.2, 1.0), "tank_diameter": (0.14, 0.16)}
    found = dw.sensitivity_indices(study, FLOW, samples=8, bounds=bounds)
    assert found["input"].values.tolist() == ["drag_coefficient", "tank_diameter"]
    assert found.sizes["setting"] == 8 * 4
    for setting in (0, 7, 31):
        drag, diameter = found["value"].values[setting]
        alone = by_hand(
            dw.apply_overrides(study, {"tank.diameter_m": float(diameter)}),
            (3 << 32) + setting,
            drag_coefficient=drag,
        )
        shares = {n: counts(alone)[n] / RUNS for n in found["output"].values[1:]}
        row = found["proportion"].values[setting]
        assert row[1:].tolist() == pytest.approx(list(shares.values()))
        assert row[0] == pytest.approx(shares["I3"] + shares["L3"])
    p = found["proportion"].sel(output="complete").values
    # Saltelli's independent draws are the first and the last of each group of four.
    own = p[np.isin(np.arange(32) % 4, [0, 3])]
    assert float(found["noise_share"].sel(output="complete")) == pytest.approx(
        np.mean(own * (1 - own) / (RUNS - 1)) / own.var()
    )


def test_sobol_bounds_are_the_ends_of_the_map() -> None:
    lists = {"tank_diameter_m": [0.16, 0.12], "drag_coefficient": [0.5, 0.3]}
    study = small(assembly={"blocks": 2, "duration_s": 0.1}, sensitivity={**lists, "runs": 2})
    found = dw.sensitivity_indices(study, FLOW, samples=8)
    ends = {
        str(name): (low, high)
        for name, low, high in zip(
            found["input"].values, found["low"].values, found["high"].values, strict=True
        )
    }
    assert ends == {
        "drag_coefficient": (0.3, 0.5),
        "force_std": (0.0, 1.5e-3),
        "tank_diameter": (0.12, 0.16),
    }


@pytest.mark.parametrize(
    ("axes", "says"),
    [
        ({"drag": [1.0]}, "axes: there is no 'drag'; choose from tank_diameter, blocks"),
        ({}, "none was named"),
        ({"blocks": []}, "the list is empty"),
        ({"blocks": [2.5]}, "expected a whole number, got 2.5"),
        ({"latching": "collision"}, "expected a list of values, got 'collision'"),
        ({"latching": ["glue"]}, '"collision" or "connector" or "none"'),
        ({"force_std": [-1e-3]}, "force_std_N: must be at least 0 N"),
        ({"drag_coefficient": [0.1, 0.1]}, "names a value twice"),
        ({"blocks": [2, 40]}, "at blocks = 40: 40 blocks of 0.03 m do not fit into the tank"),
        ({"tank_diameter": [5.0]}, "at tank_diameter = 5.0: the flow field does not cover"),
        ({"flow": ["nowhere.nc"]}, "nowhere.nc: there is no such file"),
    ],
)
def test_axes_that_cannot_be(study: dw.Study, axes: dict[str, Any], says: str) -> None:
    for function in (dw.assembly.check_sensitivity, dw.sensitivity_map):
        with pytest.raises(InputError) as caught:
            function(study, FLOW, axes=axes)
        assert says in str(caught.value)


@pytest.mark.slow
def test_blocks_that_find_no_place_are_the_users_to_mend() -> None:
    """Enough room by area, not in fact: said before the map, and by the map too."""
    study = small(assembly={"blocks": 14})
    for function in (dw.assembly.check_sensitivity, dw.sensitivity_reference):
        with pytest.raises(InputError, match="of 14 blocks found a place in the tank"):
            function(study, FLOW)


def test_a_reference_of_the_other_chirality(study: dw.Study, reference: xr.Dataset) -> None:
    other = reference.assign_attrs(chirality="distinct")
    with pytest.raises(InputError, match="counts mirror images differently"):
        dw.sensitivity_map(study, FLOW, axes={"drag_coefficient": [0.1]}, reference=other)


def test_sobol_needs_two_runs_and_a_power_of_two(study: dw.Study) -> None:
    with pytest.raises(InputError, match="at least 2 runs of each setting"):
        dw.assembly.check_indices(small(sensitivity={"runs": 1}), FLOW, samples=8)
    with pytest.raises(InputError, match="a power of two"):
        dw.assembly.check_indices(study, FLOW, samples=9)
    with pytest.raises(InputError, match="there is no 'blocks'"):
        dw.sensitivity_indices(study, FLOW, samples=8, bounds={"blocks": (2, 3)})
