"""The force law of a fit in words and numbers, and the force laws that it has compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.schema.answers.parts import Estimate, estimates
from driftwalk.schema.kinds.fit import LAW_NUMBERS, WALL_NUMBERS

if TYPE_CHECKING:
    import xarray as xr


class ForwardSelectionPolicy(NamedTuple):
    """When a law is ahead of another, and when a number of a departure is opened and stays open."""

    least_evidence: float = 3.0
    """Difference of the logarithms of the evidence for two laws, below which both may be right:
    odds of 20 to 1. Chosen by hand."""
    opened_sigmas: float = 6.0
    """A number is opened when its score test finds it so far from the model [standard deviations].
    Chosen by hand; none of 380 recordings of the model opened a number (studies/misfit, set
    right)."""
    memory_sigmas: float = 4.0
    """The same for the memory of the force, of which a fit says more than its test. Chosen by hand;
    checked on the same recordings."""
    retained_sigmas: float = 3.0
    """An opened number stays open when the fit finds it further from the model than this [standard
    deviations], with half of its least effect as an error of the filter. Chosen by hand; none of
    380 recordings of the model opened a number (studies/misfit, set right)."""
    retained_memory_sigmas: float = 3.4
    """The same for the memory of the force: a flow with more detail than the spline acts like a
    memory of 0.1 s (docs/explanation/likelihood.md)."""
    strength_chi_squared: float = 50.0
    """Chi squared (7 degrees of freedom) of the flow's strength from which on its slow change is
    opened: chance exceeds it once in 7e7."""
    retained_chi_squared: float = 21.8
    """The same from which on it stays open: the chance of 3 standard deviations, once in 370."""
    rounds: int = 3
    """Rounds of score tests and openings. Chosen by hand."""
    linear_share: float = 0.15
    """Least effect of a linear part: a smaller one may be an error of the filter. Chosen by hand,
    as the least effects that follow (studies/misfit/power.py shows what they let through)."""
    drag_power: float = 0.15
    """Least change of the drag's power; chosen by hand."""
    force_memory: float = 0.04
    """Least memory of the force [s]; chosen by hand."""
    time_noise: float = 0.003
    """Least jitter of the time stamps [s]; chosen by hand."""
    angle_offset_deg: float = 1.0
    """Least offset of the angle [degrees]. The eight strips of a face imitate up to 1.2 degrees in
    blocks that float and spin fast (two recordings of studies/verdict; one of them was fitted again
    with 32, and no offset was left)."""
    marker: float = 0.012
    """Least offset of the marker, in sides of the block; chosen by hand."""
    strength: float = 0.01
    """Least amplitude of the line or of a cosine of the flow's strength; chosen by hand."""
    pulse: float = 0.02
    """Least amplitude of a pulse; chosen by hand."""


FORWARD_SELECTION: Final = ForwardSelectionPolicy()

NOT_SEARCHED: Final = "as stated; the fit tried no other"
LINEAR_DRAG_ALONE: Final = "none, as the drag is linear"
"""Stands where C_d would."""
PAPER, FLOATING = "the paper's", "a floating body's"
DRAG_LAWS: Final = MappingProxyType(
    {
        "quadratic": "quadratic",
        "linear": "linear",
        "mixed": "quadratic with a linear part",
        "power": "a power of the speed",
    }
)
"""Words for the kinds of drag."""


def law_estimates(fit: xr.Dataset) -> list[Estimate]:
    """Return the numbers of the law, of the flow's strength and of the camera that a fit holds."""
    linear = fit.attrs.get("drag_law") == "linear"
    made = []
    for one in estimates(fit):
        if one.number not in LAW_NUMBERS or (linear and "drag_coefficient" in one.number.name):
            continue
        number = one.number
        if linear and number.name == "linear_drag":
            number = replace(number, note="there is no other drag")
        made.append(one._replace(number=number, role="law"))
    return made


def shared_lengths(fit: xr.Dataset) -> tuple[float, float, float]:
    """Return the length of the stirring between the ends of its interval [m]."""
    number = {"parameter": "stirring_length"}
    low, high = (float(one) for one in fit["interval"].sel(number).values)
    return low, float(fit["estimate"].sel(number)), high


def wall_estimates(fit: xr.Dataset) -> list[Estimate]:
    """Return restitution and friction of the wall; nothing where they were not estimated."""
    confidence = float(fit["confidence"]) if "confidence" in fit else None
    return [
        Estimate(one, float(fit[one.name]), (low, high), confidence, role="wall")
        for one in WALL_NUMBERS
        if one.name in fit
        for low, high in [map(float, fit[f"{one.name}_interval"].values)]
    ]


def law_words(facts: Mapping[str, Any]) -> dict[str, str]:
    """Return in words which law was found or stated, by the name of its row.

    Parameters
    ----------
    facts : mapping
        Those of `facts_of`.

    Returns
    -------
    dict
        "force law", and "drag law" where it was stated alone; nothing in a fit of a version that
        knew one law.

    Examples
    --------
    >>> law_words({"force_law": "paper"})
    {'force law': "the paper's, as far as this recording tells"}
    >>> law_words({"force_law": "paper", "force_law_stated": "yes"})
    {'force law': "the paper's, as stated; the fit tried no other"}
    """
    if "force_law" not in facts:
        return {}
    paper = facts["force_law"] == "paper"
    found, other = (PAPER, FLOATING) if paper else (FLOATING, PAPER)
    rows = {"force law": f"{found}{_support(facts, other, paper=paper)}"}
    drag = str(facts.get("drag_law", "quadratic"))
    whole = paper and drag == "quadratic" and facts.get("force_law_stated") == "yes"
    if facts.get("drag_law_stated") == "yes" and not whole:
        rows["drag law"] = f"{DRAG_LAWS.get(drag, drag)}, {NOT_SEARCHED}"
    return rows


