"""A short simulation whose bits must be the same on every worker."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import ClusterError
from driftwalk.flow import uniform_flow
from driftwalk.model import Study, Tank
from driftwalk.simulation import simulate
from driftwalk.sweep import this_worker

BLOCKS: Final = 20
"""More than the lanes of any instruction set, and not a whole number of them."""
DURATION_S: Final = 30.0
SEED: Final = 1729
SHOWN: Final = 12
"""Digits of a hash in a message."""


def probe_digest() -> str:
    """Return the SHA-256 of a short simulation: drag, force and impacts on the wall.

    It is the same on every processor, for every compiler and number of threads.

    Examples
    --------
    >>> len(probe_digest())
    64
    """
    # The flow carries every block to the wall of this narrow tank.
    study = Study(tank=Tank(diameter_m=0.15))
    found = simulate(
        study,
        uniform_flow(0.03, -0.01),
        sample_time=np.arange(0.0, DURATION_S, 0.5),
        replicates=BLOCKS,
        seed=SEED,
        threads=1,
    )
    digest = hashlib.sha256()
    for name in ("x", "y", "theta", "status"):
        digest.update(np.ascontiguousarray(found[name].values).tobytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class SameBits:
    """Lets a process compute only if the probe gives the same bits there.

    Attributes
    ----------
    expected : str
        What `probe_digest` gives on the machine of the run.
    """

    expected: str

    def __call__(self) -> None:
        """Raise where this process has other bits.

        Raises
        ------
        ClusterError
            Names the machine.
        """
        refuse_other_bits(self.expected, probe_digest(), this_worker())


def refuse_other_bits(expected: str, found: Any, who: str) -> None:
    """Raise where a probe gave other bits.

    Parameters
    ----------
    expected : str
        What this machine gives.
    found : Any
        What was found elsewhere.
    who : str
        Where, for the message.

    Raises
    ------
    ClusterError
        Names the machine.

    Examples
    --------
    >>> refuse_other_bits("60d1", "60d1", "a worker on node7")
    """
    if found != expected:
        raise ClusterError(
            f"{who} computes other numbers than this machine: a short simulation gave "
            f"{str(found)[:SHOWN]} there, {expected[:SHOWN]} here; install the same driftwalk "
            "there, from the same package"
        )
