"""The assumptions of a study on the force law and the camera, for the search over laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from driftwalk.likelihood.filter.departures import DRAG_SHAPES, DRAGS, STRENGTHS

if TYPE_CHECKING:
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
    if fit.force_memory_s == "auto" and is_stated(study, "force_memory_s"):
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
    pulses = fit.flow_strength != "constant" and alone
    gradient = "off" if fit.law == "paper" else fit.pressure_gradient
    if gradient == "auto" and is_stated(study, "pressure_gradient"):
        gradient = "on"
    return Assumptions(gradient, opened, fixed, tuple(tried), pulses)


def _drag_of(study: Study) -> tuple[dict[str, float], dict[str, float], list[str]]:
    """Return the numbers of the drag that are opened, known and tried."""
    law = study.fit.law
    if law == "auto" and is_stated(study, "drag_power"):
        return {}, {"drag_power": study.forces.drag_power}, []
    if law == "auto":
        return {}, {}, [*DRAG_SHAPES]
    drag = DRAGS["quadratic" if law == "paper" else law]
    return dict(drag.opened), dict(drag.fixed), []


def is_stated(study: Study, key: str) -> bool:
    """Return whether [forces] states another law. A new study file holds every key as it is."""
    return not study.forces.is_default(key)


def added_mass_of(study: Study, *, floating: bool) -> tuple[float, float]:
    """Return the added mass as a share of the block's mass, and its standard deviation."""
    stated = study.fit.added_mass_share
    if stated == "auto" and is_stated(study, "added_mass_share"):
        stated = study.forces.added_mass_share
    if stated != "auto":
        return stated, study.fit.added_mass_share_std
    if study.fit.law == "paper" or not floating:
        return 0.0, 0.0
    return USUAL_ADDED_MASS
