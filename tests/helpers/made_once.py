"""Results that tests share: each is made once in a session, by the worker that needs it first."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from filelock import FileLock

# The folder that the workers of a session share. `conftest.py` sets it; without it nothing is kept.
SHARED = "DRIFTWALK_TEST_RESULTS"
T = TypeVar("T")


def made_once(name: str, make: Callable[[], T]) -> T:
    """Return what `make` returns, from a file if another worker has made it already."""
    shared = os.environ.get(SHARED)
    if shared is None:
        return make()
    stored = Path(shared) / f"{name.replace('/', '-')}.pickle"
    with FileLock(f"{stored}.lock"):
        if stored.exists():
            return pickle.loads(stored.read_bytes())
        made = make()
        stored.write_bytes(pickle.dumps(made))
    return made


def shared_folder(name: str, other: Path) -> Path:
    """Return the folder of a run that the workers of a session share, or the other one."""
    shared = os.environ.get(SHARED)
    return other if shared is None else Path(shared) / name
