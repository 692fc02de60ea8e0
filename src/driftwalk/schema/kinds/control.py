"""The datasets of control: a policy of modes of agitation, and its test in fresh worlds."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import SOURCE_WARNINGS, kind

CONTROL_POLICY: Final = kind(
    """
kind: control_policy
version: 1
read: action phase class age mode flow flow_scale force_std drag_coefficient u v x y
read_attributes: target every_s blocks study safe_mode
dimensions:
    phase: phases of the run, by the time that is left
    class text: outcome classes of the blocks
    age: bins of the time in the class
    mode text: modes of agitation
    draw: the estimate, and draws from the uncertainty of the fits
    round: rounds of planning
    field: flow fields
    <y|x> [m]: nodes of the flow
variables:
    action(phase class age) int: number of the mode to choose, from 0
    flow(mode) int: number of the flow field of the mode, from 0
    flow_scale(mode) [1]: factor on the flow
    force_std(mode draw) [N]: stochastic force sigma_F of the mode
    drag_coefficient(mode draw) [1]: drag coefficient C_d of the mode
    constant_reached(mode) [1]: share of the worlds that this mode alone brought to the target
    promised(round) [1]: probability of the target by value iteration; NaN without it
    round_reached(round) [1]: share of the worlds that reached the target under its best policy
    <u|v>(field y x) [m s-1]: flow velocity <x|y>
    flag(field y x) int: origin of the node's value, as in a flow_field
    phase(phase) [s]: shortest time left at a decision of the phase
    age(age) [s]: time in the class from which the bin holds
attributes:
    target text: outcome class to be reached
    by_s number: deadline
    every_s number: time between two decisions
    latency_s number: time from an observation until the pumps have changed
    missed number: share of the observations without a class
    dwell_s number: time for which a mode is held at least
    reached number: share of fresh worlds in the target at the deadline
    reached_<low|high> number: <lower|upper> limit of the share
    confidence number: of the intervals
    worlds number: fresh worlds
    worlds_used number: worlds of the whole plan
    constant_worlds number: worlds of each mode alone
    safe_mode text: best mode alone, and that of a stream that stops
    blocks number: blocks in the tank
    block_side_m number: side of a block
    <arena|study|seed>
""",
    *SOURCE_WARNINGS,
)

CONTROL_TEST: Final = kind(
    """
kind: control_test
version: 1
dimensions:
    arm text: the policy, the best constant mode, random switching
    time: decisions, and the deadline
    mode text: modes of agitation
    class text: outcome classes of the blocks
variables:
    reached(arm) [1]: share of the worlds in the target at the deadline
    reached_<low|high>(arm) [1]: <lower|upper> limit of the share; exact
    gain(arm) [1]: share of the policy less that of the arm, in the same worlds
    gain_<low|high>(arm) [1]: <lower|upper> limit of the gain
    share(arm time) [1]: share of the worlds in the target
    usage(arm mode) [1]: share of the time before completion in a mode
    class_usage(class mode) [1]: the policy's share of the time in a class; NaN in no time
    film_class(time) int: number of the class of one world under the policy
    film_mode(time) int: number of its mode from then on; -1 at the deadline
    time(time) [s]: time from the start
attributes:
    target text: outcome class to be reached
    by_s number: deadline
    every_s number: time between two decisions
    latency_s number: time from an observation until the pumps have changed
    missed number: share of the observations without a class
    force_factor number: factor on sigma_F of the worlds
    stated number: share that the plan states
    stated_worlds number: worlds of that share
    difference_low number: lower limit of the achieved share less the stated one; Newcombe's
    difference_high number: upper limit of the difference
    verdict text: whether the interval of the difference holds 0
    worlds number: worlds of each arm
    confidence number: of the intervals
    constant_mode text: best constant mode
    film_world number: number of the world of the film
    seed
""",
    *SOURCE_WARNINGS,
)
