"""The verdict on each compared model, and on the comparison as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from driftwalk.calibration.held_out.bouts import bout_sentences
from driftwalk.calibration.held_out.candidates import Candidate, takes_recorded_clearance
from driftwalk.calibration.held_out.held_out_score import (
    VERDICT,
    HeldOutScore,
    held_out_differences,
)
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.ranking.model_evidence import (
    EVIDENCE,
    Evidence,
    EvidenceRanking,
    discrepancy_sentence,
)
from driftwalk.schema.answers.verdict import (
    CANNOT_TELL,
    EXPLAINS,
    Verdict,
    verdict_of,
)


def model_verdicts(
    entries: Sequence[Candidate],
    held_out: Sequence[HeldOutScore],
    motion: RecordedMotion,
    evidence: Mapping[int, Evidence],
    answer: EvidenceRanking,
) -> list[Verdict]:
    """Return the verdict on each model; the closest comes first.

    `evidence` has the models whose summaries were matched, by their places. Against a model are
    the aspects and facts of the odd blocks that it misses, its misfit of the summaries beyond its
    own limit, bouts that last otherwise, and another model that is clearly closer or likelier. Its
    verdict is "cannot tell" where the summaries were not matched, or not in a flow that has errors,
    where a walk of recorded steps passes all tests as well, and where the place near the wall
    cannot be judged.
    """
    behind, error = np.array([one.behind(held_out[0]) for one in held_out]).T
    clearly_behind = behind > VERDICT.tied_sigmas * error
    passing = [
        entry.model.name
        for k, (entry, one) in enumerate(zip(entries, held_out, strict=True))
        if entry.baseline
        and k in evidence
        and evidence[k].usual
        and not held_out_differences(one, motion)
    ]
    found = []
    for k, (entry, one) in enumerate(zip(entries, held_out, strict=True)):
        recorded = takes_recorded_clearance(entry.model, motion)
        allowed = motion.clearance_distance if recorded else 0.0
        against = held_out_differences(one, motion, allowed=allowed)
        unlike = _unlike(k, entries, evidence, answer)
        # Its own recordings have the flow without error.
        unsure = unlike if entry.model.needs_flow else []
        against += [] if unsure else unlike
        # Those that the summaries speak for stand beside the first.
        if not against and clearly_behind[k] and k not in (answer.best, *answer.rivals):
            against.append(f"{entries[0].model.name} is clearly closer")
        if entry.baseline:
            against.insert(0, "it repeats recorded steps and knows no arena")
        unable = [] if k in evidence else [_not_matched(motion)]
        if unsure:
            unable.append(
                f"{'; '.join(unsure)}; errors of the flow may do that: fit flow and body together "
                "(`driftwalk fit`)"
            )
        if passing:
            unable.append(
                f"a walk that only repeats recorded steps ({passing[0]}) passes every test as "
                "well: record for longer, or where the body meets the wall"
            )
        if allowed > _wall_limit(motion):
            unable.append(
                "the body was hardly at the wall, so that its distance from it at contact is "
                f"uncertain ({1e3 * motion.clearance.distance:.1f} ± "
                f"{1e3 * motion.clearance.std:.1f} mm): state the clearance"
            )
        found.append(verdict_of(against, [] if against else unable))
    return found


def _unlike(
    k: int,
    entries: Sequence[Candidate],
    evidence: Mapping[int, Evidence],
    answer: EvidenceRanking,
) -> list[str]:
    """Return what the summaries of the motion have against a model."""
    if k not in evidence:
        return []
    if (misfit := discrepancy_sentence(evidence[k])) is not None:
        return [misfit]
    if others := list(bout_sentences(evidence[k].bouts)):
        return others
    if answer.best is None or k == answer.best or k in answer.rivals or entries[k].baseline:
        return []
    return [f"{entries[answer.best].model.name} is clearly likelier by the summaries of the motion"]


def _not_matched(motion: RecordedMotion) -> str:
    if motion.replicates < 2:
        return "the summaries of the motion were not matched: compare with `bootstrap` above 1"
    return (
        "its summaries of the motion were not matched, but those of "
        f"{EVIDENCE.most_models} others: compare fewer models"
    )


def _wall_limit(motion: RecordedMotion) -> float:
    """Return the KS distance up to which the place near the wall is like the recording's."""
    own = dict(zip(motion.held.names, motion.own, strict=True))
    return VERDICT.most_over_own * float(own.get("wall", np.inf))


def answer_sentence(
    entries: Sequence[Candidate],
    verdicts: Sequence[Verdict],
    first: int,
    as_good: Sequence[int] = (),
) -> str:
    """Return the verdict of the comparison in one sentence.

    `first` is the model that the summaries name, or the closest one where they name none. A model
    that explains the recording is better than one that does not. Where those that are `as_good` as
    the first explain it too, the recording does not tell them apart.
    """
    words = [one.word for one in verdicts]
    names = [entry.model.name for entry in entries]
    explaining = [k for k, word in enumerate(words) if word == EXPLAINS]
    if not explaining and CANNOT_TELL in words:
        best = first if words[first] == CANNOT_TELL else words.index(CANNOT_TELL)
        reasons = "; ".join(verdicts[best].reasons)
        return f"Cannot tell whether {names[best]} explains the recording: {reasons}"
    if not explaining:
        return f"No model explains the recording; the best one is {names[first]}"
    best = first if first in explaining else explaining[0]
    others = [k for k in explaining if k != best]
    equal = [names[k] for k in as_good if best == first and k in others]
    if equal:
        return (
            f"Cannot tell which model explains the recording: {names[best]} does, and as likely "
            f"{' and '.join(equal)}; a longer recording is needed"
        )
    also = f"; so do others, but no better: {', '.join(names[k] for k in others)}" if others else ""
    return f"{names[best]} explains the recording{also}"
