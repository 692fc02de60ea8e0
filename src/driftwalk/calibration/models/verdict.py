"""Whether a motion model explains a recording, and where it does not."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.models.judge import Judged
from driftwalk.calibration.models.recorded import RecordedMotion
from driftwalk.schema.model_words import ASPECT_WORDS, CHECK_WORDS

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MOST_OVER_OWN: Final = 1.5
"""A model explains an aspect up to so many times the distance of the recording's own parts,"""
MOST_WITH_FLOOR: Final = 2.0
"""or so many where its own worlds are as far from each other: recordings of a motion with a long
memory differ by more than the parts of one. A vague model must not profit from its vagueness."""
MOST_CHECKS_OFF: Final = 3
"""Facts outside all worlds of the right model: of eight, more than 3 once in 200 recordings."""


class Verdict(NamedTuple):
    """Whether a model explains a recording."""

    explained: bool
    text: str
    """Where it does not, the worst first; empty where it does."""


def verdict_of(judged: Judged, motion: RecordedMotion, *, baseline: bool) -> Verdict:
    """Compare a model with the recording's own differences, and with facts that are not fitted.

    Parameters
    ----------
    judged : Judged
        The model's distances and facts.
    motion : RecordedMotion
        The recording.
    baseline : bool
        Whether it only repeats recorded steps: then it explains nothing, however near.
    """
    over = judged.held / motion.own
    most = np.clip(judged.apart / motion.own, MOST_OVER_OWN, MOST_WITH_FLOOR)
    off = checks_off(judged.checks, motion.recorded_checks)
    parts = [
        f"{ASPECT_WORDS[motion.held.names[k]]}: D = {judged.held[k]:.3f}, "
        f"the recording's own parts {motion.own[k]:.3f}"
        for k in np.argsort(-over)
        if over[k] > most[k]
    ]
    if np.count_nonzero(off) > MOST_CHECKS_OFF:
        names = [words for words, is_off in zip(CHECK_WORDS.values(), off, strict=True) if is_off]
        parts.append(f"beyond all its worlds: {', '.join(names)}")
    if baseline:
        parts.insert(0, "it repeats recorded steps and knows no arena")
    return Verdict(not parts, "; ".join(parts))


def checks_off(worlds: Floats, recorded: Floats) -> Bools:
    """Return which facts of a recording lie beyond those of all worlds, shape (checks,)."""
    with np.errstate(invalid="ignore"):
        inside = (worlds.min(axis=0) <= recorded) & (recorded <= worlds.max(axis=0))
    known = np.isfinite(recorded)
    return np.asarray(known & ~inside)
