"""The result of a search over laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from driftwalk.likelihood.law.score_tests import Trial
from driftwalk.likelihood.newton import Mode


@dataclass(frozen=True, eq=False)
class LawFound:
    """Result of a search over laws."""

    mode: Mode
    base: Mode
    """The mode of the law alone, without departures."""
    floating: bool
    """Whether the water's own acceleration pushes the body."""
    evidence: Mapping[str, float]
    """Logarithm of the evidence for each law that was fitted, without its constant."""
    settled_by: float
    """Logarithm of the evidence for the law over that for the other; infinite where one law alone
    was fitted."""
    trial: Trial | None
    """The last score tests of what is closed; nothing where they broke down."""
