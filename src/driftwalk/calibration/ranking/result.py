"""The `model_comparison` dataset: motion models from the closest to the farthest, with verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_VERDICT,
    HeldOutScore,
    held_out_differences,
    recording_parts,
)
from driftwalk.calibration.held_out.law_findings import law_findings
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.ranking.model_evidence import (
    EVIDENCE,
    Evidence,
    EvidenceRanking,
    rank_by_evidence,
    ranking_sentence,
    with_matched_settings,
)
from driftwalk.calibration.stationarity import stationarity_of_motion, unsteady_motion
from driftwalk.core.arrays import Floats
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.answers.verdict import (
    CANNOT_TELL,
    DOES_NOT_EXPLAIN,
    EXPLAINS,
    Verdict,
    verdict_of,
)
from driftwalk.schema.check import build_dataset
from driftwalk.simulation.series import series_warnings

if TYPE_CHECKING:
    import xarray as xr


def build_comparison(
    entries: Sequence[Candidate],
    held_out: Sequence[HeldOutScore],
    motion: RecordedMotion,
    warnings: Sequence[str],
    evidence_by_model: Mapping[int, Evidence],
) -> xr.Dataset:
    """Return the dataset of a comparison; `entries` and `held_out` have one item for each model.

    `evidence_by_model` has those whose summaries were matched, by their places among them.
    """
    held_out = with_matched_settings(held_out, evidence_by_model, motion)
    order = np.argsort([one.score for one in held_out], kind="stable")
    entries, held_out = [entries[k] for k in order], [held_out[k] for k in order]
    evidence = {at: evidence_by_model[k] for at, k in enumerate(order) if k in evidence_by_model}
    answer = rank_by_evidence(entries, evidence)
    names = [entry.model.name for entry in entries]
    behind, behind_std = np.array([one.behind(held_out[0]) for one in held_out]).T
    verdicts = model_verdicts(entries, held_out, motion, evidence, answer)
    # Walks of recorded steps are no answer, however close they are.
    closest = next((k for k, entry in enumerate(entries) if not entry.baseline), 0)
    apart = [one.behind(held_out[closest]) for one in held_out]
    tied = [
        k
        for k, (difference, error) in enumerate(apart)
        if k > closest and difference < HELD_OUT_VERDICT.tied_sigmas * error
    ]
    units, values = _estimates(entries, held_out)
    stationarity = stationarity_of_motion(motion)
    ended = [
        f"{name}: {text}"
        for name, entry, one in zip(names, entries, held_out, strict=True)
        if (text := entry.at_range_end(one.point)) is not None
    ]
    series = series_warnings(motion.like.flow, duration=motion.duration)
    warned = [*warnings, *ended, *unsteady_motion(motion), *series]
    why = _findings(names, entries, verdicts, closest, tied)
    if evidence:
        why.insert(0 if answer.best is not None else 1, ranking_sentence(names, evidence, answer))
    first = closest if answer.best is None else answer.best
    best = answer_sentence(entries, verdicts, first)
    findings = [best, *(one for one in why if one != best)]
    about = recording_parts(motion)
    data: dict[str, Any] = {
        **about.data,
        "score": ("model", [one.score for one in held_out]),
        "score_std": ("model", [one.score_std for one in held_out]),
        "behind": ("model", behind),
        "behind_std": ("model", behind_std),
        "free_numbers": ("model", [entry.numbers for entry in entries]),
        "baseline": ("model", [entry.baseline for entry in entries]),
        "verdict": ("model", texts([one.word for one in verdicts])),
        "verdict_reason": ("model", texts(["; ".join(one.reasons) for one in verdicts])),
        "held_out_distance": (("model", "aspect"), [one.held for one in held_out]),
        "trained_distance": (("model", "aspect"), [one.trained for one in held_out]),
        "check_median": (("model", "check"), [np.median(one.checks, axis=0) for one in held_out]),
        "check_low": (("model", "check"), [one.checks.min(axis=0) for one in held_out]),
        "check_high": (("model", "check"), [one.checks.max(axis=0) for one in held_out]),
        "estimate": (("model", "parameter"), values),
        "parameter_unit": ("parameter", texts(list(units.values()))),
        "end_score": (("model", "end"), _padded([one.optimum_scores for one in held_out])),
        "evaluations": ("model", [one.evaluations for one in held_out]),
        **_summaries(len(entries), evidence, answer.best),
    }
    coords = {
        "model": ("model", texts(names)),
        **about.coords,
        "parameter": ("parameter", texts(list(units))),
        "finding": ("finding", texts(findings)),
        "warning": ("warning", texts(warned)),
    }
    attrs = dict(about.attrs)
    if stationarity is not None:
        attrs["halves_ks_distance"] = stationarity.distance
        attrs["halves_p_value"] = stationarity.p_value
    return build_dataset("model_comparison", data, coords, attrs)


def _summaries(models: int, evidence: Mapping[int, Evidence], best: int | None) -> dict[str, Any]:
    """Return what the summaries of the motion say; nothing where no model was asked."""
    if not evidence:
        return {}
    data: dict[str, Any] = {
        "asked": ("model", [k in evidence for k in range(models)]),
        "named": ("model", [k == best for k in range(models)]),
    }
    numbers = np.full((4, models), np.nan)
    for k, one in evidence.items():
        numbers[:, k] = *one.discrepancy, one.deviance
    stored = ("discrepancy", "discrepancy_median", "discrepancy_q95", "deviance")
    return data | {name: ("model", row) for name, row in zip(stored, numbers, strict=True)}


def _padded(rows: Sequence[Floats]) -> Floats:
    found = np.full((len(rows), max(1, *(row.size for row in rows))), np.nan)
    for place, row in zip(found, rows, strict=True):
        place[: row.size] = row
    return found


def _estimates(
    entries: Sequence[Candidate], held_out: Sequence[HeldOutScore]
) -> tuple[dict[str, str], Floats]:
    """Return all parameters with their units, and the models' values, (models, parameters)."""
    units: dict[str, str] = {}
    answers: list[dict[str, float]] = []
    for entry, one in zip(entries, held_out, strict=True):
        answer = {}
        for parameter, share in zip(entry.ranges, one.point, strict=True):
            # Two models may give one name to numbers of different units.
            known = units.get(parameter.name, parameter.unit)
            name = parameter.name if known == parameter.unit else parameter.key
            units[name] = parameter.unit
            answer[name] = float(parameter.value_at(share))
        answers.append(answer)
    values = np.array([[answer.get(name, np.nan) for name in units] for answer in answers])
    return units, values.reshape(len(entries), len(units))


