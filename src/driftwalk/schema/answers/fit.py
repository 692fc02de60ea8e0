"""The answer of a fit: its estimates, the force law, the wall, and the check of the model.

A `model_check` holds everything that was checked; the fit keeps the verdict, the p values and the
map of residuals, so that one dataset answers whether its numbers may be used.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import InputError
from driftwalk.core.units import in_percent
from driftwalk.schema.answers.facts import (
    GOODNESS,
    facts_of,
    flat_variables,
    is_open,
    sentences,
    texts,
)
from driftwalk.schema.answers.force_law import (
    LINEAR_DRAG_ALONE,
    compared_laws,
    flow_in_time,
    law_estimates,
    law_words,
    wall_estimates,
)
from driftwalk.schema.answers.parts import (
    PREDICT,
    Answer,
    Estimate,
    Following,
    Part,
    Row,
    Table,
    by_name,
    estimates,
    intensity_row,
    origin,
    undetermined,
)
from driftwalk.schema.answers.verdict import stored_verdict, verdict_facts, verdict_parts
from driftwalk.schema.check import described, require_kind
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.kinds.fit import FIT, LAW_NUMBERS, PARAMETERS
from driftwalk.schema.kinds.model_check import MODEL_CHECK

if TYPE_CHECKING:
    import xarray as xr

TELLING_SHARE: Final = 0.02
"""Share of the intervals at the wall from which there may be enough contacts to estimate it; chosen
by hand."""
_ATTRIBUTES: Final = (
    *("angle", "force_law", "force_law_stated", "drag_law", "drag_law_stated", "wall_left_out"),
    *("measured_flow", "measured_flow_errors"),
)
_NOT_IN_JSON: Final = frozenset(
    {
        *("force_lever_m", "force_lever_m_interval", "residual_cell_size_m"),
        *("orientation_noise_rad", "orientation_noise_rad_interval"),
        *("drag_coefficient_angle_given", "drag_coefficient_angle_given_interval"),
        *("spin_correlation", "angle_disagreement_std", "filter_drag_coefficient"),
        *("intervals_usable", "restricted", "roughness_weight", "size_weight"),
        *("spline_origin_m", "spline_spacing_m", "cell_size_m", "recording_start_s"),
        "measured_flow_determined",
    }
)
"""Facts for programs that read fit.nc: of the second fit, of the flow's splines, of the search."""


def after_fit(fit: xr.Dataset) -> Following:
    """Return what comes after a fit: nothing can be simulated with what is not known."""
    return Following() if undetermined(fit) else PREDICT


def fit_answer(fit: xr.Dataset, *, check: xr.Dataset | None = None) -> Answer:
    """Return the answer of a fit; what its `model_check` says, where it is given."""
    parts = [*fitted_parts(fit), *checked_parts(fit, check)]
    return Answer(parts, fit_json(fit, check), sentences(fit, "warning"))


def fitted_parts(fit: xr.Dataset, *, hint: str = "") -> list[Part]:
    """Return the estimates and the force law: what is known before the model is checked.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.
    hint : str
        How to have the wall estimated: said where there are enough contacts, and it was not asked
        for.
    """
    facts, parts = facts_of(fit), origin(fit)
    if facts.get("drag_law") == "linear":
        parts.append(Row(PARAMETERS["drag_coefficient"].words, LINEAR_DRAG_ALONE))
    found = model_estimates(fit)
    parts += [one for one in found if one.number.name != "force_noise_intensity"]
    parts += [
        intensity_row(one.value)
        for one in found
        if one.number.name == "force_noise_intensity" and not one.open
    ]
    parts += [Row(label, words) for label, words in law_words(facts).items()]
    parts += law_estimates(fit)
    if "measured_flow_p_value" in facts:
        said = (
            f"{facts['measured_flow']}, chi squared of its difference from the fitted one "
            f"{facts['measured_flow_chi_squared']:.0f}, expected "
            f"{facts['measured_flow_expected']:.0f} ± {facts['measured_flow_expected_std']:.0f} "
            f"(p = {facts['measured_flow_p_value']:.2g})"
        )
        parts.append(Row("measured flow", said))
    if "wall_share" in facts:
        asked = "wall_contacts" in facts or "wall_left_out" in facts
        tells = facts.get("angle") == "state" and facts["wall_share"] > TELLING_SHARE
        left_out = in_percent(facts["wall_share"], decimals=1)
        said = f"{left_out}, left out{hint if tells and not asked else ''}"
        parts.append(Row("intervals at the wall", said))
    if "flow" in fit.dims and "switching_times_s" in facts:
        names = ", ".join(map(str, fit["flow"].values[fit["interval_flow"].values]))
        times = ", ".join(f"{time:g} s" for time in facts["switching_times_s"])
        parts.append(Row("flows", f"{names}, switched at {times}"))
    in_time = flow_in_time(fit)
    return parts if in_time is None else [*parts, Row("flow over time", in_time)]


