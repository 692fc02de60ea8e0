"""Random numbers of the simulator against published vectors and the normal distribution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats
from single_block import MASS, model, one_world, run, wrapped
from twin.block import force_normals, normal_pair, philox

from driftwalk import _core
from driftwalk.core.random_streams import world_keys

# Random123 (Salmon, Moraes, Dror, Shaw, SC 2011), file kat_vectors, philox4x32 of 10 rounds:
# counter, key, words.
KNOWN_ANSWERS = [
    (
        "00000000 00000000 00000000 00000000",
        "00000000 00000000",
        "6627e8d5 e169c58d bc57ac4c 9b00dbd8",
    ),
    (
        "ffffffff ffffffff ffffffff ffffffff",
        "ffffffff ffffffff",
        "408f276d 41c83b0e a20bc7c6 6d5451fd",
    ),
    (
        "243f6a88 85a308d3 13198a2e 03707344",
        "a4093822 299f31d0",
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]


def _words(text: str) -> list[int]:
    return [int(word, 16) for word in text.split()]


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_philox_gives_the_published_words(counter: str, key: str, answer: str) -> None:
    low, high = _words(key)
    joined = low | high << 32
    address = _words(counter)
    assert _core.philox(joined, address) == _words(answer)
    twin = philox(np.array([joined], dtype=np.uint64), tuple(address))  # type: ignore[arg-type]
    assert [int(word[0]) for word in twin] == _words(answer)


@pytest.mark.false_alarm(0)
def test_twin_and_core_agree_on_random_addresses(fresh_seed: Callable[[int], int]) -> None:
    rng = np.random.default_rng(fresh_seed(2))
    keys = rng.integers(0, 2**64, 50, dtype=np.uint64)
    for counter in rng.integers(0, 2**32, (20, 4)).tolist():
        words = np.array(philox(keys, tuple(counter)))
        for index, key in enumerate(keys):
            assert words[:, index].tolist() == _core.philox(int(key), counter)


def test_a_counter_has_four_words() -> None:
    with pytest.raises(ValueError, match="four words"):
        _core.philox(1, [1, 2, 3])


@pytest.mark.false_alarm(2e-5)
def test_normals_are_normal_and_independent(fresh_seed: Callable[[int], int]) -> None:
    # Each check fails falsely once in 1e6 runs or less.
    keys = world_keys(fresh_seed(7), trial=0, replicate=np.arange(40_000))
    first, second = force_normals(keys, 0)
    third, fourth = force_normals(keys, 1)
    for sample in (first, second, third, fourth):
        assert stats.kstest(sample, "norm").pvalue > 1e-6
        assert abs(sample.mean()) < 5 / np.sqrt(sample.size)
        assert abs(sample.var() - 1.0) < 5 * np.sqrt(2 / sample.size)
    together = np.corrcoef([first, second, third, fourth])
    assert np.abs(together - np.eye(4)).max() < 5 / np.sqrt(first.size)


def test_box_muller_uses_both_words_fully() -> None:
    words = np.array([0, 255, 256, 2**32 - 1], dtype=np.uint64)
    radius = np.hypot(*normal_pair(words, np.zeros(4, dtype=np.uint64)))
    expected = np.sqrt(-2 * np.log(np.array([1, 1, 2, 2**24]) * 2.0**-24))
    np.testing.assert_allclose(radius, expected, rtol=1e-14)
    quadrants = np.arange(4, dtype=np.uint64) << np.uint64(30)
    cosine, sine = normal_pair(np.zeros(4, dtype=np.uint64), quadrants)
    # Quadrants start an eighth of a turn before their axis.
    expected_angle = wrapped((np.arange(4) - 0.5) * np.pi / 2)
    np.testing.assert_allclose(np.arctan2(sine, cosine), expected_angle, atol=1e-12)


@pytest.mark.parametrize(("precision", "tolerance"), [("double", 1e-9), ("single", 2e-4)])
def test_force_of_an_interval_is_the_normal_at_its_address(
    precision: str, tolerance: float
) -> None:
    # Without drag the second difference of the path at the ends of the steps gives the force.
    force, step = 1e-3, 0.01
    keys = world_keys(3, trial=0, replicate=np.arange(5))
    worlds = np.repeat(one_world(drag=0.0, force=force), 5, axis=0)
    x, y, _, status = run(model(times=np.arange(41) * step), worlds, keys=keys, precision=precision)
    assert not status.any()
    # x_{n+1} - 2 x_n + x_{n-1} = (a_n + a_{n-1}) / 2 dt^2
    for path, axis in ((x, 0), (y, 1)):
        bends = np.diff(path.astype(np.float64), 2, axis=1) / step**2 * 2
        drawn = np.array([force_normals(keys, interval)[axis] for interval in range(40)]).T
        expected = (drawn[:, 1:] + drawn[:, :-1]) * force / MASS
        assert np.abs(bends - expected).max() < tolerance / step
