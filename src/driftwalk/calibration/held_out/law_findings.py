"""Findings of a recording on a law, the same for each command: against it, and those left open.

One law has one verdict: `calibrate` and `compare-models` both ask here. A comparison adds what
other models say, a calibration what the values of the parameters say.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.held_out.bouts import BoutDistance, bout_sentences
from driftwalk.calibration.held_out.candidates import Candidate, takes_recorded_clearance
from driftwalk.calibration.held_out.held_out_score import (
    VERDICT,
    HeldOutScore,
    held_out_differences,
)
from driftwalk.calibration.held_out.recorded import CHECKS, RecordedMotion
from driftwalk.calibration.stationarity import unsteady_motion
from driftwalk.core.units import in_percent
from driftwalk.simulation.series import is_series


class MisfitPolicy(NamedTuple):
    """Which misfit of the summaries of a motion speaks against a law."""

    usual_quantile: float = 0.95
    """Quantile of the misfits of the law's own recordings up to which one is usual: one in twenty
    is called unlike it."""
    against: float = 1.5
    """Misfit, in that quantile, from which it speaks against the law: at most 1.23 in 160
    recordings of the law itself (studies/motion_models), 3.5 and more on wrong ones."""


MISFIT: Final = MisfitPolicy()


class Misfit(NamedTuple):
    """How far the summaries of a recording are from those of a law's own recordings."""

    value: float
    """Sum of squares of the summaries' deviations, in standard deviations."""
    upper: float
    """Its 95 % quantile over the law's own recordings."""

    @property
    def usual(self) -> bool:
        """Whether the summaries are like those of the law's own recordings."""
        return self.value <= self.upper

    @property
    def against(self) -> bool:
        """Whether they speak against the law, and are not just less usual."""
        return self.value > MISFIT.against * self.upper

    def sentence(self) -> str:
        """Return it in words.

        Examples
        --------
        >>> Misfit(812.3, 140.2).sentence()
        "summaries of the motion: a misfit of 812, that of the model's own recordings is below 140"
        """
        return (
            f"summaries of the motion: a misfit of {self.value:.0f}, that of the model's own "
            f"recordings is below {self.upper:.0f}"
        )


class Findings(NamedTuple):
    """Findings of a recording on a law."""

    against: list[str]
    """Where it differs, the worst first."""
    unable: list[str]
    """Which tests could not tell, with what would be needed."""


def law_findings(
    entry: Candidate,
    held_out: HeldOutScore,
    motion: RecordedMotion,
    *,
    misfit: Misfit | None,
    bouts: Sequence[BoutDistance] = (),
) -> Findings:
    """Return what a recording says of a law.

    Against it are the aspects and facts of the odd blocks that it misses, a misfit of the summaries
    far beyond its own limit, and bouts that last otherwise. Open is a misfit just beyond it, or in
    a flow that has errors; whether a place near the wall fits that a doubtful clearance decides;
    and a motion that is not steady, in a flow that is.

    Parameters
    ----------
    entry : Candidate
        The law.
    held_out : HeldOutScore
        How it does on the odd blocks.
    motion : RecordedMotion
        The recording.
    misfit : Misfit or None
        Of the summaries; None where they were not matched.
    bouts : sequence of BoutDistance
        How long bouts last.
    """
    recorded = takes_recorded_clearance(entry.model, motion)
    allowed = motion.clearance_distance if recorded else 0.0
    against = held_out_differences(held_out, motion, allowed=allowed)
    unable: list[str] = []
    if misfit is not None and not misfit.usual:
        if entry.model.needs_flow:
            # Its own recordings have the flow without error.
            unable.append(
                f"{misfit.sentence()}; errors of the flow may do that: fit flow and body together "
                "(`driftwalk fit`)"
            )
        else:
            (against if misfit.against else unable).append(misfit.sentence())
    if misfit is None or not misfit.against:
        against += bout_sentences(tuple(bouts))
    if allowed > _wall_limit(motion):
        unable.append(
            "the body was hardly at the wall, so that its distance from it at contact is "
            f"uncertain ({1e3 * motion.clearance.distance:.1f} ± "
            f"{1e3 * motion.clearance.std:.1f} mm): state the clearance"
        )
    # In a flow that changes the model is not steady either.
    unable += [] if is_series(motion.like.flow) else unsteady_motion(motion)
    share = motion.recorded_checks[CHECKS.index("wall_share")]
    if share > VERDICT.most_wall_share:
        unable.insert(
            0,
            f"the body was at the wall for {in_percent(share, decimals=1)} of the time: how it "
            "moves away from it was hardly recorded; record it in a larger tank",
        )
        return Findings([], [*unable, *against])
    return Findings(against, unable)


def _wall_limit(motion: RecordedMotion) -> float:
    """Return the KS distance up to which the place near the wall is like the recording's."""
    own = dict(zip(motion.held.names, motion.own, strict=True))
    return VERDICT.most_over_own * float(own.get("wall", np.inf))
