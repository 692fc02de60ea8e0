"""A page on a likelihood fit: flow, drag, force and noise, the force law, and the check."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.parts import Section, count, is_simulated, quantity, value_of
from driftwalk.page.sections.check import check_sections
from driftwalk.page.sections.flow import flow_sections
from driftwalk.page.sections.recording import Noise, recording_sections
from driftwalk.schema.answers.facts import facts_of, sentences
from driftwalk.schema.answers.fit import model_estimates
from driftwalk.schema.answers.force_law import (
    FORWARD_SELECTION,
    LINEAR_DRAG_ALONE,
    compared_laws,
    law_estimates,
    law_limits,
    law_words,
    shared_lengths,
    wall_estimates,
)
from driftwalk.schema.answers.parts import NOT_DETERMINED, estimates
from driftwalk.schema.answers.verdict import stored_verdict

if TYPE_CHECKING:
    import xarray as xr

_ANSWER: Final = ("drag_coefficient", "force_std", "tracking_noise")

TESTED: Final = {
    "water_acceleration": "push of the water's acceleration",
    "water_spin": "torque of the water's acceleration",
    "linear_share": "linear part of the drag",
    "drag_power": "power of the drag",
    "force_memory": "memory of the force",
    "time_variance": "jitter of the stamps",
    "angle_offset": "orientation offset",
    "marker_x": "marker off by, x",
    "marker_y": "marker off by, y",
    "strength_trend": "strength of the flow, straight line",
    **{f"strength_{k}": f"strength of the flow, cosine {k}" for k in range(1, 7)},
}
"""Words for the numbers that score tests look at."""


def fit_sections(
    fit: xr.Dataset | None,
    *,
    recordings: Sequence[xr.Dataset] = (),
    check: xr.Dataset | None = None,
    body: str | None = None,
) -> list[Section]:
    """Return the sections of a page on a likelihood fit.

    Parameters
    ----------
    fit : xarray.Dataset, optional
        A `fit`; None while there is none yet.
    recordings : sequence of xarray.Dataset
        The `trajectory` datasets that were fitted.
    check : xarray.Dataset, optional
        Its `model_check`.
    body : str, optional
        The body that was used, where the recordings have several.

    Returns
    -------
    list of dict
        Sections; what cannot be shown is an empty one that says why.

    Examples
    --------
    >>> [part["kind"] for part in fit_sections(None)]
    ['empty']
    """
    made = parts.sections_of(
        fit,
        "There is no fit yet.",
        lambda found: fit_summary(found, check),
        lambda found: sentences(found, "warning"),
        [("law", "The force law", law_sections)],
    )
    noise = None if fit is None else _noise(fit)
    for number_of, recording in enumerate(recordings, start=1):
        pieces = recording_sections(recording, body=body, noise=noise)
        if len(recordings) > 1:
            for part in pieces:
                part["id"] = f"{part['id']}-of-{number_of}"
                part["title"] += f" ({number_of} of {len(recordings)})"
        made += pieces
    if fit is not None:
        made += flow_sections(fit)
        why = fit.attrs.get("check_left_out")
        if check is None and (why or "verdict" not in fit):
            reason = f"{why}." if why else "The model was not checked against the recording."
            made.append(
                parts.empty_section("check", "Does the model explain the recording?", reason)
            )
    if check is not None:
        made += check_sections(check)
    return made


def fit_summary(fit: xr.Dataset, check: xr.Dataset | None = None) -> Section:
    """Return the answer of a fit in words and numbers."""
    paragraphs = [parts.SIMULATED] if is_simulated(fit) else []
    paragraphs += [_what_was_done(fit), *_verdict(fit, check), _how_far_they_hold(fit)]
    error = value_of(fit, "chi_squared_per_dof")
    # The answer first, then what only some readers need.
    place = {name: at for at, name in enumerate(_ANSWER)}
    found = sorted(model_estimates(fit), key=lambda one: place.get(one.number.name, len(_ANSWER)))
    shown = parts.figure("mean squared error of prediction", error, note="1 if the model is right")
    return parts.summary_section(paragraphs, [*map(parts.card, found), shown])


def _what_was_done(fit: xr.Dataset) -> str:
    facts = fit.attrs
    source = facts.get("source", "the recording")
    words = f"driftwalk fitted flow, drag, stochastic force and tracking noise together to {source}"
    samples, used = (value_of(fit, name) for name in ("samples", "samples_used"))
    pieces = []
    recordings = value_of(fit, "recordings")
    if recordings is not None and recordings > 1:
        pieces.append(count(int(recordings), "recording"))
    duration = value_of(fit, "duration_s")
    if duration is not None:
        pieces.append(quantity(duration, "s"))
    if samples is not None and used is not None:
        pieces.append(f"{int(used)} of {int(samples)} samples used")
    left_out, put_in = (value_of(fit, name) for name in ("outliers", "dropped_frames"))
    if left_out:
        pieces.append(f"{int(left_out)} left out as outliers of the track")
    if put_in:
        pieces.append(f"the time of {count(int(put_in), 'dropped frame')} put in")
    wall = value_of(fit, "wall_share")
    if wall is not None:
        pieces.append(f"{percent(wall)} of the intervals at the wall, left out")
    words += f" ({'; '.join(pieces)})" if pieces else ""
    visited = value_of(fit, "visited_share")
    seen = "" if visited is None else f" The block has been over {percent(visited)} of the tank."
    return f"{words}.{seen}"


def _how_far_they_hold(fit: xr.Dataset) -> str:
    """Return under which conditions the numbers hold, and which of them there is none of."""
    found = {one.number.name: one for one in estimates(fit)}
    lacking = [name for name in _ANSWER if name not in found]
    if lacking:
        raise InputError(f"the fit has no {', '.join(lacking)}")
    linear = fit.attrs.get("drag_law") == "linear"
    said = [f"The drag coefficient: {LINEAR_DRAG_ALONE}."] if linear else []
    said += [
        f"The {one.number.words.removesuffix(one.number.symbol).rstrip()} is {NOT_DETERMINED}."
        for name in _ANSWER
        if (one := found[name]).unknown and not (linear and name == "drag_coefficient")
    ]
    facts = facts_of(fit)
    reach = facts.get("drag_coefficient_any_added_mass_interval")
    words = "The intervals hold if the force law is right"
    if reach is not None and not linear and isfinite(reach[1]):
        words += (
            ", and for a block without added mass: with the usual one C_d is between "
            f"{reach[0]:.3g} and {reach[1]:.3g}"
        )
    return " ".join([*said, f"{words}."])


def _verdict(fit: xr.Dataset, check: xr.Dataset | None) -> list[str]:
    """Return the verdict and its reasons, and the KS distance of a check."""
    said = parts.verdict_paragraphs(
        stored_verdict(fit if check is None else check),
        str(fit.attrs.get("check_left_out", "")),
        more="The check found no evidence against the model. It finds many faults, but not all.",
    )
    if check is None:
        return said
    distance, floor = (value_of(check, name) for name in ("ks_distance", "ks_noise_floor"))
    if distance is None or floor is None:
        return [*said, f"There is no KS distance: {check.attrs.get('ks_left_out', 'left out')}."]
    p_value = value_of(check, "ks_p_value")
    chance = "" if p_value is None else f"; the p-value of that distance is {p_value:.2g}"
    return [
        *said,
        f"Recordings simulated with these parameters have a KS distance of {distance:.3g} to the "
        f"real one, and of {floor:.3g} among themselves (noise floor){chance}.",
    ]


def _noise(fit: xr.Dataset) -> Noise | None:
    for one in estimates(fit):
        if one.number.name == "tracking_noise" and not one.unknown:
            low, high = one.ends or (None, None)
            return Noise(one.value, low, high, "estimated by the fit")
    return None


def law_sections(fit: xr.Dataset) -> list[Section]:
    """Return the sections on the force law, its alternatives, and the wall."""
    facts = facts_of(fit)
    made = []
    rows = law_words(facts)
    if rows:
        said = [f"{label[:1].upper()}{label[1:]}: {words}." for label, words in rows.items()]
        shown = [parts.card(one) for one in law_estimates(fit)]
        if "law_settled_by" in facts:
            note = "difference of the logarithms of the evidence; below 3 the recording cannot tell"
            apart = facts["law_settled_by"]
            shown.insert(0, parts.figure("evidence for this law over the other", apart, note=note))
        said += law_limits(facts)
        made.append(parts.summary_section(said, shown, id="law", title="The force law"))
    made += [part for part in (_shared(fit), _compared(fit), _tested(fit)) if part is not None]
    lacking, walls = fit.attrs.get("wall_left_out"), wall_estimates(fit)
    if lacking is not None or walls:
        words = f"The wall: {lacking}."
        if lacking is None:
            words = f"The block touched the wall in {facts['wall_contacts']} passages."
        cards = [*map(parts.card, walls)]
        made.append(parts.summary_section([words], cards, id="wall", title="The wall"))
    return made


def _shared(fit: xr.Dataset) -> Section | None:
    """Return the correlation of the forces on free bodies in one recording."""
    if "force_correlation" not in fit:
        return None
    distance = fit["body_distance"].values
    r = np.linspace(0.0, 1.05 * distance.max(), 100)
    low, fitted, high = (
        np.exp(-0.5 * (r / max(length, 1e-9)) ** 2) for length in shared_lengths(fit)
    )
    low_end, high_end = fit["force_correlation_interval"].values.T
    return parts.chart(
        "Correlation of the stochastic forces on two bodies against their distance: measured, and "
        "the fitted exp(-r²/2L²) with the band of its interval.",
        x=parts.label("distance of the bodies", "m"),
        y=parts.label("correlation of the forces"),
        series=[
            parts.series("fitted", r, fitted, ends=(low, high)),
            parts.series(
                "at each distance", distance, fit["force_correlation"].values,
                ends=(low_end, high_end), style="points",
            ),
        ],
        id="stirring",
        title="Shared stirring",
    )  # fmt: skip


def _compared(fit: xr.Dataset) -> Section | None:
    """Return the table of compared laws, where they were compared."""
    laws = compared_laws(fit)
    if not laws:
        return None
    rows: list[list[Any]] = [
        [law.name, *([law.loss, law.std, law.evidence] if law.solved else [None, None, None])]
        for law in laws
    ]
    columns = ["force law", "loss per held out sample", "its standard error", "evidence"]
    note = (
        "Each law was fitted to the first 70 % of the recording and predicted the rest. Loss and "
        "evidence are logarithms, against the best law. A dash: the law has no solution."
    )
    return parts.table_section(columns, rows, note, id="laws", title="Force laws compared")


def _tested(fit: xr.Dataset) -> Section | None:
    """Return the table of what was tested and stayed closed."""
    if "departure" not in fit.coords or fit.sizes["departure"] == 0:
        return None
    names = [str(name) for name in fit["departure"].values]
    std = fit["departure_std"].values
    sigmas = np.divide(
        fit["departure_estimate"].values, std, out=np.full(std.shape, np.nan), where=std > 0.0
    )
    rows: list[list[Any]] = [
        [TESTED.get(name, name), round(value, 2) if isfinite(value) else None, _why(name, value)]
        for name, value in zip(names, sigmas.tolist(), strict=True)
    ]
    note = (
        "The last score tests of the search: estimates of numbers that are not in the fit, in "
        "their standard deviations; 0 is the model. A number is fitted from "
        f"{FORWARD_SELECTION.opened_sigmas:g} on (the memory of the force from "
        f"{FORWARD_SELECTION.memory_sigmas:g} on) if it is large enough to matter, and stays if "
        "the fit finds it too. Small errors of the fitted flow can look like a weaker one: the "
        "check of the model says whether anything is missing from it."
    )
    columns = ["what was tested", "standard deviations from the model", "why it is not in the fit"]
    title = "Tested, and not in the fit"
    return parts.table_section(columns, rows, note, id="tested", title=title)


def _why(name: str, sigmas: float) -> str:
    """Return why a number that was tested is not in the fit."""
    policy = FORWARD_SELECTION
    least = policy.memory_sigmas if name == "force_memory" else policy.opened_sigmas
    if not isfinite(sigmas):
        return "it has no estimate"
    # Chance exceeds two standard deviations in one test of twenty.
    if abs(sigmas) <= 2.0:
        return "as near as chance brings it"
    if name.startswith("water_"):
        return "the two force laws were compared as a whole"
    if name.startswith("strength_"):
        return "line and cosines are tested together, and fitted together or not at all"
    if abs(sigmas) <= least:
        return f"too weak: fitted from {least:g} on"
    return "too small to matter, of the wrong sign, or not found by the fit"
