"""The public face of the KS distance: errors, warnings, options, instruction sets."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest

from driftwalk import _core
from driftwalk.comparison import ComparisonWarning, ks_compare, ks_distance, ks_reference
from driftwalk.core.errors import InputError

GOOD = [[0.0, 1.0], [1.0, 0.0]]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.empty((0, 2)), "a is empty"),
        ([[0.0, 1.0], [np.nan, 0.0]], r"a .* not a finite number in row 1: \(nan, 0.0\)"),
        ([[0.0, np.inf]], "row 0"),
        ([0.0, 1.0], r"shape \(n, 2\), got \(2,\)"),
        (np.zeros((3, 3)), r"shape \(n, 2\), got \(3, 3\)"),
        ([["a", "b"]], "not an array of numbers"),
    ],
)
def test_what_cannot_be_compared_is_named(points: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ks_distance(points, GOOD)  # type: ignore[arg-type]


def test_the_second_sample_is_named_too() -> None:
    with pytest.raises(InputError, match="b is empty"):
        ks_distance(GOOD, np.empty((0, 2)))
    with pytest.raises(InputError, match="other is empty"):
        ks_reference(GOOD).distance(np.empty((0, 2)))


@pytest.mark.parametrize("option", ["ties", "combine", "method"])
def test_an_unknown_word_is_refused(option: str) -> None:
    with pytest.raises(InputError, match=f"{option} must be one of .*, got 'other'"):
        ks_distance(GOOD, GOOD, **{option: "other"})


def test_single_points() -> None:
    assert ks_distance([[0, 0]], [[1, 1]]) == 1.0
    same = ks_compare([[0.5, 0.5]], [[0.5, 0.5]], ties="limits")
    assert same.distance == 0.0
    assert (same.place.quadrant, same.place.row) == (-1, -1)
    assert np.isnan(same.place.x)
    assert same.tied_fraction == 1.0


def test_more_than_a_twentieth_of_ties_warns() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(1000, 2)), rng.normal(size=(1000, 2))
    b[:45, 0] = a[:45, 0]
    assert ks_compare(a, b).tied_fraction == pytest.approx(0.045)
    b[:60, 0] = a[:60, 0]
    reference = ks_reference(a)
    for share, call in (
        ("more than 5 %", lambda: ks_distance(a, b)),
        ("6 %", lambda: ks_compare(a, b)),
        ("more than 5 %", lambda: reference.distance(b)),
        ("6 %", lambda: reference.compare(b)),
    ):
        with pytest.warns(ComparisonWarning, match=f"^{share} of the points share a") as caught:
            call()
        assert caught[0].filename == __file__
    assert ks_compare(a, b, ties="limits").tied_fraction == pytest.approx(0.06)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.filterwarnings("error")
def test_a_distance_warns_from_the_first_point_beyond_a_twentieth(axis: int) -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(1000, 2)), rng.normal(size=(1000, 2))
    b[:50, axis] = a[:50, axis]
    ks_distance(a, b)
    b[50, axis] = b[0, axis]
    with pytest.warns(ComparisonWarning, match="more than 5 %"):
        ks_distance(a, b)


def test_a_reference_travels_to_another_process() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 500, 2))
    reference = ks_reference(a)
    there = pickle.loads(pickle.dumps(reference))
    assert len(there) == 500
    assert there.compare(b) == reference.compare(b)


def test_combine_takes_the_larger() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(30, 2)), rng.normal(size=(40, 2)) + 0.5
    result = ks_compare(a, b, combine="max")
    assert result.distance == max(result.distance_a, result.distance_b)


def test_any_layout_of_the_array_will_do() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(30, 2)), rng.normal(size=(40, 2))
    expected = ks_distance(a, b)
    assert ks_distance(np.asfortranarray(a), b.tolist()) == expected
    assert ks_distance(np.repeat(a, 2, axis=1)[:, ::2], b) == expected
    frozen = a.copy()
    frozen.setflags(write=False)
    assert ks_distance(frozen, b) == expected


def test_threads_share_a_reference() -> None:
    rng = np.random.default_rng(4)
    reference = ks_reference(rng.normal(size=(2000, 2)))
    others = [rng.normal(size=(1500 + 100 * i, 2)) for i in range(6)]
    expected = [reference.distance(other) for other in others]
    found = [0.0] * len(others)

    def work(i: int) -> None:
        for _ in range(5):
            found[i] = reference.distance(others[i])

    threads = [threading.Thread(target=work, args=(i,)) for i in range(len(others))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == expected


INSTRUCTION_SETS = """
import warnings
import numpy as np
from driftwalk.comparison import ks_compare
warnings.simplefilter("ignore")
rng = np.random.default_rng(5)
for n, m in ((3, 5), (700, 700), (1000, 777), (40_000, 30_000), (70_000, 65_000)):
    for levels in (0, 25):
        a, b = rng.normal(size=(n, 2)), rng.normal(size=(m, 2)) + 0.1
        if levels:
            a, b = np.round(a * levels), np.round(b * levels)
        for ties in ("strict", "limits"):
            print(repr(ks_compare(a, b, ties=ties)))
"""


@pytest.mark.slow
def test_every_instruction_set_gives_the_same_numbers() -> None:
    printed = {}
    for name in _core.available_instruction_sets():
        environment = {**os.environ, "DRIFTWALK_INSTRUCTION_SET": name}
        printed[name] = subprocess.run(
            [sys.executable, "-c", INSTRUCTION_SETS],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    assert "baseline" in printed
    assert printed["baseline"].count("KsComparison") == 20
    assert set(printed.values()) == {printed["baseline"]}
