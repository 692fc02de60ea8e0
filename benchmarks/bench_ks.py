"""How fast the two-sample 2-D KS distance is, beside two plain ways to compute it.

    python benchmarks/bench_ks.py [--sizes 1000 5000 18000 50000] [--repeats 30]

Timed in one run, on one core, with NumPy arrays in and a float out:

* ours, both samples unsorted; ours with the first sample prepared (`ks_reference`); both again on
  every instruction set that this processor has;
* "numpy": the definition vectorised, O(n^2), in chunks of origins;
* "loop": one origin at a time with boolean masks, O(n^2), as the usual pure-Python packages do.

Every answer is checked: all agree to the last integer, else the script fails. The slow ways run
once where they take longer than a second; "loop" is extrapolated from a part of the origins beyond
5,000 points and then marked "~" (its cost per origin is the same for all origins).
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.comparison import KsComparison, block_permutation_test, ks_compare, ks_reference

Points = npt.NDArray[np.float64]
LOOP_ORIGINS = 2000
INSTRUCTION_SET = "DRIFTWALK_INSTRUCTION_SET"


def samples(n: int) -> tuple[Points, Points]:
    """Steps like those of a drifting block: gamma lengths [m], turning angles [rad]."""
    rng = np.random.default_rng(n)
    a, b = (
        np.column_stack([rng.gamma(4.0, 1.6e-3 * scale, n), rng.vonmises(0.0, 4.0, n)])
        for scale in (1.0, 1.02)
    )
    return a, b


def by_numpy(a: Points, b: Points, *, chunk_cells: int = 2_000_000) -> tuple[int, int]:
    """D1 and D2 in units of 1 / (n m), by the definition, a chunk of origins at a time."""
    pooled = np.concatenate([a, b])
    found = []
    for origins in (a, b):
        largest = 0
        chunk = max(1, chunk_cells // len(pooled))
        for begin in range(0, len(origins), chunk):
            some = origins[begin : begin + chunk]
            left = pooled[:, 0] < some[:, :1]
            right = pooled[:, 0] > some[:, :1]
            below = pooled[:, 1] < some[:, 1:]
            above = pooled[:, 1] > some[:, 1:]
            for quadrant in (left & below, right & below, left & above, right & above):
                in_a = np.count_nonzero(quadrant[:, : len(a)], axis=1)
                in_b = np.count_nonzero(quadrant[:, len(a) :], axis=1)
                largest = max(largest, int(np.abs(len(b) * in_a - len(a) * in_b).max()))
        found.append(largest)
    return found[0], found[1]


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


def median_ms(call: Callable[[], object], repeats: int) -> float:
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1e3 * statistics.median(times)


def once_ms(call: Callable[[], tuple[int, int]]) -> tuple[tuple[int, int], float]:
    begin = time.perf_counter()
    answer = call()
    return answer, 1e3 * (time.perf_counter() - begin)


def integers(result: KsComparison) -> tuple[int, int]:
    return result.difference_a, result.difference_b


def check(name: str, found: tuple[int, int], expected: tuple[int, int]) -> None:
    if found != expected:
        sys.exit(f"wrong answer: {name} gives {found}, expected {expected}")


def bench(n: int, repeats: int) -> None:
    a, b = samples(n)
    expected, numpy_ms = once_ms(lambda: by_numpy(a, b))
    if n <= 5000:
        answer, loop_ms = once_ms(lambda: by_loop(a, b))
        check("loop", answer, expected)
        mark = " "
    else:
        _, part_ms = once_ms(lambda: by_loop(a, b, origins=LOOP_ORIGINS))
        loop_ms, mark = part_ms * n / LOOP_ORIGINS, "~"
    reference = ks_reference(a)
    rows: list[tuple[str, float, float]] = []
    chosen = _core.instruction_set()
    for name in ("", *_core.available_instruction_sets()):
        os.environ[INSTRUCTION_SET] = name
        check(name, integers(ks_compare(a, b)), expected)
        check(name, integers(reference.compare(b)), expected)
        rows.append(
            (
                name or f"chosen ({chosen})",
                median_ms(lambda: ks_compare(a, b), repeats),
                median_ms(lambda: reference.compare(b), repeats),
            )
        )
    os.environ[INSTRUCTION_SET] = ""
    for name, unsorted_ms, presorted_ms in rows:
        print(
            f"{n:>7} {name:<16} {unsorted_ms:>10.3f} {presorted_ms:>10.3f} {numpy_ms:>11.0f} "
            f"{mark}{loop_ms:>9.0f} {numpy_ms / unsorted_ms:>9.0f} {loop_ms / unsorted_ms:>9.0f}"
        )
    permutations_ms = median_ms(
        lambda: block_permutation_test(a, b, block_length=10, permutations=100, seed=1), 3
    )
    peacock_ms = median_ms(lambda: ks_compare(a, b, method="peacock"), 5)
    print(
        f"{'':>7} a permutation {permutations_ms / 100:.3f}, Peacock's statistic {peacock_ms:.3f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[1000, 5000, 18_000, 50_000])
    parser.add_argument("--repeats", type=int, default=30)
    options = parser.parse_args()
    print("Medians in ms; ratios to ours unsorted. Both samples have n points.")
    print(
        f"{'n':>7} {'ours on':<16} {'unsorted':>10} {'prepared':>10} {'numpy':>11} {'loop':>10} "
        f"{'numpy/ours':>9} {'loop/ours':>9}"
    )
    for n in options.sizes:
        bench(n, options.repeats)


if __name__ == "__main__":
    main()
