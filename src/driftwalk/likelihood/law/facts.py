"""The force law and the departures from the model in a fit: facts and variables."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.likelihood.filter.departures import DRAG_SHAPES, STRENGTHS
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.assumptions import USUAL_ADDED_MASS, added_mass_of, is_stated
from driftwalk.likelihood.solution import BREAKDOWN
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.likelihood.law.assumptions import Assumptions
    from driftwalk.likelihood.law.forward_selection import LawResult
    from driftwalk.likelihood.reml import Restricted
    from driftwalk.likelihood.spline import Floats
    from driftwalk.model import Study

PLAIN: Final = {
    "drag_power": "drag_power",
    "force_memory": "force_memory_s",
    "angle_offset": "orientation_offset_rad",
    "marker_x": "marker_x_m",
    "marker_y": "marker_y_m",
    "pulse_frequency": "pulse_frequency_Hz",
}
"""Numbers that are stated as they are."""


class Inertia(NamedTuple):
    """The inertia of the block with its added mass."""

    added: float
    """Added mass as a share of the block's mass."""
    added_std: float
    stated: bool
    """Whether the user has stated it."""
    log_std: float
    """Standard deviation of the logarithm of mass and added mass together."""

    @property
    def share(self) -> float:
        """Return mass and added mass over the mass."""
        return 1.0 + self.added


def inertia_of(study: Study, *, floating: bool) -> Inertia:
    """Return the inertia with its uncertainty, from what a study states."""
    added, std = added_mass_of(study, floating=floating)
    mass = study.fit.mass_std_kg / study.block.mass_kg
    stated = (
        study.fit.added_mass_share != "auto"
        or study.fit.law == "paper"
        or is_stated(study, "added_mass_share")
    )
    return Inertia(added, std, stated, math.hypot(std / (1.0 + added), mass))


def stated_drag(point: Point, study: Study) -> float:
    """Return C_d of the quadratic part of the drag, with the added mass."""
    inertia = inertia_of(study, floating=point.number("water_acceleration") != 0.0)
    return inertia.share * (1.0 - point.number("linear_share")) * math.exp(point.log_drag)


def inertia_facts(inertia: Inertia, facts: dict[str, Any], normal: float) -> dict[str, Any]:
    """Return the added mass, or how far C_d and the force reach where nothing is known of it."""
    if inertia.added or inertia.added_std or inertia.stated:
        low, high = (inertia.added + sign * normal * inertia.added_std for sign in (-1, 1))
        return {
            "added_mass_share": inertia.added,
            "added_mass_share_interval": [max(low, 0.0), high],
        }
    usual, std = USUAL_ADDED_MASS
    most = 1.0 + usual + normal * std
    return {
        f"{name}_any_added_mass_interval{unit}": [low, high * most]
        for name, unit in (("drag_coefficient", ""), ("force_std", "_N"))
        for low, high in [facts[f"{name}{unit}_interval"]]
    }


def number_facts(point: Point, reach: Floats, study: Study) -> dict[str, Any]:
    """Return the opened numbers with their intervals, and the stated ones, units in the keys."""
    first = 1 + len(point.noises)
    widths = dict(zip(point.opened, reach[first:].tolist(), strict=True))
    facts: dict[str, Any] = {}

    def state(key: str, value: float, width: float, scale: float = 1.0) -> None:
        facts[key] = scale * value
        facts[f"{key}_interval"] = [scale * (value - width), scale * (value + width)]

    for name, key in PLAIN.items():
        if name in widths or name in point.fixed:
            state(key, point.number(name), widths.get(name, 0.0))
    if "time_variance" in widths:
        value, width = point.opened["time_variance"], widths["time_variance"]
        ends = [math.sqrt(max(one, 0.0)) for one in (value - width, value + width)]
        facts["time_stamp_noise_s"] = math.sqrt(value)
        facts["time_stamp_noise_s_interval"] = ends
    share = point.number("linear_share")
    if share:
        # It goes with C_d of the filter, too.
        width = math.hypot(widths.get("linear_share", 0.0), share * float(reach[0]))
        state("linear_drag_kg_s", share, width, _linear_drag(point, study))
    if "strength_1" in widths:
        # From the beginning of the recording to its end the odd cosines change their signs.
        odd = STRENGTHS[::2]
        change = -2.0 * sum(point.opened[name] for name in odd)
        state("flow_strength_change", change, 2.0 * math.hypot(*(widths[name] for name in odd)))
    if "pulse_sine" in widths:
        size = math.hypot(point.opened["pulse_cosine"], point.opened["pulse_sine"])
        state("pulse_amplitude", size, max(widths["pulse_cosine"], widths["pulse_sine"]))
    return facts


