"""How fast the two-sample 2-D KS distance is, beside plain ways to compute it.

    python benchmarks/bench_ks.py [--sizes 18000 36000 100000 400000 1000000] [--rounds 9]

Both samples have n points. Timed in one run, in turn, on one core, with NumPy arrays in and a float
out; medians of processor time:

* "unsorted": both samples as they come; "prepared": the first one prepared (`ks_reference`), as a
  calibration does with the recording; both again on every instruction set that this processor has;
* two lines below: "pixels", steps between positions on a pixel grid, where lengths and angles
  repeat, and "grid", samples rounded to some 70 values an axis, in turn with the samples without
  ties; with all tied points counted, and as `ks_distance`, which needs to know of a twentieth only;
* "ns a point": the unsorted time over the 2 n points of both samples;
* "merging": an O(n log^2 n) merge of prefix sums, vectorised in NumPy; once;
* "loop": one origin at a time with boolean masks, O(n^2), as the usual pure-Python packages do. It
  is extrapolated from some origins and marked "~" (its cost per origin is the same for all).

Every answer is checked against "merging", and that against the loop up to 5,000 points: all agree
to the last integer, else the script fails.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from timing import interleaved, machine

from driftwalk import _core
from driftwalk.comparison import (
    ComparisonWarning,
    KsComparison,
    block_permutation_test,
    ks_compare,
    ks_distance,
    ks_reference,
)

Points = npt.NDArray[np.float64]
LOOP_CELLS = 40_000_000
OTHERS_UP_TO = 50_000
INSTRUCTION_SET = "DRIFTWALK_INSTRUCTION_SET"


def samples(n: int) -> tuple[Points, Points]:
    """Steps like those of a drifting block: gamma lengths [m], turning angles [rad]."""
    rng = np.random.default_rng(n)
    a, b = (
        np.column_stack([rng.gamma(4.0, 1.6e-3 * scale, n), rng.vonmises(0.0, 4.0, n)])
        for scale in (1.0, 1.02)
    )
    return a, b


def pixel_samples(n: int, pixel: float = 2.5e-4) -> tuple[Points, Points]:
    """Steps of a drifting block whose positions [m] were read off a grid of pixels."""
    rng = np.random.default_rng(n)
    found = []
    for scale in (1.0, 1.02):
        length = rng.gamma(4.0, 1.6e-3 * scale, 2 * n)
        heading = np.cumsum(rng.vonmises(0.0, 4.0, 2 * n))
        path = np.cumsum(length[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]), 0)
        step = np.diff(np.round(path / pixel) * pixel, axis=0)
        step = step[np.hypot(*step.T) > 0][: n + 1]
        turn = np.diff(np.arctan2(step[:, 1], step[:, 0]))
        found.append(np.column_stack([np.hypot(*step[1:].T), np.angle(np.exp(1j * turn))]))
    return found[0], found[1]


def grid_samples(n: int) -> tuple[Points, Points]:
    """Normal numbers rounded to tenths."""
    rng = np.random.default_rng(n)
    a, b = (np.round(rng.normal(size=(n, 2)) * scale, 1) for scale in (1.0, 1.02))
    return a, b


def by_merging(a: Points, b: Points) -> tuple[int, int]:
    """D1 and D2 in units of 1 / (n m), for points without ties, by merging sorted runs."""
    pooled = np.concatenate([a, b])
    by_x = np.argsort(pooled[:, 0])
    pooled, second = pooled[by_x], by_x >= len(a)
    weight = np.where(second, -len(a), len(b)).astype(np.int64)
    rank = np.empty(len(pooled), np.int64)
    rank[np.argsort(pooled[:, 1])] = np.arange(len(pooled))
    inside = np.zeros(len(pooled), np.int64)  # weight of {x < X, y < Y}, by position in x
    position = np.arange(len(pooled))
    width = 1
    while width < len(pooled):
        run = position // (2 * width)
        order = np.argsort(run * len(pooled) + rank)
        is_left = (order // width) % 2 == 0
        sums = np.cumsum(np.where(is_left, weight[order], 0))
        before = np.where(run[order] > 0, sums[run[order] * 2 * width - 1], 0)
        inside[order] += np.where(is_left, 0, sums - before)
        width *= 2
    left = np.cumsum(weight) - weight
    by_y = np.argsort(rank)
    below = np.empty_like(left)
    below[by_y] = np.cumsum(weight[by_y]) - weight[by_y]
    quadrants = (inside, below - inside, left - inside, inside - left - below - weight)
    largest = np.abs(quadrants).max(axis=0)
    return int(largest[~second].max()), int(largest[second].max())


def by_loop(a: Points, b: Points, *, origins: int | None = None) -> tuple[int, int]:
    """The same, one origin at a time; only the first `origins` of each sample if given."""
    found = []
    for sample in (a, b):
        largest = 0
        for x, y in sample[:origins]:
            for across in (np.less, np.greater):
                for along in (np.less, np.greater):
                    in_a = np.count_nonzero(across(a[:, 0], x) & along(a[:, 1], y))
                    in_b = np.count_nonzero(across(b[:, 0], x) & along(b[:, 1], y))
                    largest = max(largest, abs(len(b) * in_a - len(a) * in_b))
        found.append(int(largest))
    return found[0], found[1]


def once_ms(call: Callable[[], tuple[int, int]]) -> tuple[tuple[int, int], float]:
    begin = time.process_time()
    answer = call()
    return answer, 1e3 * (time.process_time() - begin)


def median_ms(ways: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    times = interleaved(ways, rounds=rounds)
    return {name: 1e3 * statistics.median(taken.processor) for name, taken in times.items()}


def integers(result: KsComparison) -> tuple[int, int]:
    return result.difference_a, result.difference_b


def check(name: str, found: tuple[int, int], expected: tuple[int, int]) -> None:
    if found != expected:
        sys.exit(f"wrong answer: {name} gives {found}, expected {expected}")


def check_tied(name: str, a: Points, b: Points) -> None:
    """Check against the loop up to 5,000 points, and against all mirrored axes."""
    found = _core.ks_compare(a, b, False)[:2]
    if len(a) <= 5000:
        check(name, found, by_loop(a, b))
    for mirror in ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        check(f"{name}, mirrored", _core.ks_compare(a * mirror, b * mirror, False)[:2], found)


def on(instruction_set: str, call: Callable[[], KsComparison]) -> Callable[[], KsComparison]:
    """Return the call, made on an instruction set; "" is the one that the core chooses."""

    def made() -> KsComparison:
        os.environ[INSTRUCTION_SET] = instruction_set
        return call()

    return made


def bench(n: int, rounds: int) -> None:
    a, b = samples(n)
    expected, merging_ms = once_ms(lambda: by_merging(a, b))
    if n <= 5000:
        answer, loop_ms = once_ms(lambda: by_loop(a, b))
        check("loop", answer, expected)
        mark = " "
    else:
        origins = max(20, LOOP_CELLS // n)
        _, part_ms = once_ms(lambda: by_loop(a, b, origins=origins))
        loop_ms, mark = part_ms * n / origins, "~"
    reference = ks_reference(a)
    ways: dict[str, Callable[[], object]] = {}
    for name in ("", *_core.available_instruction_sets()):
        for kind, call in (
            ("unsorted", on(name, lambda: ks_compare(a, b))),
            ("prepared", on(name, lambda: reference.compare(b))),
        ):
            check(f"{name} {kind}", integers(call()), expected)
            ways[f"{name} {kind}"] = call
    times = median_ms(ways, rounds)
    os.environ[INSTRUCTION_SET] = ""
    for name in ("", *_core.available_instruction_sets()):
        ours_ms = times[f"{name} unsorted"]
        print(
            f"{n:>7} {name or f'chosen ({_core.instruction_set()})':<16} {ours_ms:>10.3f} "
            f"{times[f'{name} prepared']:>10.3f} {1e6 * ours_ms / (2 * n):>11.1f} "
            f"{merging_ms:>9.0f} {mark}{loop_ms:>10.0f} {merging_ms / ours_ms:>12.0f} "
            f"{loop_ms / ours_ms:>9.0f}"
        )
    tied_ways: dict[str, Callable[[], object]] = {}
    distances: dict[str, Callable[[], object]] = {}
    for kind, (first, second) in (("pixels", pixel_samples(n)), ("grid", grid_samples(n))):
        prepared = ks_reference(first)
        check_tied(f"{n} {kind}", first, second)
        tied_ways[f"{kind}"] = lambda first=first, second=second: _core.ks_compare(
            first, second, False
        )
        tied_ways[f"{kind}, prepared"] = lambda prepared=prepared, second=second: (
            prepared.native.compare(second, False)
        )
        distances[kind] = lambda first=first, second=second: ks_distance(first, second)
    tied_ways["no ties"] = lambda: _core.ks_compare(a, b, False)
    tied_ways["no ties, prepared"] = lambda: reference.native.compare(b, False)
    distances["no ties"] = lambda: ks_distance(a, b)
    for title, some in (("compared", tied_ways), ("distance", distances)):
        line = ", ".join(f"{name} {ms:.3f}" for name, ms in median_ms(some, rounds).items())
        print(f"{'':>7} {title}: {line}", flush=True)
    if n > OTHERS_UP_TO:
        return
    others = median_ms(
        {
            "permutations": lambda: block_permutation_test(
                a, b, block_length=10, permutations=100, seed=1
            ),
            "peacock": lambda: ks_compare(a, b, method="peacock"),
        },
        3,
    )
    print(
        f"{'':>7} a permutation {others['permutations'] / 100:.3f}, "
        f"Peacock's statistic {others['peacock']:.3f}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--sizes",
        type=int,
        nargs="+",
        default=[1000, 5000, 18_000, 36_000, 100_000, 400_000, 1_000_000],
    )
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    warnings.simplefilter("ignore", ComparisonWarning)
    print(machine())
    print("Medians in ms of processor time; ratios to ours unsorted. Both samples have n points.")
    print(
        f"{'n':>7} {'ours on':<16} {'unsorted':>10} {'prepared':>10} {'ns a point':>11} "
        f"{'merging':>9} {'loop':>11} {'merging/ours':>12} {'loop/ours':>9}"
    )
    for n in options.sizes:
        bench(n, options.rounds)


if __name__ == "__main__":
    main()
