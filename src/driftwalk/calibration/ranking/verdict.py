"""Whether a motion model explains a recording, and where it does not."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.held_out.checks import CHECKS
from driftwalk.calibration.held_out.held_out_score import HeldOutScore
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.core.arrays import Bools, Floats
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_WORDS


class VerdictPolicy(NamedTuple):
    """When a model explains a recording."""

    most_over_own: float = 2.0
    """Distance in distances of the recording's own parts. Simulated recordings of the right model
    have 0.8 to 1.9: the parts of one recording share slow changes."""
    most_ratio: float = 1.5
    """A fact is far off when it exceeds those of all replicates by this factor. Chosen by hand."""
    most_share_apart: float = 0.1
    """A share of the time is far off when it exceeds those of all replicates by this. Chosen by
    hand."""
    most_checks_off: int = 1
    """Facts that may be far off: a KS distance hardly sees tails, which the right model may
    miss."""
    tied_sigmas: float = 2.0
    """Models tie within this many standard errors of their difference: the usual 95 %."""


VERDICT: Final = VerdictPolicy()


class Verdict(NamedTuple):
    """Whether a model explains a recording."""

    explained: bool
    text: str
    """Where it does not, the worst first; empty where it does."""


def verdict_of(
    held_out: HeldOutScore,
    motion: RecordedMotion,
    *,
    baseline: bool,
    clearly_behind: str | None = None,
    unlike: str | None = None,
) -> Verdict:
    """Compare a model with the recording's own differences, and with facts that are not fitted."""
    over = held_out.held / motion.own
    off = checks_off(held_out.checks, motion.recorded_checks)
    parts = [
        f"{ASPECT_WORDS[motion.held.names[k]]}: D = {held_out.held[k]:.3f}, "
        f"the recording's own parts {motion.own[k]:.3f}"
        for k in np.argsort(-over)
        if over[k] > VERDICT.most_over_own
    ]
    if np.count_nonzero(off) > VERDICT.most_checks_off:
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
    """Return which facts of a recording are far beyond those of all worlds, shape (checks,)."""
    low, high = worlds.min(axis=0), worlds.max(axis=0)
    share = np.array([name.endswith("_share") for name in CHECKS])
    lowest = np.where(share, low - VERDICT.most_share_apart, low / VERDICT.most_ratio)
    highest = np.where(share, high + VERDICT.most_share_apart, high * VERDICT.most_ratio)
    with np.errstate(invalid="ignore"):
        near = (lowest <= recorded) & (recorded <= highest)
    return np.asarray(np.isfinite(recorded) & ~near)
