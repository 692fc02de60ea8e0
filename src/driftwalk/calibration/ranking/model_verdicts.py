"""The verdict on each compared model, and on the comparison as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import (
    VERDICT,
    HeldOutScore,
    held_out_differences,
)
from driftwalk.calibration.held_out.law_findings import law_findings
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.ranking.model_evidence import (
    EVIDENCE,
    Evidence,
    EvidenceRanking,
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

    `evidence` has the models whose summaries were matched, by their places. To what the recording
    says of a law (`law_findings`) a comparison adds: against a model is another one that is clearly
    closer or likelier. Its verdict is "cannot tell" where the summaries were not matched, where it
    is at the end of its range, where a walk of recorded steps passes all tests as well, where
    another model that explains the recording is as likely and no more complicated, and where a
    simpler one that does not explain it is as likely.
    """
    behind, error = np.array([one.behind(held_out[0]) for one in held_out]).T
    clearly_behind = behind > VERDICT.tied_sigmas * error
    passing = [
        entry.model.name
        for k, (entry, one) in enumerate(zip(entries, held_out, strict=True))
        if entry.baseline
        and k in evidence
        and evidence[k].misfit.usual
        and not held_out_differences(one, motion)
    ]
    found = []
    for k, (entry, one) in enumerate(zip(entries, held_out, strict=True)):
        asked = evidence.get(k)
        against, unable = law_findings(
            entry,
            one,
            motion,
            misfit=None if asked is None else asked.misfit,
            bouts=() if asked is None else asked.bouts,
        )
        # Those that the summaries speak for stand beside the first.
        named = k in (answer.best, *answer.rivals)
        if asked is not None and not (named or asked.misfit.against or answer.best is None):
            against += [
                f"{entries[answer.best].model.name} is clearly likelier by the summaries of the "
                "motion"
            ]
        if not against and clearly_behind[k] and not named:
            against.append(f"{entries[0].model.name} is clearly closer")
        if entry.baseline:
            against.insert(0, "it repeats recorded steps and knows no arena")
        if asked is None:
            unable.insert(0, _not_matched(motion))
        if (ended := entry.at_range_end(one.point)) is not None:
            unable.append(ended)
        if passing:
            unable.append(
                f"a walk that only repeats recorded steps ({passing[0]}) passes every test as "
                "well: record for longer, or where the body meets the wall"
            )
        found.append(verdict_of(against, [] if against else unable))
    if answer.best is not None:
        as_good = answer.as_good(entries, evidence)
        _doubt_equals(found, entries, answer.best, answer.rivals, as_good)
    return found


def _doubt_equals(
    found: list[Verdict],
    entries: Sequence[Candidate],
    best: int,
    rivals: Sequence[int],
    as_good: Sequence[int],
) -> None:
    """Leave open which of several models explains a recording, where they are equally good."""
    if not found[best].explains:
        # One that passes by its further numbers and is no likelier may lack the same.
        why = (
            f"{entries[best].model.name} is simpler and as likely, and does not explain it: the "
            "law may be another one; record for longer"
        )
        for k in rivals:
            if found[k].explains:
                found[k] = found[k].and_also([], [why])
        return
    equal = [k for k in as_good if found[k].explains]
    if not equal:
        return
    for k in (best, *equal):
        others = " and ".join(entries[one].model.name for one in (best, *equal) if one != k)
        found[k] = found[k].and_also(
            [], [f"{others} explains it as well and is as likely: record for longer"]
        )


def _not_matched(motion: RecordedMotion) -> str:
    if motion.replicates < 2:
        return "the summaries of the motion were not matched: compare with `bootstrap` above 1"
    return (
        "its summaries of the motion were not matched, but those of "
        f"{EVIDENCE.most_models} others: compare fewer models"
    )


def answer_sentence(entries: Sequence[Candidate], verdicts: Sequence[Verdict], first: int) -> str:
    """Return the verdict of the comparison in one sentence.

    `first` is the model that the summaries name, or the closest one where they name none. A model
    that explains the recording is better than one that does not.
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
    others = [names[k] for k in explaining if k != best]
    also = f"; so do others, but no better: {', '.join(others)}" if others else ""
    return f"{names[best]} explains the recording{also}"
