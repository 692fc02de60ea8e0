"""Power of the criteria of the check: the misfit that each would find nine times in ten.

A criterion fails at `level`. From the distribution of its statistic under the model follows the
alternative at which it fails with probability `POWER.share`: the noncentrality of a chi squared, or
standard deviations of a normal. Criteria, scan, posterior predictive test and measured flow share
it, so it stands below them.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple


class PowerPolicy(NamedTuple):
    """The power at which detectable misfits are stated."""

    share: float = 0.9
    """Share of recordings in which a misfit of the stated size is found; by convention."""


POWER: Final = PowerPolicy()


def detectable_sigmas(level: float) -> float:
    """Return the shift of a normal, in its standard deviations, that a one-sided level finds.

    Examples
    --------
    >>> round(detectable_sigmas(0.025), 2)
    3.24
    """
    from scipy.stats import norm

    return float(norm.isf(level) + norm.ppf(POWER.share))


def detectable_noncentrality(dof: float, level: float) -> float:
    """Return the noncentrality of a chi squared that a level finds.

    Examples
    --------
    >>> round(detectable_noncentrality(1.0, 0.05), 1)  # (1.96 + 1.28) ** 2
    10.5
    """
    from scipy.optimize import brentq
    from scipy.stats import chi2, ncx2

    limit = float(chi2.isf(level, dof))
    most = (math.sqrt(limit) + 10.0) ** 2
    return float(brentq(lambda size: ncx2.sf(limit, dof, size) - POWER.share, 1e-9, most))
