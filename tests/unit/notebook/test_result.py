"""A result prints its answer first, and is a dataset in every other way."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st

import driftwalk as dw
from driftwalk.notebook.result import Result, answer_lines, as_result
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf


def answer(**more: object) -> xr.Dataset:
    values = {
        "estimate": ("parameter", [0.393, 0.55e-3, 0.1e-3]),
        "interval": (
            ("parameter", "bound"),
            [[0.388, 0.398], [0.54e-3, 0.56e-3], [0.09e-3, np.inf]],
        ),
        "confidence": 0.9,
        "force_interval": 0.016,
    }
    names = {
        "parameter": ["drag_coefficient", "force_std", "tracking_noise"],
        "unit": ("parameter", ["1", "N", "m"]),
    }
    return xr.Dataset(values | more, names, {"kind": "fit"})


def test_the_answer_comes_first() -> None:
    found = as_result(answer(verdict="explains"))
    assert repr(found).splitlines() == [
        "drag coefficient C_d   0.3930   90 % interval 0.3880 to 0.3980",
        "stochastic force σ_F   0.5500 mN, redrawn every 16 ms   90 % interval 0.5400 to 0.5600",
        "tracking noise         not determined by this recording",
        "verdict                explains",
        f"<Result: {len(found.data_vars)} variables, {len(found.attrs)} attributes>",
    ]
    assert "0.3880 to 0.3980" in found._repr_html_()


def test_runs_of_blocks_say_what_they_built() -> None:
    runs = dw.assemble(dw.Study(), dw.tank30_flow(), blocks=2, runs=4, duration="1s")
    lines = repr(runs).splitlines()
    assert lines[0].startswith("2 blocks, 4 runs of 1 s; C_d = 0.45")
    assert [line.split()[0] for line in lines[1:4]] == ["class", "2", "1+1"]


def test_what_speaks_against_the_model_is_said() -> None:
    found = answer(verdict="does not explain").assign_coords(
        verdict_reason=("verdict_reason", ["the flow <changes>"]),
        warning=("warning", ["few samples"]),
    )
    lines = answer_lines(found)
    assert lines[-3:] == [
        "verdict                does not explain:",
        "  the flow <changes>",
        "warning: few samples",
    ]
    # Text of a dataset is no markup of the page that shows it.
    assert "the flow &lt;changes&gt;" in as_result(found)._repr_html_()
    left_out = answer().assign_attrs(check_left_out="too few samples")
    assert answer_lines(left_out)[-1] == "verdict                not checked: too few samples"


def test_a_parameter_without_an_interval_has_none() -> None:
    found = answer()
    found["interval"][0] = np.nan
    none = "no interval without a bootstrap"
    assert answer_lines(found)[0] == f"drag coefficient C_d   0.3930   {none}"
    force = answer_lines(found.drop_vars("interval"))[1]
    assert force == f"stochastic force σ_F   0.5500 mN, redrawn every 16 ms   {none}"


@pytest.mark.parametrize("part", [["interval"], ["confidence"], []])
def test_a_part_without_an_answer_prints_as_a_dataset(part: list[str]) -> None:
    assert answer_lines(answer()[part]) == []
    assert repr(as_result(answer())[part]).startswith("<xarray")
    assert repr(as_result(answer()).isel(parameter=0)).startswith("<xarray")


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda d: d.copy(deep=True)])
def test_a_copy_is_a_result(copied: object) -> None:
    found = as_result(answer())
    other = copied(found)  # type: ignore[operator]
    assert isinstance(other, Result)
    assert other.identical(found)
    assert pickle.loads(pickle.dumps(found)).identical(found)


def test_it_is_stored_as_a_dataset_and_remembers_its_file(tmp_path: Path) -> None:
    path = tmp_path / "answer.nc"
    path.write_bytes(netcdf_bytes(as_result(answer())))
    read = open_netcdf(path)
    assert not isinstance(read, Result)
    assert as_result(read).identical(as_result(answer()))
    assert as_result(read).encoding["source"] == read.encoding["source"]


@pytest.mark.slow
@given(st.floats(1e-12, 1e12), st.floats(0.1, 0.99), st.floats(1.01, 10.0))
def test_numbers_survive_to_four_digits(value: float, low: float, high: float) -> None:
    found = answer()
    found["estimate"][1] = value
    found["interval"][1] = [low * value, high * value]
    line = answer_lines(found)[1]
    shown = line.removeprefix("stochastic force σ_F")
    for words in (" mN, redrawn every 16 ms", "90 % interval", "to"):
        shown = shown.replace(words, "")
    numbers = [1e-3 * float(part) for part in shown.split()]
    # Four significant digits: half a unit of the fourth.
    np.testing.assert_allclose(numbers, [value, low * value, high * value], rtol=5.1e-4)


def test_a_part_of_a_comparison_prints_as_a_dataset() -> None:
    values = {"score": ("model", [0.8, 1.25])}
    comparison = xr.Dataset(values, {"model": ["run_rest", "block"]}, {"kind": "model_comparison"})
    assert answer_lines(comparison) == []
    assert repr(as_result(comparison)).startswith("<xarray")
