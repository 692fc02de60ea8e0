"""The force law: what a study assumes of it, and what a fit states of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.law.candidate_laws import (
    CHANGES,
    DRAG_SHAPES,
    DRAGS,
    INTENSITIES,
    STRENGTHS,
)
from driftwalk.likelihood.newton import Mode, ModeSearch, inverse
from driftwalk.likelihood.refuse import BREAKDOWN
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.likelihood.reml import Restricted
    from driftwalk.model import Study


FLOATING: Final[Mapping[str, float]] = {"water_acceleration": 1.0, "water_spin": 1.0}
"""Numbers of a body that floats: it displaces its own mass of water."""
USUAL_ADDED_MASS: Final = (0.5, 0.2)
"""Added mass of a floating body as a share of its mass, and its standard deviation, where the
user states none: 0.3 to 1 is possible (docs/explanation/likelihood.md)."""
CAMERA: Final = ("time_variance", "angle_offset", "marker_x", "marker_y")


@dataclass(frozen=True)
class Assumptions:
    """Numbers that are known before the fit, and those that are left to it."""

    pressure_gradient: str
    """"on", "off" or "auto"."""
    opened: Mapping[str, float]
    """Numbers that are estimated in any case, with their first values."""
    fixed: Mapping[str, float]
    """Numbers that are known and differ from the model."""
    tried: tuple[str, ...]
    """Numbers that are opened where the recording asks for it."""
    pulses: bool
    """Whether pulses of the flow are looked for."""


def assumptions_of(study: Study, angle: str, *, recordings: int, flows: int) -> Assumptions:
    """Return what a study leaves to the fit.

    Where [fit] says "auto", a key of [forces] states the law if it differs from its default.
    """
    fit = study.fit
    opened, fixed, tried = _drag_of(study)
    if fit.force_memory_s == "auto" and _states_other(study, "force_memory_s"):
        fixed["force_memory"] = study.forces.force_memory_s
    elif fit.force_memory_s == "auto":
        tried.append("force_memory")
    elif fit.force_memory_s != "white":
        fixed["force_memory"] = fit.force_memory_s
    if fit.camera == "auto":
        tried += [name for name in CAMERA if angle == "state" or name == "time_variance"]
    alone = recordings == 1 and flows == 1
    if fit.flow_strength == "smooth":
        opened.update(dict.fromkeys(STRENGTHS, 0.0))
    elif fit.flow_strength == "auto" and alone:
        tried += STRENGTHS
    if fit.flow_labels is not None and flows > 1:
        if flows > len(INTENSITIES):
            raise InputError(f"{flows} flows are more than {len(INTENSITIES)}: name fewer")
        opened.update(dict.fromkeys(INTENSITIES[: flows - 1], 0.0))
    pulses = fit.flow_strength != "constant" and alone
    gradient = "off" if fit.law == "paper" else fit.pressure_gradient
    if gradient == "auto" and _states_other(study, "pressure_gradient"):
        gradient = "on"
    return Assumptions(gradient, opened, fixed, tuple(tried), pulses)


def _drag_of(study: Study) -> tuple[dict[str, float], dict[str, float], list[str]]:
    """Return the numbers of the drag that are opened, known and tried."""
    law = study.fit.law
    if law == "auto" and _states_other(study, "drag_power"):
        return {}, {"drag_power": study.forces.drag_power}, []
    if law == "auto":
        # Without a heading a power of the drag can hardly be separated from the flow: on one of ten
        # discs of the quadratic law a power of 3.2 was opened.
        return {}, {}, [*DRAG_SHAPES] if study.block.body().symmetry else []
    drag = DRAGS["quadratic" if law == "paper" else law]
    return dict(drag.opened), dict(drag.fixed), []


def _states_other(study: Study, key: str) -> bool:
    """Return whether [forces] states another law. A new study file holds every key as it is."""
    return not study.forces.is_default(key)


PLAIN: Final = {
    "hidden_share": "hidden_face_drag_share",
    "drag_power": "drag_power",
    "force_memory": "force_memory_s",
    "angle_offset": "orientation_offset_rad",
    "marker_x": "marker_x_m",
    "marker_y": "marker_y_m",
    "pulse_frequency": "pulse_frequency_Hz",
    "mode_frequency": "mode_frequency_Hz",
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


def inertia_of(study: Study, point: Point) -> Inertia:
    """Return the inertia with its uncertainty, from what a study states, under the law found."""
    fit = study.fit
    in_forces = _states_other(study, "added_mass_share")
    if fit.added_mass_share != "auto":
        added, std = fit.added_mass_share, fit.added_mass_share_std
    elif in_forces:
        added, std = study.forces.added_mass_share, fit.added_mass_share_std
    elif fit.law == "paper" or point.number("water_acceleration") == 0.0:
        added, std = 0.0, 0.0
    else:
        added, std = USUAL_ADDED_MASS
    stated = fit.added_mass_share != "auto" or fit.law == "paper" or in_forces
    mass = fit.mass_std_kg / study.block.mass_kg
    return Inertia(added, std, stated, math.hypot(std / (1.0 + added), mass))


def stated_drag(point: Point, study: Study) -> float:
    """Return C_d of the quadratic part of the drag, with the added mass."""
    share = inertia_of(study, point).share
    return share * (1.0 - point.number("linear_share")) * math.exp(point.log_drag)


def inertia_facts(inertia: Inertia, facts: dict[str, Any], normal: float) -> dict[str, Any]:
    """Return the added mass, or how far C_d and the force reach where nothing is known of it."""
    if inertia.added or inertia.added_std or inertia.stated:
        low, high = (inertia.added + sign * normal * inertia.added_std for sign in (-1, 1))
        ends = [max(low, 0.0), high]
        return {"added_mass_share": inertia.added, "added_mass_share_interval": ends}
    usual, std = USUAL_ADDED_MASS
    most = 1.0 + usual + normal * std
    return {
        f"{name}_any_added_mass_interval{unit}": [low, high * most]
        for name, unit in (("drag_coefficient", ""), ("force_std", "_N"))
        for low, high in [facts[f"{name}{unit}_interval"]]
    }


def number_facts(point: Point, covariance: Floats, study: Study) -> dict[str, Any]:
    """Return the opened numbers with their intervals, and the stated ones, units in the keys.

    `covariance` is that of ln C_d, noises and numbers, times the square of the interval's width in
    standard deviations.
    """
    first = 1 + len(point.noises)
    reach = np.sqrt(np.diag(covariance))
    widths = dict(zip(point.opened, reach[first:].tolist(), strict=True))
    facts: dict[str, Any] = {}

    def state(key: str, value: float, width: float, scale: float = 1.0) -> None:
        facts[key] = scale * value
        facts[f"{key}_interval"] = [scale * (value - width), scale * (value + width)]

    for name, key in PLAIN.items():
        if name in widths or name in point.fixed:
            state(key, point.number(name), widths.get(name, 0.0))
    if "hidden_share" in widths:
        low, high = facts["hidden_face_drag_share_interval"]
        facts["hidden_face_drag_half_width"] = 0.5 * (high - low)
        # The water may seem to pull at a hidden face, or to push more than at a free one.
        for key in ("hidden_face_drag_share", "hidden_face_drag_share_interval"):
            clipped = np.clip(facts[key], 0.0, 1.0)
            facts[key] = clipped.tolist() if clipped.ndim else float(clipped)
    if "time_variance" in widths:
        value, width = point.opened["time_variance"], widths["time_variance"]
        ends = [math.sqrt(max(one, 0.0)) for one in (value - width, value + width)]
        facts["time_stamp_noise_s"] = math.sqrt(value)
        facts["time_stamp_noise_s_interval"] = ends
    share = point.number("linear_share")
    if share:
        # It goes with C_d of the filter, too.
        width = math.hypot(widths.get("linear_share", 0.0), share * float(reach[0]))
        # Of the whole block for a share of 1, K b of all strips: four faces, b a quarter of the
        # speed at which linear and quadratic drag are compared, a side a second.
        side = face = study.block.side_m
        if study.block.shape != "square":
            face = 0.25 * float(study.body().panels[:, 4].sum())
        area = face * study.wetted_depth_m
        drag = 0.5 * study.water.density_kg_m3 * math.exp(point.log_drag) * area * side
        state("linear_drag_kg_s", share, width, drag * inertia_of(study, point).share)
    if "strength_trend" in widths:
        change = -2.0 * sum(point.opened[name] for name in CHANGES)
        # Line and cosines share what the recording says of the change: their errors go together.
        at = [k for k, name in enumerate(point.opened, first) if name in CHANGES]
        spread = 4.0 * float(covariance[np.ix_(at, at)].sum())
        state("flow_strength_change", change, math.sqrt(spread))
    if "pulse_sine" in widths:
        size = math.hypot(point.opened["pulse_cosine"], point.opened["pulse_sine"])
        state("pulse_amplitude", size, max(widths["pulse_cosine"], widths["pulse_sine"]))
    return facts


def effective_logs(fit: xr.Dataset, study: Study) -> tuple[float, float]:
    """Return ln C_d and ln q as the filter takes them, without added mass, from a stored fit."""
    known = {str(name) for name in fit["parameter"].values}
    prefix = "effective_" if "effective_force_std" in known else ""
    force = fitted_value(fit, f"{prefix}force_std")
    intensity = force**2 * float(fit["force_interval"]) / study.block.mass_kg**2
    drag = float(fit["filter_drag_coefficient"])
    if not (drag > 0.0 and intensity > 0.0):
        raise InputError("the fit does not determine C_d and σ_F, which this step needs")
    return math.log(drag), math.log(intensity)


def stored_numbers(fit: xr.Dataset) -> tuple[dict[str, float], dict[str, float]]:
    """Return the opened numbers of a stored fit, and those that it took for known."""
    opened: dict[str, float] = {}
    fixed: dict[str, float] = {}
    if "number" in fit.coords:
        columns = (fit[name].values for name in ("number", "number_value", "number_opened"))
        for name, value, is_opened in zip(*columns, strict=True):
            (opened if is_opened else fixed)[str(name)] = float(value)
    return opened, fixed


def side_slopes(
    search: ModeSearch, mode: Mode, restricted: Restricted, study: Study
) -> tuple[float, float]:
    """Return the derivatives of ln C_d and ln σ_F by the logarithm of the block's side.

    They come from the one step that the search makes after a change of the side. (0, 0) where the
    side is stated without an uncertainty; infinite where that step breaks down.
    """
    if study.fit.side_std_m == 0.0:
        return 0.0, 0.0
    from driftwalk.model import apply_overrides

    passes, point = search.passes, restricted.point
    # A side larger by 1 %: the derivative is a difference of two steps of the search.
    larger = apply_overrides(study, {"block.side_m": (1.0 + 0.01) * study.block.side_m})
    changed = replace(passes, body=Body(larger, passes.body.orientation))
    steps = []
    try:
        for one in (passes, changed):
            sums = search.prior.add(one.sums(point), point, mode.weights)
            steps.append(inverse(sums.information) @ sums.score)
    except BREAKDOWN:
        return math.inf, math.inf
    drag = point.coefficients.size
    slope = (steps[1] - steps[0])[drag : drag + 2] / math.log1p(0.01)
    return float(slope[0]), 0.5 * float(slope[1])
