"""Runs that are killed, interrupted or halted by themselves, after a chosen number of work units.

A test that watches a run from outside and acts when it sees something comes too late on some
machine. These runs act on themselves, so a test finds them always at the same place.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager


def after_units(sent: signal.Signals, *counts: int) -> str:
    """Return lines of Python that send a process a signal when it has stored so many units."""
    return f"""
import os, signal
from driftwalk.core.files import shards
store_unit, stored = shards.ShardStore.write, []
def store_and_signal(self, unit, arrays):
    store_unit(self, unit, arrays)
    stored.append(unit)
    if len(stored) in {counts!r}:
        os.kill(os.getpid(), signal.{sent.name})
shards.ShardStore.write = store_and_signal
"""


def until_halted(process: subprocess.Popen[str]) -> None:
    """Wait until a process has halted itself; it must not end instead."""
    what = os.WSTOPPED | os.WEXITED | os.WNOWAIT | os.WNOHANG
    deadline = time.monotonic() + 300
    while (found := os.waitid(os.P_PID, process.pid, what)) is None:
        assert time.monotonic() < deadline, "the run makes no progress"
        time.sleep(0.005)
    assert found.si_code == os.CLD_STOPPED, process.communicate()


@contextmanager
def halted(process: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    """Wait until a process has halted itself; whatever happens, it does not outlive the block."""
    try:
        until_halted(process)
        yield process
    finally:
        process.kill()
        process.wait()


def go_on(process: subprocess.Popen[str]) -> None:
    """Let a halted process go on."""
    process.send_signal(signal.SIGCONT)