def model_estimates(fit: xr.Dataset) -> list[Estimate]:
    """Return the estimates of the block and the tracking noise; no C_d where the drag is linear.

    Where flows were named each has its own σ_F.
    """
    of_flows = "flow_force_std" in fit
    left_out = ["drag_coefficient"] if fit.attrs.get("drag_law") == "linear" else []
    left_out += ["force_noise_intensity"] if of_flows else []
    made: list[Estimate] = []
    for one in estimates(fit):
        if one.number not in LAW_NUMBERS and one.number.name not in left_out:
            made += _of_flows(fit, one) if of_flows and one.number.name == "force_std" else [one]
    return made


def _of_flows(fit: xr.Dataset, first: Estimate) -> list[Estimate]:
    """Return σ_F in each flow."""
    columns = (fit[f"flow_force_std{end}"].values for end in ("", "_low", "_high"))
    return [
        first._replace(
            number=replace(first.number, label=f"force in flow {label}"),
            value=float(value),
            ends=(float(low), float(high)),
        )
        for label, value, low, high in zip(fit["flow"].values, *columns, strict=True)
    ]


def checked_parts(fit: xr.Dataset, check: xr.Dataset | None) -> list[Part]:
    """Return what was found after the estimates: compared laws, the wall, the check."""
    parts: list[Part] = []
    if laws := compared_laws(fit):
        rows = [
            [law.name, f"{law.loss:.4f} ± {law.std:.4f}", f"{abs(law.evidence):.1f}"]
            if law.solved
            else [law.name, "no solution"]
            for law in laws
        ]
        columns = ["force law", "held out prediction per sample", "evidence"]
        parts.append(Table(rows, columns, "force laws, below the best"))
    if "wall_left_out" in fit.attrs:
        parts.append(Row("wall", str(fit.attrs["wall_left_out"])))
    return [*parts, *wall_estimates(fit), *_verdict(fit, check)]


def _verdict(fit: xr.Dataset, check: xr.Dataset | None) -> list[Part]:
    """Return whether the model explains the recording, and what speaks against it."""
    verdict = stored_verdict(fit if check is None else check)
    if verdict is None and not estimates(fit):
        # A part of a fit.
        return []
    parts = verdict_parts(verdict, str(fit.attrs.get("check_left_out", "")))
    if check is None:
        return parts
    distance, floor = (float(check.attrs[name]) for name in ("ks_distance", "ks_noise_floor"))
    if not isfinite(distance):
        return [*parts, Row("KS distance", f"not available: {check.attrs['ks_left_out']}")]
    explains = verdict is not None and verdict.explains
    far = explains and distance > GOODNESS.far_above_floor * floor
    more = ": far, but within the uncertainty of the fit" if far else ""
    parts.append(Row("KS distance", f"{distance:.3f}, noise floor {floor:.3f}{more}"))
    chance = float(check.attrs.get("ks_p_value", "nan"))
    parts += [Row("  p-value", f"{chance:.2g}")] if isfinite(chance) else []
    columns = (check[one].values for one in ("p_value", "detectable", "detectable_of"))
    rows = [
        [name, *(f"{one:.2g}" if isfinite(one) else "–" for one in (p, size)), str(of)]
        for name, p, size, of in zip(marked_criteria(check), *columns, strict=True)
    ]
    heads = ["criterion", "p value", "misfit found in 9 of 10", "of what"]
    return [*parts, Table(rows, heads, "criteria of the check")]


def marked_criteria(check: xr.Dataset) -> list[str]:
    """Return the names of the criteria of a check with ": failed", or ": small" where excused."""
    level = check.attrs.get("level", 0.0)
    columns = (check[one].values for one in ("criterion", "p_value", "failed"))
    return [
        f"{name}{': failed' if failed else ': small' if p < level else ''}"
        for name, p, failed in zip(*columns, strict=True)
    ]


