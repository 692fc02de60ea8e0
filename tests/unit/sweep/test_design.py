"""The order of settings and how they are cut."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.core.errors import InputError
from driftwalk.sweep import grid

SIZES = st.lists(st.integers(1, 5), min_size=1, max_size=4)


@given(SIZES, st.integers(1, 50))
@settings(deadline=None, max_examples=100)
def test_units_hold_the_product_in_order(sizes: list[int], unit_size: int) -> None:
    """The oracle is `itertools.product`, whose last argument runs fastest."""
    axes = {f"axis_{i}": [10.0 * i + k for k in range(n)] for i, n in enumerate(sizes)}
    design = grid(**axes)
    units = design.units(unit_size)
    rows = [row for u in units for row in zip(*u.settings.values(), strict=True)]
    assert rows == list(itertools.product(*axes.values()))
    assert all(unit.size == unit_size for unit in units[:-1])
    assert 1 <= units[-1].size <= unit_size
    assert [u.start for u in units[1:]] == [u.stop for u in units[:-1]]
    assert units[-1].stop == design.size


def test_unstack_puts_values_at_their_place() -> None:
    design = grid(drag_coefficient=[0.5, 1.0], force_std=[0.0, 1e-3, 2e-3])
    settings_ = design.settings()
    value = 1e4 * settings_["force_std"] + settings_["drag_coefficient"]
    stacked = design.unstack({"value": value, "pair": np.stack([value, -value], axis=1)})
    assert stacked["value"].shape == (2, 3)
    assert stacked["value"][1, 2] == 21.0
    assert stacked["pair"].shape == (2, 3, 2)
    assert stacked["pair"][0, 1, 1] == -10.5


def test_unstack_refuses_other_lengths() -> None:
    with pytest.raises(InputError, match=r"'a': expected 2 settings, got shape \(3,\)"):
        grid(x=[1, 2]).unstack({"a": np.zeros(3)})


def test_types_of_axes_are_kept() -> None:
    settings_ = grid(replicate=range(2), force_std=[0.5]).settings()
    assert settings_["replicate"].dtype.kind == "i"
    assert settings_["force_std"].dtype == np.float64


def test_ids_name_the_settings_whatever_comes_before() -> None:
    assert [u.id for u in grid(a=range(5)).units(2)] == [
        "00000000-00000002",
        "00000002-00000004",
        "00000004-00000005",
    ]


def test_units_pickle() -> None:
    unit = grid(a=[1.0, 2.0, 3.0]).units(2)[0]
    again = pickle.loads(pickle.dumps(unit))
    assert again.id == unit.id
    assert again.settings["a"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ({}, "at least one axis"),
        ({"a": []}, "'a': expected a list of one or more"),
        ({"a": 1.0}, "'a': expected a list"),
        ({"a": [[1.0]]}, "'a': expected a list"),
        ({"a": ["x"]}, "'a': expected numbers"),
        ({"a": [1.0, float("nan")]}, "'a': expected finite"),
    ],
)
def test_bad_axes(axes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        grid(**axes)  # type: ignore[arg-type]


def test_bad_unit_size() -> None:
    with pytest.raises(InputError, match="at least 1 setting, got 0"):
        grid(a=[1]).units(0)
