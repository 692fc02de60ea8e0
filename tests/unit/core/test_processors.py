"""Threads of linear algebra."""

from __future__ import annotations

from threadpoolctl import threadpool_info, threadpool_limits

from driftwalk.core.processors import one_blas_thread


def _threads() -> list[int]:
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


def test_every_library_of_linear_algebra_has_one_thread_meanwhile() -> None:
    import scipy.linalg  # noqa: F401

    with threadpool_limits(limits=2, user_api="blas"):
        before = _threads()
        assert 2 in before
        with one_blas_thread():
            assert set(_threads()) == {1}
            assert len(_threads()) == len(before)
        assert _threads() == before


def test_calls_that_overlap_restore_the_threads_at_the_end_of_the_last() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = _threads()
        one, other = one_blas_thread(), one_blas_thread()
        one.__enter__()
        other.__enter__()
        one.__exit__(None, None, None)
        assert set(_threads()) == {1}
        other.__exit__(None, None, None)
        assert _threads() == before
