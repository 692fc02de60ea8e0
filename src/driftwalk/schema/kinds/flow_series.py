"""Attributes of a result that was simulated in a flow that changes in time, and their words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from driftwalk.schema.description import Attribute, Variable

_CHANGES: Final = "the flow changes in time"

FLOW_SERIES: Final = (
    Attribute("flow_span_s", "number", "time from the first frame to the last", _CHANGES),
    Attribute("flow_repeat", "text", "how the flow went on: none, loop, mirror or hold", _CHANGES),
    Attribute(
        "flow_begins", "text", "when runs began in it: random, together or recorded", _CHANGES
    ),
    Attribute("flow_period_s", "number", "time after which it was as before", "it was repeated"),
    Attribute(
        "flow_slack_s", "number", "time within which runs began at random",
        "they did, and it was not repeated",
    ),
    Attribute(
        "flow_join", "number", "change from the last frame to the first, over that between frames",
        "it began again",
    ),
)  # fmt: skip
"""Attributes of whatever was simulated in a flow."""

SUDDEN: Final = 3.0
"""Times the usual change between frames from which on a loop is said not to close."""

_GOES_ON: Final = {
    "none": "changes in time",
    "loop": "begins again after its last frame",
    "mirror": "runs backwards and forwards in turns",
    "hold": "stands still after its last frame",
}


def began_in_flow(dimension: str) -> Variable:
    """Return the variable that says when each world began in a flow that changes."""
    return Variable(
        "flow_start", dimension, "s", "time on the clock of the flow at which it began",
        when=_CHANGES,
    )  # fmt: skip


def flow_series_words(attrs: Mapping[str, Any], *, holds: str = "") -> list[str]:
    """Return sentences on a flow that changed in time, and on what the result holds for.

    Parameters
    ----------
    attrs : mapping
        Attributes of a result; without those of `FLOW_SERIES` there is nothing to say.
    holds : str
        What the result is: "the intervals hold", "the paths hold". Without it, for motion with
        nothing to be read from it, no word is said of when it began.

    Examples
    --------
    >>> facts = {"flow_span_s": 10.0, "flow_repeat": "hold", "flow_begins": "together"}
    >>> flow_series_words(facts, holds="the shares hold")[0][:55]
    'the flow series of 10 s stands still after its last fra'
    """
    repeat = attrs.get("flow_repeat")
    if repeat is None or (attrs["flow_begins"] == "recorded" and repeat == "none"):
        return []
    what = f"the flow series of {attrs['flow_span_s']:g} s {_GOES_ON[str(repeat)]}"
    if attrs["flow_begins"] == "recorded":
        begins = "; it keeps the clock of the recording, from its first sample on"
    elif not holds:
        begins = ""
    elif attrs["flow_begins"] == "random":
        within = (
            "its period"
            if "flow_period_s" in attrs
            else f"the first {attrs['flow_slack_s']:.3g} s that leave it time to end"
        )
        begins = (
            f"; each run begins at its own moment of {within}; {holds} for water that goes on as "
            "in this series, and not for what it does not show"
        )
    else:
        begins = (
            f"; all runs begin at one moment of it; {holds} for this one course of the water, by "
            "the chance of starts and forces alone"
        )
    words = [what + begins]
    if float(attrs.get("flow_join", 0.0)) > SUDDEN:
        words.append(
            "the flow series does not close: from its last frame to its first the water changes "
            f'{attrs["flow_join"]:.3g} times as much as between frames; `flow.repeat="mirror"` '
            "has no such jump"
        )
    return words
