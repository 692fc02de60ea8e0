"""Threads of linear algebra."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
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


def _factor_in_one_thread() -> bytes:
    from scipy.linalg import cho_factor

    # As large as the information matrix of a fit: OpenBLAS uses several threads from some 100 on.
    generator = np.random.default_rng(0)
    half = generator.normal(size=(700, 900))
    with one_blas_thread():
        assert set(_threads()) == {1}
        return bytes(cho_factor(half @ half.T + 700.0 * np.eye(700))[0].tobytes())


def test_another_thread_computes_the_same_bits() -> None:
    """Also after the main thread has limited the libraries, and while it does."""
    with threadpool_limits(limits=2, user_api="blas"):
        before = _threads()
        here = _factor_in_one_thread()
        with ThreadPoolExecutor(1) as pool:
            assert pool.submit(_factor_in_one_thread).result() == here
        assert _threads() == before
        assert _factor_in_one_thread() == here


def test_the_last_of_several_threads_restores_the_limits() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = _threads()
        mine = one_blas_thread()
        mine.__enter__()
        with ThreadPoolExecutor(1) as pool:
            other = one_blas_thread()
            pool.submit(other.__enter__).result()
            mine.__exit__(None, None, None)
            assert set(_threads()) == {1}
            pool.submit(other.__exit__, None, None, None).result()
        assert _threads() == before
