"""The function of a sweep as it travels: made ready once, refused where versions differ."""

from __future__ import annotations

import threading
from functools import partial

import numpy as np
import pytest

from driftwalk.core.errors import ClusterError
from driftwalk.sweep import WorkUnit
from driftwalk.sweep.workers import packed, refuse_others, run_unit

UNIT = WorkUnit(0, 2, {"a": np.array([2.0, 3.0])})


class Squares:
    """Counts how often it was unpacked."""

    unpacked = 0

    def __setstate__(self, state: dict[str, object]) -> None:
        type(self).unpacked += 1
        vars(self).update(state)

    def __getstate__(self) -> dict[str, object]:
        return {"any": 1}

    def __call__(self, unit: WorkUnit) -> dict[str, np.ndarray]:
        return {"square": unit.settings["a"] ** 2}


def test_a_function_is_unpacked_once_for_all_units() -> None:
    parcel = packed(Squares())
    before = Squares.unpacked
    found = [run_unit(parcel, UNIT).arrays["square"].tolist() for _ in range(3)]
    assert found == [[4.0, 9.0]] * 3
    assert Squares.unpacked == before + 1


def test_closures_travel_too() -> None:
    factor = 3.0
    parcel = packed(lambda unit: {"scaled": factor * unit.settings["a"]})
    assert run_unit(parcel, UNIT).arrays["scaled"].tolist() == [6.0, 9.0]


def test_what_cannot_travel_is_said() -> None:
    lock = threading.Lock()
    with pytest.raises(ClusterError, match="cannot be sent to workers"):
        packed(lambda unit: {"lock": lock})


def test_another_version_is_refused_with_both_named() -> None:
    parcel = packed(Squares())._replace(versions={"driftwalk": "0.0.9"})
    with pytest.raises(ClusterError, match=r"a worker on .* driftwalk 0\.1\.0.*driftwalk 0\.0\.9"):
        run_unit(parcel, UNIT)
    with pytest.raises(ClusterError, match="has scipy none, this machine has 1"):
        refuse_others({"scipy": "1.17"}, {}, "the worker a")


def test_linear_algebra_asks_for_the_same_numpy_and_scipy() -> None:
    function = Squares()
    function.linear_algebra = True  # type: ignore[attr-defined]
    assert sorted(packed(function).versions) == ["driftwalk", "numpy", "scipy"]
    assert sorted(packed(Squares()).versions) == ["driftwalk"]


def test_the_same_function_is_the_same_parcel() -> None:
    """So a worker that has it fetches nothing for the next stage."""
    assert packed(Squares()).token == packed(Squares()).token
    assert packed(partial(scaled, 2.0)).token != packed(partial(scaled, 3.0)).token


def scaled(factor: float, unit: WorkUnit) -> dict[str, np.ndarray]:
    return {"scaled": factor * unit.settings["a"]}


GUARDED: list[int] = []


def count() -> None:
    GUARDED.append(1)


def refuse() -> None:
    raise ClusterError("other bits")


def test_a_guard_is_asked_once_in_a_process() -> None:
    parcel = packed(Squares(), count)
    for _ in range(3):
        run_unit(parcel, UNIT)
    assert len(GUARDED) == 1


def test_what_does_not_pass_its_guard_computes_nothing() -> None:
    parcel = packed(Squares(), refuse)
    for _ in range(2):
        with pytest.raises(ClusterError, match="other bits"):
            run_unit(parcel, UNIT)
