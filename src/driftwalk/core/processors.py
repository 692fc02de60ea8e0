"""How many processors there are to use."""

from __future__ import annotations

import os


def default_threads() -> int:
    """Return how many threads to use: the processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