def _linear_drag(point: Point, study: Study) -> float:
    """Return the linear drag of the whole block [kg/s] for a linear share of 1."""
    block, floating = study.block, point.number("water_acceleration") != 0.0
    area = block.side_m * study.wetted_depth_m
    # K b of all strips: four faces, b a quarter of the speed.
    speed = block.side_m
    drag = 0.5 * study.water.density_kg_m3 * math.exp(point.log_drag) * area * speed
    return drag * inertia_of(study, floating=floating).share


def law_facts(law: LawResult, assumptions: Assumptions) -> dict[str, Any]:
    """Return the law, whether it was stated, and by how much the recording supports it."""
    searched = bool(set(DRAG_SHAPES) & set(assumptions.tried))
    facts: dict[str, Any] = {
        "force_law": "floating body" if law.floating else "paper",
        "force_law_stated": "no" if assumptions.pressure_gradient == "auto" else "yes",
        "drag_law": _drag_law(law.mode.point),
        "drag_law_stated": "no" if searched else "yes",
    }
    if math.isfinite(law.settled_by):
        facts["law_settled_by"] = law.settled_by
    return facts


def _drag_law(point: Point) -> str:
    """Return how the drag goes with the speed, in one word."""
    if "drag_power" in point.opened or "drag_power" in point.fixed:
        return "power"
    if "linear_share" in point.opened:
        return "mixed"
    return "linear" if point.number("linear_share") == 1.0 else "quadratic"


def number_variables(point: Point, law: LawResult) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return variables and coordinates with the numbers of the law, and what was tested."""
    values = {**point.fixed, **point.opened}
    data: dict[str, Any] = {
        "number_value": ("number", np.array(list(values.values()), dtype=np.float64)),
        "number_opened": ("number", np.array([name in point.opened for name in values], bool)),
        "filter_drag_coefficient": ((), np.float64(math.exp(point.log_drag))),
        "law_log_evidence": ("law", np.array(list(law.evidence.values()), dtype=np.float64)),
    }
    coords: dict[str, Any] = {
        "number": ("number", np.array(list(values), dtype=np.str_)),
        "law": ("law", np.array(list(law.evidence), dtype=np.str_)),
    }
    if law.tests is not None:
        data["departure_estimate"] = ("departure", law.tests.estimate)
        data["departure_std"] = ("departure", law.tests.std)
        coords["departure"] = ("departure", np.array(law.tests.names, dtype=np.str_))
    return data, coords


def effective_logs(fit: xr.Dataset, study: Study) -> tuple[float, float]:
    """Return ln C_d and ln q as the filter takes them, without added mass, from a stored fit."""
    known = {str(name) for name in fit["parameter"].values}
    prefix = "effective_" if "effective_force_std" in known else ""
    force = fitted_value(fit, f"{prefix}force_std")
    intensity = force**2 * float(fit["force_interval"]) / study.block.mass_kg**2
    drag = (
        float(fit["filter_drag_coefficient"])
        if "filter_drag_coefficient" in fit
        else fitted_value(fit, "drag_coefficient")
    )
    if not (drag > 0.0 and intensity > 0.0):
        raise InputError("the fit does not determine C_d and σ_F: nothing can stand on it")
    return math.log(drag), math.log(intensity)


class Numbers(NamedTuple):
    """Numbers of departures, as a point takes them."""

    opened: dict[str, float]
    fixed: dict[str, float]


def stored_numbers(fit: xr.Dataset) -> Numbers:
    """Return the numbers of a stored fit."""
    found = Numbers({}, {})
    if "number" not in fit.coords:
        return found
    rows = zip(
        fit["number"].values, fit["number_value"].values, fit["number_opened"].values, strict=True
    )
    for name, value, opened in rows:
        (found.opened if opened else found.fixed)[str(name)] = float(value)
    return found


def side_slopes(
    passes: Passes, law: LawResult, restricted: Restricted, study: Study
) -> tuple[float, float]:
    """Return the derivatives of ln C_d and ln σ_F by the logarithm of the block's side.

    They come from the one step that the search makes after a change of the side. (0, 0) where the
    side is stated without an uncertainty; infinite where that step breaks down.
    """
    if study.fit.side_std_m == 0.0:
        return 0.0, 0.0
    from driftwalk.likelihood.newton import inverse
    from driftwalk.likelihood.preparation import body_of
    from driftwalk.likelihood.prior import Prior
    from driftwalk.model import apply_overrides

    # A side larger by 1 %: the derivative is a difference of two steps of the search.
    larger = apply_overrides(study, {"block.side_m": (1.0 + 0.01) * study.block.side_m})
    prior = Prior(passes)
    changed = replace(passes, body=body_of(larger, passes.body.orientation))
    steps = []
    try:
        for one in (passes, changed):
            sums = prior.add(one.sums(restricted.point), restricted.point, law.mode.weights)
            steps.append(inverse(sums.information) @ sums.score)
    except BREAKDOWN:
        return math.inf, math.inf
    drag = restricted.point.coefficients.size
    slope = (steps[1] - steps[0])[drag : drag + 2] / math.log1p(0.01)
    return float(slope[0]), 0.5 * float(slope[1])
