"""Confounders of an opened law: what else looks like a power of the drag or a memory of the force.

Contacts with the wall that the filter takes for free motion, tracking errors and a flow
whose shape changes leave errors that another law absorbs. Such a law is opened only where the
recording asks for it without them, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

from driftwalk.core.units import in_percent
from driftwalk.likelihood.filter.series import Series, usable_intervals
from driftwalk.likelihood.law.forward_selection import ForwardSelection, is_retained
from driftwalk.likelihood.law.shape_changes import shape_change
from driftwalk.likelihood.newton import FROM_ANOTHER, Mode, converged

LAW_NUMBERS: Final[Mapping[str, tuple[str, str]]] = {
    "linear_share": ("a linear part of the drag, a share", ""),
    "drag_power": ("a power of the drag", ""),
    "force_memory": ("a memory of the force", " s"),
}
"""Numbers of the law, in words, with their units."""


class ConfounderPolicy(NamedTuple):
    """When a confounder explains what a number of the law was opened for."""

    least_disturbed: float = 0.02
    """Share of the intervals near the wall or next to a gap from which on they are tried as a
    confounder. Chosen by hand."""
    same_sigmas: float = 3.0
    """Standard deviations within which the number is the same without them: half of its least
    effect counts as an error of the filter. Chosen by hand, as the retained sigmas."""


CONFOUNDER: Final = ConfounderPolicy()


def objections_to(
    mode: Mode,
    names: Sequence[str],
    selection: ForwardSelection,
    undisturbed: Callable[[], Sequence[Series]],
) -> dict[str, str]:
    """Return for each number of the law that a confounder explains why, in a sentence."""
    search, least = selection.search, selection.least
    shape = shape_change(selection.scores, mode)
    if shape is not None and shape.significant:
        why = "the shape of the flow changes, which can look like such a law"
        return {name: f"{number_sentence(mode, name)} was not opened: {why}" for name in names}
    series = undisturbed()
    share = usable_intervals(series) / max(usable_intervals(search.passes.series), 1)
    if share > 1.0 - CONFOUNDER.least_disturbed:
        return {}
    few = search.of(series).shortened()
    alone = converged(few.find(mode.point, mode.weights, held=FROM_ANOTHER))
    return {
        name: (
            f"{number_sentence(mode, name)} was not opened: {_without(alone, name, share)}; "
            "contacts with the wall or tracking errors can look like such a law: record where the "
            "block stays away from the wall"
        )
        for name in names
        if alone is None or not _same(mode, alone, name, least)
    }


def _same(mode: Mode, alone: Mode, name: str, least: Mapping[str, float]) -> bool:
    (value, _), (other, std) = mode.value_of(name), alone.value_of(name)
    error = math.hypot(std, 0.5 * least.get(name, 0.0))
    same = abs(value - other) <= CONFOUNDER.same_sigmas * error
    return same and is_retained(alone, name, least)


def _without(alone: Mode | None, name: str, share: float) -> str:
    left = (
        f"the {in_percent(share)} of the intervals that are half a side or more from the wall "
        "and not next to a gap"
    )
    if alone is None:
        return f"{left} do not determine it"
    value, std = alone.value_of(name)
    return f"in {left} it is {value:.3g} ± {std:.2g}{LAW_NUMBERS[name][1]}"


def number_sentence(mode: Mode, name: str) -> str:
    """Return a number of the law at a mode in words, with its standard deviation."""
    value, std = mode.value_of(name)
    words, unit = LAW_NUMBERS[name]
    return f"{words} of {value:.3g} ± {std:.2g}{unit}"
