"""Processes for a sweep: single-threaded, deaf to Ctrl-C, and gone with their parent."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from driftwalk.sweep.workers import LINEAR_ALGEBRA_THREADS, single_threaded_processes

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for_end(pid: int) -> None:
    deadline = time.monotonic() + 30.0
    while alive(pid):
        assert time.monotonic() < deadline, "the process lives on"
        time.sleep(0.02)


def test_linear_algebra_has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with single_threaded_processes(1) as executor:
        assert list(executor.map(os.getenv, LINEAR_ALGEBRA_THREADS)) == ["1"] * 4
        process = executor.submit(os.getpid).result()
        # Ctrl-C on a terminal goes to all processes of a group.
        os.kill(process, signal.SIGINT)
        assert executor.submit(os.getpid).result() == process
    wait_for_end(process)
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_they_end_when_an_error_leaves_the_block() -> None:
    seen = []

    def interrupted() -> None:
        with single_threaded_processes(1) as executor:
            seen.append(executor.submit(os.getpid).result())
            executor.submit(time.sleep, 600.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    wait_for_end(seen[0])


@pytest.mark.slow
def test_they_end_when_their_parent_is_killed() -> None:
    code = (
        "import os, time\n"
        "from driftwalk.sweep.workers import single_threaded_processes\n"
        "with single_threaded_processes(1) as executor:\n"
        "    print(executor.submit(os.getpid).result(), flush=True)\n"
        "    executor.submit(time.sleep, 600.0).result()\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    process = int(parent.stdout.readline())
    assert alive(process)
    parent.kill()
    parent.communicate()
    wait_for_end(process)
