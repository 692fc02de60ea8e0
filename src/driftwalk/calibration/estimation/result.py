"""The `model_calibration` dataset: the estimate, how well it is known, how good the model is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.estimation.estimate import Matched
from driftwalk.calibration.estimation.identifiability import Determination
from driftwalk.calibration.held_out.bouts import BoutDistance
from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import HeldOutScore, recording_parts
from driftwalk.calibration.held_out.law_findings import law_findings
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.core.arrays import Floats
from driftwalk.motion import ParticleModel
from driftwalk.schema import Parameter
from driftwalk.schema.answers.facts import BOUNDS, AnswerParts, texts
from driftwalk.schema.answers.verdict import verdict_of, verdict_variables
from driftwalk.schema.check import build_dataset
from driftwalk.simulation.series import series_warnings

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Estimation:
    """Everything that was found of a model's parameters.

    Attributes
    ----------
    point : ndarray, shape (parameters,)
        The estimate, in the unit cube.
    searched : ndarray or None
        The answer of the first stage; None where it was not needed.
    matched : Matched or None
        That of the second stage; None where it was not asked for.
    scores : mapping of str to float
        Mean of distance over floor in the even blocks of time, of each answer.
    known : Determination or None
        How well the parameters are determined; None where the second stage does not count.
    held_out : HeldOutScore
        The answer for the even blocks, judged on the odd ones.
    bouts : sequence of BoutDistance
        How long bouts last at the estimate, against the recording's.
    """

    point: Floats
    searched: Floats | None
    matched: Matched | None
    scores: Mapping[str, float]
    known: Determination | None
    held_out: HeldOutScore
    bouts: Sequence[BoutDistance]


def build_model_calibration(
    found: Estimation,
    entry: Candidate,
    motion: RecordedMotion,
    warnings: Sequence[str],
) -> xr.Dataset:
    """Return the dataset of a calibration of many parameters."""
    ranges, held_out = entry.ranges, found.held_out
    misfit = None if found.matched is None else found.matched.misfit
    against, unable = law_findings(entry, held_out, motion, misfit=misfit, bouts=found.bouts)
    if (ended := entry.at_range_end(found.point)) is not None:
        unable.append(ended)
    verdict = verdict_of(against, unable)
    count = len(ranges)
    # None where the summaries' answer does not count: nothing is known of the intervals then.
    known = found.known
    about, named = recording_parts(motion), parameter_parts(ranges)
    data: dict[str, Any] = {
        **about.data,
        **named.data,
        "estimate": ("parameter", _values(entry, found.point[None])[0]),
        "interval": (
            ("parameter", "bound"),
            np.full((count, 2), np.nan) if known is None else known.interval,
        ),
        "determined": (
            "parameter", np.zeros(count, dtype=bool) if known is None else known.determined,
        ),
        "half_width": ("parameter", np.full(count, np.nan) if known is None else known.half_width),
        "range": (("parameter", "bound"), np.array([(one.low, one.high) for one in ranges])),
        "held_out_distance": ("aspect", held_out.held),
        "trained_distance": ("aspect", held_out.trained),
        "check_median": ("check", np.median(held_out.checks, axis=0)),
        "check_low": ("check", held_out.checks.min(axis=0)),
        "check_high": ("check", held_out.checks.max(axis=0)),
        "score": ((), held_out.score),
        "score_std": ((), held_out.score_std),
        **verdict_variables(verdict),
        **_stages(found, entry),
    }  # fmt: skip
    series = series_warnings(motion.like.flow, duration=motion.duration)
    said = [*warnings, *_said(found, entry), *series]
    coords: dict[str, Any] = {
        **named.coords,
        **about.coords,
        "warning": ("warning", texts(said)),
    }
    attrs: dict[str, Any] = {
        "model": entry.model.name,
        "estimate_from": "search" if known is None else "summaries",
        "fixed": json.dumps(_fixed(entry)),
        "confidence": motion.study.calibration.confidence,
        "position_noise_m": motion.like.camera.position_noise,
        **about.attrs,
    }
    return build_dataset("model_calibration", data, coords, attrs)


def parameter_parts(parameters: Sequence[Parameter]) -> AnswerParts:
    """Return what a dataset of estimates says of their parameters."""
    data = {
        "unit": ("parameter", texts([one.unit for one in parameters])),
        "scale": ("parameter", texts([one.scale for one in parameters])),
        "meaning": ("parameter", texts([one.meaning or one.label for one in parameters])),
    }
    names = texts([one.name for one in parameters])
    coords = {"parameter": ("parameter", names), "bound": ("bound", texts(BOUNDS))}
    return AnswerParts(data, coords, {})


def _stages(found: Estimation, entry: Candidate) -> dict[str, Any]:
    """Return what the two stages left, where they were made."""
    data: dict[str, Any] = {}
    if found.searched is not None:
        data["searched_estimate"] = ("parameter", _values(entry, found.searched[None])[0])
        data["searched_score"] = ((), found.scores["searched"])
    matched = found.matched
    if matched is not None:
        data |= {
            "draws": (("draw", "parameter"), _values(entry, matched.sample)),
            "matched_score": ((), found.scores["matched"]),
            "misfit": ((), matched.discrepancy),
            "usual_misfit": ((), matched.median_discrepancy),
            "most_misfit": ((), matched.upper_discrepancy),
            "interval_stretch": ((), matched.stretch),
        }
        if matched.profiles is not None:
            values = _values(entry, matched.profiles.place.T).T
            data["profile_value"] = (("parameter", "profile_point"), values)
            data["profile_misfit"] = (("parameter", "profile_point"), matched.profiles.rise)
    return data


def _values(entry: Candidate, points: Floats) -> Floats:
    """Return the values at points of the unit cube, shape (points, parameters)."""
    columns = [one.value_at(share) for one, share in zip(entry.ranges, points.T, strict=True)]
    return np.stack(columns, axis=1)


def _fixed(entry: Candidate) -> dict[str, float]:
    model = entry.model
    if not isinstance(model, ParticleModel):
        return {}
    return {**model.fixed, "clearance": model.clearance}


def _said(found: Estimation, entry: Candidate) -> list[str]:
    """Return the warnings of the estimate."""
    said: list[str] = []
    matched = found.matched
    if matched is None:
        return said
    if found.known is None:
        said.append(
            "the summaries of the motion pull the model away from it: in the six distances their "
            f"answer comes to {found.scores['matched']:.2f} noise floors, that of the search to "
            f"{found.scores['searched']:.2f}; the values are the search's, and none is determined"
        )
        return said
    if not matched.misfit.usual:
        said.append(
            f"the intervals are {matched.stretch:.1f} times as wide as the draws, for what the "
            f"model leaves of the summaries{'; nothing is determined' if matched.unlike else ''}"
        )
    names = np.array([one.name for one in entry.ranges])
    if matched.ambiguous.any():
        said.append(
            "other values fit the summaries of the motion as well: "
            f"{', '.join(names[matched.ambiguous])} not determined"
        )
    if matched.unsettled.any():
        said.append(
            "the draws had not come to rest when the simulations ended: "
            f"{', '.join(names[matched.unsettled])} not determined"
        )
    return said
