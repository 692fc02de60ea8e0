"""How long a fit of half an hour and its check take, stage by stage, and their memory.

    python benchmarks/bench_fit.py [--rates 10 100] [--minutes 30] [--profile]

A simulated recording of the default study in the bundled flow, with 0.3 mm and 0.5 degrees of
noise, at each rate [Hz]. One run each, in a process of its own, on one thread: the processor time of
each stage, and the peak memory of the process after it. `--profile` prints where the time of the
native filter goes instead.

Checked, else the script fails: C_d and σ_F are within a tenth of the truth, and the model explains
the recording.
"""

from __future__ import annotations

import argparse
import functools
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from timing import machine

import driftwalk as dw
from driftwalk.likelihood import fit, reml
from driftwalk.likelihood.check import check_model

TARGET_S = {10.0: 10.0, 100.0: 20.0}
TARGET_MB = 500.0
TOLERANCE = 0.1
POSITION_NOISE_M, ORIENTATION_NOISE_RAD = 3e-4, 0.00873


def memory_mb() -> float:
    """The largest resident memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
