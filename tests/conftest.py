"""Fixtures shared by all tests, and how Hypothesis searches in them."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Tests run side by side, one a core: threads of the linear algebra would only wait for each other.
# This is read when NumPy is loaded, and passed on to the commands that tests start.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# FFmpeg keeps the level that it finds when a process opens its first video. Here that may be a
# test's own; later ones look at what a command prints.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

# The same examples in every run, and no bar on their time: whether a test passes tells about the
# code, not about the machine or the day. `--hypothesis-profile=default` searches anew.
settings.register_profile(
    "repeatable",
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("repeatable")

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Callable[[str], Path]:
    """Return a function that gives the folder of a reference recording, or skips the test."""

    def folder(name: str) -> Path:
        path = SHARED_DATA / name
        if not path.is_dir():
            pytest.skip(f"reference recording '{name}' is not on this machine ({path})")
        return path

    return folder
