"""The force law of a fit in words and numbers, as the command line and a page show it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, NamedTuple

LEAST_EVIDENCE: Final = 3.0
"""Difference of the logarithms of the evidence for two laws, below which both may be right."""
OPENED_SIGMAS: Final = 6.0
"""A number is opened when its score test finds it so far from the model [standard deviations],"""
MEMORY_SIGMAS: Final = 4.0
"""or so far for the memory of the force, of which a fit says more than its test."""
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


class _Row(NamedTuple):
    label: str
    factor: float
    """Number of the reader's units in the SI unit."""
    unit: str
    note: str


_CORRECTED: Final = "corrected"
_ROWS: Final = MappingProxyType(
    {
        "added_mass_share": _Row(
            "added mass / mass", 1.0, "", "stated or assumed: no recording tells it"
        ),
        "effective_drag_coefficient": _Row(
            "C_d per effective mass", 1.0, "", "C_d over 1 + added mass / mass"
        ),
        "effective_force_std_N": _Row(
            "σ_F per effective mass", 1e3, "mN", "σ_F over 1 + added mass / mass"
        ),
        "linear_drag_kg_s": _Row(
            "linear drag", 1e3, "g/s", "C_d is that of the quadratic part alone"
        ),
        "drag_power": _Row("power of the drag", 1.0, "", "C_d holds at 3 cm/s"),
        "force_memory_s": _Row(
            "memory of the force", 1.0, "s",
            "correlation time; σ_F is that of a white force, as strong at low frequencies",
        ),
        "time_stamp_noise_s": _Row(
            "jitter of the stamps", 1e3, "ms", "standard deviation of the time stamps; corrected"
        ),
        "orientation_offset_rad": _Row(
            "orientation offset", math.degrees(1.0), "°", "between marker and faces; corrected"
        ),
        "marker_x_m": _Row("marker off by, x", 1e3, "mm", _CORRECTED),
        "marker_y_m": _Row("marker off by, y", 1e3, "mm", _CORRECTED),
        "flow_strength_change": _Row(
            "change of the flow", 1e2, "%", "from the beginning to the end; corrected"
        ),
        "pulse_amplitude": _Row("pulses of the flow", 1e2, "%", "amplitude; corrected"),
        "pulse_frequency_Hz": _Row("frequency of pulses", 1.0, "Hz", _CORRECTED),
    }
)  # fmt: skip
"""Numbers that are in a fit where the recording asks for them, or the user states them."""
_QUADRATIC_ALONE: Final = ("effective_drag_coefficient",)
"""Those that a linear drag does not have."""
_WALL: Final = MappingProxyType(
    {
        "wall_restitution": _Row("wall restitution", 1.0, "", "1: the wall takes no energy"),
        "wall_friction": _Row("wall friction", 1.0, "", "0: the wall is smooth"),
    }
)
LAW_KEYS: Final = (
    *("force_law", "force_law_stated", "drag_law", "drag_law_stated", "law_settled_by"),
    *(f"{name}{end}" for name in _ROWS for end in ("", "_interval")),
    "drag_coefficient_any_added_mass_interval",
    "force_std_any_added_mass_interval_N",
)
"""Flat names of all that a fit says of the law."""
WALL_KEYS: Final = (
    *("wall_contacts", "wall_left_out"),
    *(f"{name}{end}" for name in _WALL for end in ("", "_interval")),
)


class LawNumber(NamedTuple):
    """A number in the unit of a reader."""

    label: str
    value: float
    low: float
    high: float
    unit: str
    note: str

    found: bool = False
    """Whether it is never stated, whatever its interval."""

    @property
    def stated(self) -> bool:
        """Whether it was stated, so that it has no interval."""
        return self.low == self.high and not self.found

    def text(self, digits: int = 3) -> str:
        """Return value and interval in a row, with more digits where the interval is narrow.

        Examples
        --------
        >>> LawNumber("jitter", 9.98, 9.1, 10.9, "ms", "").text()
        '9.98 ms (9.1 to 10.9)'
        >>> LawNumber("frequency", 0.099945, 0.099894, 0.099995, "Hz", "").text()
        '0.09995 Hz (0.09989 to 0.1)'
        >>> LawNumber("friction", 1.2, 0.9, float("inf"), "", "").text()
        '1.2 (0.9 or more)'
        >>> LawNumber("memory", 0.1, 0.1, 0.1, "s", "").text()
        '0.1 s, as stated'
        """
        gap = "" if self.unit in ("", "°") else " "
        if self.value and 0.0 < self.high - self.low < abs(self.value):
            digits = max(
                digits, math.ceil(math.log10(abs(self.value) / (self.high - self.low))) + 1
            )
        value = f"{self.value:.{digits}g}{gap}{self.unit}"
        if self.stated:
            return f"{value}, as stated"
        if math.isinf(self.value):
            return f"so large that it makes no difference ({self.low:.{digits}g} or more)"
        low, high = (f"{end:.{digits}g}" for end in (self.low, self.high))
        return f"{value} ({low} or more)" if math.isinf(self.high) else f"{value} ({low} to {high})"


def law_numbers(facts: Mapping[str, Any]) -> list[LawNumber]:
    """Return the numbers of the law, the flow's strength and the camera that a fit holds.

    Parameters
    ----------
    facts : mapping
        Those of `fit_facts`.

    Examples
    --------
    >>> law_numbers({"drag_power": 1.5, "drag_power_interval": [1.48, 1.52]})[0].text()
    '1.5 (1.48 to 1.52)'
    """
    linear = facts.get("drag_law") == "linear"
    rows = {key: row for key, row in _ROWS.items() if not (linear and key in _QUADRATIC_ALONE)}
    if linear and "linear_drag_kg_s" in rows:
        rows["linear_drag_kg_s"] = rows["linear_drag_kg_s"]._replace(note="there is no other drag")
    return _numbers(rows, facts)


def wall_numbers(facts: Mapping[str, Any]) -> list[LawNumber]:
    """Return restitution and friction of the wall; nothing where they were not estimated."""
    return _numbers(_WALL, facts, found=True)


def _numbers(
    rows: Mapping[str, _Row], facts: Mapping[str, Any], *, found: bool = False
) -> list[LawNumber]:
    return [
        LawNumber(row.label, row.factor * facts[key], low, high, row.unit, row.note, found)
        for key, row in rows.items()
        if key in facts
        for low, high in [[row.factor * end for end in facts[f"{key}_interval"]]]
    ]


def wall_words(facts: Mapping[str, Any]) -> str | None:
    """Return why the wall has no numbers; None where it has, or nobody asked for them."""
    return facts.get("wall_left_out")


def law_words(facts: Mapping[str, Any]) -> dict[str, str]:
    """Return in words which law was found or stated, by the name of its row.

    Parameters
    ----------
    facts : mapping
        Those of `fit_facts`.

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


def _support(facts: Mapping[str, Any], other: str, *, paper: bool) -> str:
    """Return by how much the recording supports the law."""
    if facts.get("force_law_stated") == "yes":
        return f", {NOT_SEARCHED}"
    settled = facts.get("law_settled_by")
    if settled is None:
        return ", as far as this recording tells" if paper else ""
    if settled < LEAST_EVIDENCE:
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
    low, high = (1e3 * end for end in force)
    reach = f"σ_F is between {low:.4g} and {high:.4g} mN"
    if not linear:
        low, high = facts["drag_coefficient_any_added_mass_interval"]
        reach = f"C_d is between {low:.4g} and {high:.4g}, {reach}"
    said.append(
        f"The numbers are those without added mass. If the block carries the usual one, {reach}."
    )
    return said
