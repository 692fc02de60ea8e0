"""The stages of a calibration, whose names begin those of its sweeps."""

from __future__ import annotations

from typing import Final, NamedTuple


class Stage(NamedTuple):
    """A stage of a calibration."""

    words: str
    """Name for people."""
    begin: float
    end: float
    """Its share of the time of the calibration: from, to [%]."""

    def percent(self, share: float) -> float:
        """Return how much of the calibration is done when a share of this stage is [%].

        Examples
        --------
        >>> CALIBRATION_STAGES["refined"].percent(0.5)
        52.5
        """
        return self.begin + share * (self.end - self.begin)


CALIBRATION_STAGES: Final[dict[str, Stage]] = {
    "coarse": Stage("map", 0.0, 40.0),
    "refined": Stage("refined map", 40.0, 65.0),
    "bootstrap": Stage("bootstrap", 65.0, 93.0),
    "validation": Stage("halves", 93.0, 98.0),
    # of more than two parameters: the search is made only where the summaries find no match
    "summaries": Stage("summaries", 0.0, 90.0),
    "search": Stage("search", 40.0, 60.0),
    "longer-search": Stage("longer search", 90.0, 95.0),
    "judged": Stage("held-out blocks", 95.0, 98.0),
}


def tell_nobody(*_: object) -> None:
    """Leave progress unsaid: what long work calls where nobody asks how far it is."""