def flow_in_time(fit: xr.Dataset) -> str | None:
    """Return in which frames the flow of a fit that changes is given on; None of a steady one."""
    if "flow_strength" not in fit:
        left_out = fit.attrs.get("flow_strength_left_out")
        modes = [] if "mode_time" not in fit.coords else [_period(fit["mode_time"].values)]
        if "mode_repeat" in fit.attrs:
            time, repeat = fit["mode_time"].values, fit.attrs["mode_repeat"]
            modes = [f"{time.size} frames, taken from the measured flow"]
            modes[0] += "" if repeat == "none" else f"; beyond them: {repeat}"
        return "; ".join([*modes, *([str(left_out)] if left_out else [])]) or None
    time, strength = fit["strength_time"].values, fit["flow_strength"].values
    low, high = float(strength.min()), float(strength.max())
    between = f"strength {low:.3g} to {high:.3g} of the mean"
    if fit.attrs["flow_strength_repeat"] == "loop":
        return f"{_period(time)}; {between}"
    words = (
        f"{time.size} frames from 0 to {time[-1]:.4g} s; {between}; before and after, it stays as "
        "in the first and the last frame"
    )
    left_out = fit.attrs.get("flow_strength_left_out")
    return words if left_out is None else f"{words}; without pulses: {left_out}"


def _period(time: Floats) -> str:
    return f"{time.size} frames of one period, {time[-1]:.4g} s, which begins again"


def _support(facts: Mapping[str, Any], other: str, *, paper: bool) -> str:
    """Return by how much the recording supports the law."""
    if facts.get("force_law_stated") == "yes":
        return f", {NOT_SEARCHED}"
    settled = facts.get("law_settled_by")
    if settled is None:
        return ", as far as this recording tells" if paper else ""
    if settled < FORWARD_SELECTION.least_evidence:
        return f"; the recording cannot tell it from {other}"
    return f"; {other} is less likely by e^{settled:.0f}"


def law_limits(facts: Mapping[str, Any]) -> list[str]:
    """Return what no recording tells of the law, a sentence each."""
    if "force_law" not in facts:
        return []
    linear = facts.get("drag_law") == "linear"
    drag = "the linear drag" if linear else "C_d"
    said = [
        f"No recording tells the added mass: if {drag}, σ_F and 1 + added mass / mass are "
        "multiplied by the same number, the motion stays the same."
    ]
    force = facts.get("force_std_any_added_mass_interval_N")
    if force is None:
        return said
    ends = {"σ_F": (force, 1e3, " mN")}
    if not linear:
        ends = {"C_d": (facts["drag_coefficient_any_added_mass_interval"], 1.0, ""), **ends}
    # Of a number that is not determined there is nothing to say.
    reach = ", ".join(
        f"{name} is between {scale * low:.4g} and {scale * high:.4g}{unit}"
        for name, ((low, high), scale, unit) in ends.items()
        if isfinite(high)
    )
    without = "The numbers are those without added mass."
    return [*said, f"{without} If the block carries the usual one, {reach}." if reach else without]


class ComparedLaw(NamedTuple):
    """One law, against the best ones; NaN where it has no solution."""

    name: str
    loss: float
    """Loss of the mean logarithm of the density of a held out sample, against the best law."""
    std: float
    """Standard error of the loss."""
    evidence: float
    """Logarithm of the evidence, above that of the law with the most; at most 0."""

    @property
    def solved(self) -> bool:
        """Whether the law has a solution."""
        return isfinite(self.loss)


def compared_laws(fit: xr.Dataset) -> list[ComparedLaw]:
    """Return the compared laws, the best first; none where they were not asked for.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.

    Examples
    --------
    >>> import xarray as xr
    >>> names = ("log_evidence", "log_score", "log_score_std")
    >>> columns = [[7.0, 9.0], [1.5, 2.0], [0.1, 0.0]]
    >>> fit = xr.Dataset(
    ...     {f"compared_{n}": ("compared_law", c) for n, c in zip(names, columns)},
    ...     {"compared_law": ["paper", "floating body"]},
    ... )
    >>> compared_laws(fit)[1]
    ComparedLaw(name='paper', loss=0.5, std=0.1, evidence=-2.0)
    """
    if "compared_law" not in fit.dims:
        return []
    score = fit["compared_log_score"].values
    evidence = fit["compared_log_evidence"].values
    std = fit["compared_log_score_std"].values
    known = bool(np.isfinite(score).any())
    best, most = (float(np.nanmax(one)) if known else np.nan for one in (score, evidence))
    return [
        ComparedLaw(
            str(fit["compared_law"].values[k]),
            best - float(score[k]),
            float(std[k]),
            float(evidence[k]) - most,
        )
        for k in np.argsort(-score)
    ]
