"""Whether a motion model explains a recording, and where it does not."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.held_out.checks import CHECKS
from driftwalk.calibration.held_out.held_out_score import Judged
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_WORDS

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MOST_OVER_OWN: Final = 2.0
"""A model explains an aspect up to so many times the distance of the recording's own parts. The
parts of one recording share slow changes that another recording of the same motion has not: the
answers for simulated recordings of the right model came to 0.8 to 1.9 times it."""
MOST_RATIO: Final = 1.5
"""A fact is far off beyond all worlds of a model by more than this factor,"""
MOST_SHARE_APART: Final = 0.1
"""a share of the time by more than this. A KS distance hardly sees the tails of a distribution, and
the answer for the right model may miss those."""
MOST_CHECKS_OFF: Final = 1


class Verdict(NamedTuple):
    """Whether a model explains a recording."""

    explained: bool
    text: str
    """Where it does not, the worst first; empty where it does."""


def verdict_of(
    judged: Judged,
    motion: RecordedMotion,
    *,
    baseline: bool,
    clearly_behind: str | None = None,
    unlike: str | None = None,
) -> Verdict:
    """Compare a model with the recording's own differences, and with facts that are not fitted.

    Parameters
    ----------
    judged : Judged
        The model's distances and facts.
    motion : RecordedMotion
        The recording.
    baseline : bool
        Whether it only repeats recorded steps: then it explains nothing, however near.
    clearly_behind : str, optional
        A model that is closer by more than chance: so this one differs from the recording.
    unlike : str, optional
        How far its summaries are from those of the recording, where another model gives them.
    """
    over = judged.held / motion.own
    off = checks_off(judged.checks, motion.recorded_checks)
    parts = [
        f"{ASPECT_WORDS[motion.held.names[k]]}: D = {judged.held[k]:.3f}, "
        f"the recording's own parts {motion.own[k]:.3f}"
        for k in np.argsort(-over)
        if over[k] > MOST_OVER_OWN
    ]
    if np.count_nonzero(off) > MOST_CHECKS_OFF:
        names = [words for words, is_off in zip(CHECK_WORDS.values(), off, strict=True) if is_off]
        parts.append(f"far beyond all its worlds: {', '.join(names)}")
    if unlike is not None:
        parts.append(unlike)
    if not parts and clearly_behind is not None:
        parts.append(f"{clearly_behind} is clearly closer")
    if baseline:
        parts.insert(0, "it repeats recorded steps and knows no arena")
    return Verdict(not parts, "; ".join(parts))


def checks_off(worlds: Floats, recorded: Floats) -> Bools:
    """Return which facts of a recording are far beyond those of all worlds, shape (checks,).

    Parameters
    ----------
    worlds : ndarray, shape (worlds, checks)
        Facts of simulated worlds, see `motion_checks`.
    recorded : ndarray, shape (checks,)
        Those of the recording; NaN where it is too short for one.
    """
    low, high = worlds.min(axis=0), worlds.max(axis=0)
    share = np.array([name.endswith("_share") for name in CHECKS])
    lowest = np.where(share, low - MOST_SHARE_APART, low / MOST_RATIO)
    highest = np.where(share, high + MOST_SHARE_APART, high * MOST_RATIO)
    with np.errstate(invalid="ignore"):
        near = (lowest <= recorded) & (recorded <= highest)
    return np.asarray(np.isfinite(recorded) & ~near)
