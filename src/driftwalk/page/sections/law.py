"""The force law of a fit on its page: what was found or stated, and what was tested."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.page.parts import Section, card, figure, section
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.answers.force_law import (
    MEMORY_SIGMAS,
    OPENED_SIGMAS,
    compared_laws,
    law_estimates,
    law_limits,
    law_words,
    wall_estimates,
)

if TYPE_CHECKING:
    import xarray as xr

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
    **{f"strength_{k}": f"strength of the flow, cosine {k}" for k in range(1, 7)},
}
"""Words for the numbers that score tests look at."""
CHANCE_SIGMAS: Final = 2.0
"""Chance exceeds this in one test of twenty [standard deviations]."""


def law_sections(fit: xr.Dataset) -> list[Section]:
    """Return the sections on the force law, its rivals, and the wall."""
    facts = facts_of(fit)
    made = []
    rows = law_words(facts)
    if rows:
        said = [f"{_first_upper(label)}: {words}." for label, words in rows.items()]
        shown = [card(one) for one in law_estimates(fit)]
        if "law_settled_by" in facts:
            shown.insert(0, _settled(facts["law_settled_by"]))
        made.append(
            section(
                "law", "summary", "The force law",
                paragraphs=[*said, *law_limits(facts)], numbers=shown,
            )
        )  # fmt: skip
    made += [part for part in (_compared(fit), _tested(fit)) if part is not None]
    lacking, walls = fit.attrs.get("wall_left_out"), wall_estimates(fit)
    if lacking is not None or walls:
        words = f"The block touched the wall in {facts['wall_contacts']} passages."
        paragraphs = [words if lacking is None else f"The wall: {lacking}."]
        numbers = [card(one) for one in walls]
        made.append(section("wall", "summary", "The wall", paragraphs=paragraphs, numbers=numbers))
    return made


def _settled(apart: float) -> dict[str, Any]:
    note = "difference of the logarithms of the evidence; below 3 the recording cannot tell"
    return figure("evidence for this law over the other", apart, note=note)


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
    return section("laws", "table", "Force laws compared", note, columns=columns, rows=rows)


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
        f"their standard deviations; 0 is the model. A number is fitted from {OPENED_SIGMAS:g} on "
        f"(the memory of the force from {MEMORY_SIGMAS:g} on) if it is large enough to matter, and "
        "stays if the fit finds it too. Small errors of the fitted flow can look like a weaker "
        "one: the check of the model says whether anything is missing from it."
    )
    columns = ["what was tested", "standard deviations from the model", "why it is not in the fit"]
    return section(
        "tested", "table", "Tested, and not in the fit", note, columns=columns, rows=rows
    )


def _why(name: str, sigmas: float) -> str:
    """Return why a number that was tested is not in the fit."""
    least = MEMORY_SIGMAS if name == "force_memory" else OPENED_SIGMAS
    if not isfinite(sigmas):
        return "it has no estimate"
    if abs(sigmas) <= CHANCE_SIGMAS:
        return "as near as chance brings it"
    if name.startswith("water_"):
        return "the two force laws were compared as a whole"
    if name.startswith("strength_"):
        return "the cosines are tested together, and fitted together or not at all"
    if abs(sigmas) <= least:
        return f"too weak: fitted from {least:g} on"
    return "too small to matter, of the wrong sign, or not found by the fit"


def _first_upper(text: str) -> str:
    return text[:1].upper() + text[1:]
