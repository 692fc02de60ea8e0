"""Held-out score: a model is searched on the even blocks of time and judged on the odd ones."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.evolution import AspectObjective, Budget, search_minimum
from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.recorded import CHECKS, UNITS, RecordedMotion
from driftwalk.comparison.aspects import AspectReference
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.core.progress import Progress
from driftwalk.motion.protocol import no_numbers
from driftwalk.motion.score import broken_worlds
from driftwalk.schema.answers.facts import AnswerParts, texts
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_WORDS

HELD_OUT_REPLICATES: Final = 20
"""Worlds by which the answer of a search is judged; chosen by hand."""


class HeldOutScore(NamedTuple):
    """A model's answer and how far it is from the recording."""

    point: Floats
    """In the unit cube of the ranges."""
    trained: Floats
    """Median distance from the even blocks in each aspect, shape (aspects,)."""
    held: Floats
    """The same from the odd blocks."""
    score: float
    """Mean of distance over floor in the odd blocks."""
    without: Floats
    """The same without each of the odd blocks, shape (blocks / 2,)."""
    checks: Floats
    """Facts that are not fitted, of each world, shape (worlds, checks)."""
    optimum_scores: Floats = np.empty(0)
    """Scores at the ends of the searches."""
    evaluations: int = 0

    @property
    def score_std(self) -> float:
        """Standard error of the score."""
        return without_error(self.without)

    def behind(self, other: HeldOutScore) -> tuple[float, float]:
        """Return how far the score is behind another one, and the standard error of that."""
        return self.score - other.score, without_error(self.without - other.without)


def score_candidate(
    entry: Candidate, motion: RecordedMotion, *, budget: Budget, tell: Progress | None
) -> HeldOutScore:
    """Search a model on the even blocks of a recording, and judge it on the odd ones."""
    objective = even_blocks(entry, motion)
    if not entry.ranges:
        return score_setting(objective, motion, np.empty(0))
    require_numbers(objective)
    found = search_minimum(objective, len(entry.ranges), budget=budget, seed=motion.seed, tell=tell)
    held_out = score_setting(objective, motion, found.best)
    return held_out._replace(optimum_scores=found.optimum_scores, evaluations=found.evaluations)


def recording_parts(motion: RecordedMotion) -> AnswerParts:
    """Return what each dataset of held-out scores says of its recording."""
    data = {
        "own_distance": ("aspect", motion.own),
        "floor": ("aspect", motion.held.floor),
        "check_recorded": ("check", motion.recorded_checks),
        "check_unit": ("check", texts(UNITS)),
    }
    coords = {"aspect": ("aspect", texts(motion.held.names)), "check": ("check", texts(CHECKS))}
    return AnswerParts(data, coords, {**motion.attrs, "worlds": HELD_OUT_REPLICATES})


def even_blocks(entry: Candidate, motion: RecordedMotion) -> AspectObjective:
    """Return how far a model's settings are from the even blocks of a recording."""
    return AspectObjective(
        entry.model, entry.ranges, entry.like, motion.plan, motion.fitted, motion.seed
    )


def score_setting(
    objective: AspectObjective, motion: RecordedMotion, point: Floats
) -> HeldOutScore:
    """Judge a setting, in the unit cube, on the odd blocks of a recording."""
    seen = objective.simulated(point[None], HELD_OUT_REPLICATES, stage="judged")
    aspects, broken = objective.aspects(seen), broken_worlds(seen.status)

    def distances(reference: AspectReference) -> Floats:
        apart = reference.distances(aspects, threads=objective.like.threads)
        apart[broken] = 1.0
        return apart

    held = distances(motion.held)
    return HeldOutScore(
        point=point,
        trained=np.median(distances(motion.fitted), axis=0),
        held=np.median(held, axis=0),
        score=float(motion.held.overall(held).mean()),
        without=np.array(
            [float(part.overall(distances(part)).mean()) for part in motion.without_each_block]
        ),
        checks=np.array([motion.checks(x, y) for x, y in zip(seen.x, seen.y, strict=True)]),
    )


def require_numbers(objective: AspectObjective) -> None:
    """Refuse a model that loses its numbers wherever it is tried: no search could mend that."""
    from scipy.stats import qmc

    # Eight settings: a model without numbers at all of them has none where a search would look.
    tried = qmc.Sobol(len(objective.ranges), seed=objective.seed).random(8)
    seen = objective.simulated(tried, 1, stage="tried")
    if broken_worlds(seen.status).all():
        values = {name: float(column[0]) for name, column in objective.values(tried).items()}
        raise InputError(no_numbers(objective.model.name, values))


def without_error(without: Floats) -> float:
    """Return the standard error of a mean from what is left without each block (jackknife)."""
    count = without.size
    return float(np.sqrt((count - 1) / count * ((without - without.mean()) ** 2).sum()))


class HeldOutVerdictPolicy(NamedTuple):
    """When a model explains a recording."""

    most_over_own: float = 2.0
    """Distance in distances of the recording's own parts. Measured: simulated recordings of the
    right model have 0.8 to 1.9: the parts of one recording share slow changes."""
    most_ratio: float = 1.5
    """A fact is far off when it exceeds those of all replicates by this factor. Chosen by hand."""
    most_share_apart: float = 0.1
    """A share of the time is far off when it exceeds those of all replicates by this. Chosen by
    hand."""
    most_checks_off: int = 1
    """Facts that may be far off: a KS distance hardly sees tails, which the right model may miss;
    chosen by hand."""
    most_wall_share: float = 0.95
    """Share of the time at the wall beyond which a law away from it cannot be seen: laws were named
    rightly at up to 0.87, and a wrong one at 0.99 (200 recordings of studies/verdict)."""
    tied_sigmas: float = 2.0
    """Models tie within this many standard errors of their difference: the usual 95 %, by
    convention."""


HELD_OUT_VERDICT: Final = HeldOutVerdictPolicy()


def held_out_differences(
    held_out: HeldOutScore, motion: RecordedMotion, *, allowed: float = 0.0
) -> list[str]:
    """Return where a model differs from the odd blocks, in sentences, the worst aspect first.

    `allowed` is what the KS distance of the place near the wall may exceed its limit by.
    """
    at_wall = np.array([name == "wall" for name in motion.held.names])
    over = (held_out.held - allowed * at_wall) / motion.own
    off = checks_off(held_out.checks, motion.recorded_checks)
    found = [
        f"{ASPECT_WORDS[motion.held.names[k]]}: D = {held_out.held[k]:.3f}, "
        f"the recording's own parts {motion.own[k]:.3f}"
        for k in np.argsort(-over)
        if over[k] > HELD_OUT_VERDICT.most_over_own
    ]
    if np.count_nonzero(off) > HELD_OUT_VERDICT.most_checks_off:
        names = [words for words, is_off in zip(CHECK_WORDS.values(), off, strict=True) if is_off]
        found.append(f"far beyond all its replicates: {', '.join(names)}")
    return found


def checks_off(replicates: Floats, recorded: Floats) -> Bools:
    """Return which facts of a recording are far beyond all replicates, shape (checks,)."""
    low, high = replicates.min(axis=0), replicates.max(axis=0)
    share = np.array([name.endswith("_share") for name in CHECKS])
    apart, ratio = HELD_OUT_VERDICT.most_share_apart, HELD_OUT_VERDICT.most_ratio
    lowest = np.where(share, low - apart, low / ratio)
    highest = np.where(share, high + apart, high * ratio)
    with np.errstate(invalid="ignore"):
        near = (lowest <= recorded) & (recorded <= highest)
    return np.asarray(np.isfinite(recorded) & ~near)
