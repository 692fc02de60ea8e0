"""Work in another thread: its result, its errors, and that it ends when nobody waits for it."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from driftwalk.core.processors import run_in_background


def test_both_are_under_way_at_once() -> None:
    met = threading.Barrier(2, timeout=30.0)
    here = threading.get_ident()

    def work(_: Callable[[int, int], None]) -> int:
        met.wait()
        return threading.get_ident()

    assert run_in_background(work, met.wait) != here


def test_an_error_of_the_work_comes_when_the_other_is_done() -> None:
    done = []

    def work(_: Callable[[int, int], None]) -> None:
        raise ValueError("of the work")

    with pytest.raises(ValueError, match="of the work"):
        run_in_background(work, lambda: done.append(1))
    assert done == [1]


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_work_ends_at_its_next_step_when_the_other_fails(error: type[BaseException]) -> None:
    failed = threading.Event()
    steps = []

    def work(progress: Callable[[int, int], None]) -> None:
        assert failed.wait(30.0)
        for step in range(1000):
            steps.append(step)
            # Long enough for the other thread to take notice of its own error.
            threading.Event().wait(0.02)
            progress(step, 1000)

    def meanwhile() -> None:
        failed.set()
        raise error

    with pytest.raises(error):
        run_in_background(work, meanwhile)
    assert 1 <= len(steps) < 1000