def _findings(
    names: Sequence[str],
    entries: Sequence[Candidate],
    verdicts: Sequence[Verdict],
    closest: int,
    tied: Sequence[int],
) -> list[str]:
    """Return what the answer follows from, in sentences."""
    found = [f"{names[closest]} is the closest in distance"]
    alternatives = [names[k] for k in tied if not entries[k].baseline]
    if alternatives:
        found[0] += f"; no clear difference from {', '.join(alternatives)}"
    if all(one.word == DOES_NOT_EXPLAIN for one in verdicts):
        found.append(
            f"{names[closest]} does not explain it: {'; '.join(verdicts[closest].reasons)}"
        )
    baselines = [names[k] for k in tied if entries[k].baseline]
    nearer = [names[k] for k in range(closest)]
    if nearer:
        found.append(f"A walk of recorded steps is closer than all models: {', '.join(nearer)}")
    elif baselines:
        found.append(f"No clear difference from a walk of recorded steps: {', '.join(baselines)}")
    return found


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
    clearly_behind = behind > HELD_OUT_VERDICT.tied_sigmas * error
    passing = [
        entry.model.name
        for k, (entry, one) in enumerate(zip(entries, held_out, strict=True))
        if entry.baseline
        and k in evidence
        and evidence[k].discrepancy.usual
        and not held_out_differences(one, motion)
    ]
    found = []
    for k, (entry, one) in enumerate(zip(entries, held_out, strict=True)):
        asked = evidence.get(k)
        discrepancy, bouts = (None, ()) if asked is None else (asked.discrepancy, asked.bouts)
        against, unable = law_findings(entry, one, motion, discrepancy=discrepancy, bouts=bouts)
        # Those that the summaries speak for stand beside the first.
        named = k in (answer.best, *answer.alternatives)
        if asked is not None and not (named or asked.discrepancy.against or answer.best is None):
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
        _doubt_equals(found, entries, answer.best, answer.alternatives, as_good)
    return found


def _doubt_equals(
    found: list[Verdict],
    entries: Sequence[Candidate],
    best: int,
    alternatives: Sequence[int],
    as_good: Sequence[int],
) -> None:
    """Leave open which of several models explains a recording, where they are equally good."""
    if not found[best].explains:
        # One that passes by its further numbers and is no likelier may lack the same.
        why = (
            f"{entries[best].model.name} is simpler and as likely, and does not explain it: the "
            "law may be another one; record for longer"
        )
        for k in alternatives:
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
        f"its summaries of the motion were not matched, as {EVIDENCE.most_models} other models "
        "were closer: compare fewer models"
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