def fit_json(fit: xr.Dataset, check: xr.Dataset | None = None) -> dict[str, Any]:
    """Return the JSON of a fit; None for what the recording does not determine."""
    facts = facts_of(fit)
    for one in PARAMETERS.values():
        if is_open(facts, one.key):
            facts[one.key] = None
    if "drag_coefficient" in facts and facts["drag_coefficient"] is None:
        facts |= {"maximum_likelihood_drag_coefficient": None, "filter_drag_coefficient": None}
    numbers = [one.key for one in PARAMETERS.values()]
    names = [*numbers, *(f"{key}_interval" for key in numbers), *flat_variables(FIT), *_ATTRIBUTES]
    shown = {key: facts[key] for key in names if key in facts and key not in _NOT_IN_JSON}
    if "compared_law" in fit.dims:
        shown["compared_laws"] = by_name(fit, "compared_law", _law)
    shown |= {"recording": facts.get("source"), "warnings": facts["warnings"]}
    shown |= verdict_facts(stored_verdict(fit if check is None else check))
    if check is None:
        left_out = fit.attrs.get("check_left_out")
        return shown if left_out is None else {**shown, "check_left_out": left_out}
    measured = ("ks_distance", "ks_noise_floor", "ks_p_value")
    return {
        **shown,
        **{key: check.attrs.get(key) for key in measured},
        "detectable": by_name(check, "criterion", "detectable"),
    }


def _law(one: xr.Dataset) -> dict[str, float]:
    """Return how well a compared law does; NaN where it has no solution."""
    names = ("log_evidence", "log_score", "log_score_std")
    return {name: float(one[f"compared_{name}"]) for name in names}


PLACES: Final = {"component": "residual_component", "y": "cell_y", "x": "cell_x"}
"""Dimension in a check to that in a fit, which has other nodes of its own."""
BY_CELL: Final = (
    *("residual", "residual_count", "residual_distance", "noise_ratio", "noise_ratio_std"),
)


def with_verdict(fit: xr.Dataset, check: xr.Dataset) -> xr.Dataset:
    """Return a fit that holds what its check found.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.
    check : xarray.Dataset
        Its `model_check`.

    Returns
    -------
    xarray.Dataset
        The `fit`, with ``verdict``, ``verdict_reason`` (sentences), ``p_value`` by criterion and
        the residuals by cell. A warning that is a reason of the verdict is left out, and a misfit
        that is sure but too small to change the verdict is a warning.
    """
    kept = check[["verdict", "verdict_reason", "p_value", *BY_CELL]].rename(PLACES)
    rest = [
        text for text in sentences(fit, "warning") if text not in sentences(check, "verdict_reason")
    ]
    rest += [text for text in sentences(check, "note") if text not in rest]
    fit = fit.drop_vars("warning").assign_coords(warning=("warning", texts(rest)))
    found = fit.merge(kept, combine_attrs="override", compat="override", join="outer")
    found["residual_cell_size"] = ((), check.attrs["cell_size_m"])
    return described(found)


def residuals_of(dataset: xr.Dataset) -> xr.Dataset:
    """Return the residuals by cell of a model check, or of a fit that was checked.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `model_check` or a `fit`.

    Returns
    -------
    xarray.Dataset
        ``residual`` on (component, y, x), ``residual_count``, ``residual_distance``,
        ``noise_ratio`` and ``noise_ratio_std`` on (y, x); the size of a cell is the attribute
        ``cell_size_m``.

    Raises
    ------
    InputError
        When the dataset is neither, or the fit was not checked.
    """
    require_kind(dataset, "fit model_check", "check_model makes a model check")
    if find_kind(dataset) is MODEL_CHECK:
        return dataset
    if "residual" not in dataset:
        why = dataset.attrs.get("check_left_out", "check_model makes a model check")
        raise InputError(f"the fit was not checked, so it has no residuals: {why}")
    found = dataset[list(BY_CELL)]
    found = found.drop_vars([name for name in found.coords if name not in PLACES.values()])
    size = float(dataset["residual_cell_size"])
    return found.rename({new: old for old, new in PLACES.items()}).assign_attrs(cell_size_m=size)
