"""The dataset of the water's velocity, and what a result says of a flow that changes in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from driftwalk.schema.description import Variable, attributes, kind

ORIGIN: Final = {"outside": 0, "measured": 1, "filled": 2}
"""Where the value of a node comes from."""
_ON: Final = "[time] y x"
_RECORDED: Final = "made from a recording"
_BODY: Final = "made from the track of a body"
_TRACERS: Final = "made from tracers"

FIT_PREFIX: Final = "interval_of_"
"""In front of the parameters of the fit that made a flow."""

FLOW_FIELD: Final = kind(
    f"""
kind: flow_field
version: 1
read: u v x y
dimensions:
    time: frames of a flow that changes
    <y|x>: nodes
variables:
    u({_ON}) [m s-1]: flow velocity x; finite; bilinear between nodes
    v({_ON}) [m s-1]: flow velocity y
    flag({_ON}) flags: origin of the node's value
    <x|y>(<x|y>) [m]: <x|y>; evenly spaced
variables ({_BODY}):
    u_block({_ON}) [m s-1]: mean block velocity x; before the correction; NaN where the body never \
        was
    v_block({_ON}) [m s-1]: mean block velocity y
variables ({_RECORDED}):
    count({_ON}) [1]: samples in the cell
    u_standard_error({_ON}) [m s-1]: standard error of flow velocity x; of the scatter: [how good \
        it is](../explanation/flow.md#how-good-is-it)
    v_standard_error({_ON}) [m s-1]: standard error of flow velocity y
variables ({_TRACERS}):
    tracks({_ON}) [1]: tracks in the cell
variables (the flow changes):
    time [s]
attributes (made by a stage):
    method text: how it was made
    cell_size_m number: distance between nodes
attributes (the tank is known):
    arena
attributes (made from a formula):
    parameters object: parameters of the formula
attributes (made from a file or a recording):
    source
attributes (read from a file):
    reading text: meaning of the columns, direction of y
attributes ({_BODY}):
    inertia text: how the body's inertia was corrected
    window_s number: time over which derivatives are taken
    mass_kg number: mass of the body
    area_m2 number: area that the water pushes on
    water_density_kg_m3 number: density of the water
    flow_drag_coefficient number: drag coefficient of Eq. 4
    bodies list: names of the bodies
    samples_without_derivative number: samples too near a gap
attributes ({_RECORDED}):
    min_count number: samples that make a cell a measured one
    samples_used number: samples in the cells
    samples_outside_tank number: samples beyond the wall
    <measured|filled>_share number: share of the tank's cells
attributes ({_TRACERS}):
    tracks_used number: tracks in the cells
    position_noise_m number: noise for the test of links
    outlier_threshold number: deviation of a false link
    samples_rejected number: steps that are false links
    samples_unjudged number: steps with too few neighbours
    samples_across_gaps number: pairs with a gap between
    samples_ambiguous number: pairs of unsure identity
attributes (made by a fit):
    {FIT_PREFIX}drag_coefficient numbers: ends of the fit's interval of C_d
    {FIT_PREFIX}force_noise_intensity numbers: ends of its interval of σ_F² times the force \
        interval; in N² s
attributes (stretched to another tank):
    stretched_by number: ratio of the diameters
attributes (with a warning):
    warning text: what to know about the field
attributes (the flow changes, and its repeat is stated):
    repeat text: how it goes on beyond its frames: loop, mirror or hold
""",
    flags={"flag": ORIGIN},
)

_CHANGES: Final = "the flow changes in time"

FLOW_SERIES: Final = attributes(f"""
attributes ({_CHANGES}):
    flow_span_s number: time from the first frame to the last
    flow_repeat text: how the flow went on: none, loop, mirror or hold
    flow_begins text: when runs began in it: random, together or recorded
attributes (the flow was repeated):
    flow_period_s number: time after which it was as before
attributes (runs began at random, and the flow was not repeated):
    flow_slack_s number: time within which runs began at random
attributes (the flow began again):
    flow_join number: change from the last frame to the first, over that between frames
""")
"""Attributes of whatever was simulated in a flow."""


class LoopPolicy(NamedTuple):
    """When a flow that begins again has a jump."""

    sudden: float = 3.0
    """Times the usual change between frames from which on a loop is said not to close; chosen by
    hand."""


LOOP: Final = LoopPolicy()

_GOES_ON: Final = {
    "none": "changes in time",
    "loop": "begins again after its last frame",
    "mirror": "runs backwards and forwards in turns",
    "hold": "stands still after its last frame",
}


def began_in_flow(dimension: str) -> Variable:
    """Return the variable that says when each world began in a flow that changes."""
    words = "time on the clock of the flow at which it began"
    return Variable("flow_start", dimension, "s", words, when=_CHANGES)


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
    if float(attrs.get("flow_join", 0.0)) > LOOP.sudden:
        words.append(
            "the flow series does not close: from its last frame to its first the water changes "
            f'{attrs["flow_join"]:.3g} times as much as between frames; `flow.repeat="mirror"` '
            "has no such jump"
        )
    return words
