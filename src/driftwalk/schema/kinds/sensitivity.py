"""Datasets of settings that vary: sensitivity of self-assembly, its indices, the largest yield."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from driftwalk.schema.description import SOURCE_WARNINGS, Number, kind, limited, variables
from driftwalk.schema.kinds.assembly import SETTINGS
from driftwalk.schema.kinds.fit import BLOCK_NUMBERS

AXES: Final = variables("""
variables (an axis):
    drag_coefficient(drag_coefficient) [1]: drag coefficient
    force_std(force_std) [N]: standard deviation of the force
    tank_diameter(tank_diameter) [m]: diameter of the tank
    blocks(blocks) [1] int: number of blocks
    flow(flow) text: flow field
    flow_scale(flow_scale) [1]: factor on the flow velocity
    glued(glued) text: rows of the blocks of a body at the start
    latching(latching) text: when two blocks latch
    faces(faces) text: types of the faces +x, +y, -x, -y of the blocks
    hidden_face_drag(hidden_face_drag) text: drag on joined faces; a word, or its share of a free \
        face's
    stirring_length(stirring_length) [m]: distance over which blocks share the stochastic force
    bond_rate(bond_rate) [s-1]: rate at which bonds break
    magnets(magnets) text: magnet at the centre of each face
""")
"""Quantities that may vary over a map."""
AXIS_NUMBERS: Final = {
    one.name: one
    for one in (
        *BLOCK_NUMBERS[:2],
        Number("tank_diameter", "m", shown="cm"),
        Number("blocks", label="number of blocks"),
        Number("flow_scale", label="strength of the flow"),
        Number("stirring_length", "m", "length of the stirring", shown="cm"),
        Number("bond_rate", "1/s", "rate at which bonds break"),
        Number("flow"),
        Number("glued", label="glued at the start"),
        Number("latching"),
        Number("faces"),
        Number("hidden_face_drag", label="drag on hidden faces"),
        Number("magnets"),
    )
}
"""Their words, symbols and units for a reader, in the order from x to y."""


def axis_number(name: str) -> Number:
    """Return the words, the symbol and the unit of an axis for a reader."""
    return AXIS_NUMBERS.get(name, Number(name))


def ranked_axes(names: Sequence[str]) -> list[str]:
    """Return axes in the order from x to y: the drag lies along x, as in the figures of a run.

    Examples
    --------
    >>> ranked_axes(["latching", "force_std", "drag_coefficient"])
    ['drag_coefficient', 'force_std', 'latching']
    """
    order = [*AXIS_NUMBERS]
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


_DIMENSIONS: Final = "\n".join(f"{one.name}: settings, where it varies" for one in AXES)

SENSITIVITY: Final = kind(
    f"""
kind: sensitivity
version: 1
dimensions:
    {_DIMENSIONS}
    class: outcome classes
    time: from the start of the runs to their end
    class_over_time: classes with the largest share at some time, and the rest
variables:
    count(... class) [1] int: runs of this class
    proportion(... class) [1]: share of runs
    runs(...) [1] int: runs with an outcome
    left_out(...) [1] int: runs without an outcome
    complete(...) [1]: share of runs with one assembly
    first_contact_median(...) [s]: median of first contact; NaN when not reached
    completion_median(...) [s]: median of completion; NaN when not reached
    l1_distance(...) [1]: l1 distance to the reference
    l1_in_floors(...) [1]: l1 distance divided by that of chance alone
    trial(...) [1] int: address of the random numbers; pass it to `assemble` to simulate the \
        setting again
    reference(class) [1]: share in the reference
    class(class) text: outcome class
    count_over_time(... time class_over_time) [1] int: runs of this class at this time
    time(time) [s]: time from the start of the run
    class_over_time(class_over_time) text: outcome class
variables (the reference was given with times):
    reference_over_time(time class_over_time) [1]: share in the reference at this time
attributes:
    noise_floor_mean number: distance that the reference itself would have
    noise_floor_95 number: its 95 % quantile
    study
    reference_runs number: runs of the reference
attributes (the reference says so):
    reference_blocks number: blocks of the reference
    reference_latching text: latching of the reference
    reference_hidden_face_drag text: hidden faces of the reference
    reference_<drag_coefficient|force_std_N|tank_diameter_m> number: where the reference lies
    reference_realisations number: realisations of the reference
    reference_mean_pairwise_l1 number: mean l1 distance of two of them
    reference_expected_pairwise_l1 number: what chance alone gives
attributes (the reference has typed faces):
    reference_faces text: kinds of blocks, and which types of their faces latch
""",
    *AXES,
    *limited(SETTINGS, "it does not vary", without="trial study"),
    *SOURCE_WARNINGS,
)

COMPONENTS: Final = kind(
    f"""
kind: components
version: 1
dimensions:
    {_DIMENSIONS}
    class: outcome classes
    component [1] int: principal components, counted from 1
variables:
    score(... component) [1]: score of the setting
    loading(class component) [1]: loading of the class
    explained_variance_ratio(component) [1]: share of the variance over settings
    complete_correlation(component) [1]: correlation of the score with the share of complete runs
    mean(class) [1]: mean share over settings
    class(class) text: outcome class
attributes:
    settings number: settings that were decomposed
    left_out number: settings that were left out
    total_variance number: over the settings, of all classes
    noise_share number: share of it that is sampling noise
""",
    *AXES,
    *(replace(one, when="decomposed from a map that says so") for one in SENSITIVITY.attributes),
)

SOBOL_DESIGN: Final = kind("""
kind: sobol_design
version: 1
dimensions:
    setting: settings, in an order that matters
    input text: inputs, by name
variables:
    value(setting input): value of the input
    <low|high>(input): <lowest|highest> value
attributes:
    samples number: samples of the design, a power of two
    seed number: seed of the scrambling
""")


SOBOL_INDICES: Final = kind(
    """
kind: sobol_indices
version: 1
dimensions:
    output: outputs, by name; or whatever the given outputs lie along, as they name it
    input text: inputs, by name
    setting: settings of the design
variables:
    variance(...): variance over the design; squared output
    noise_share(...) [1]: share of the variance that is sampling noise
    <first|total>_order(... input) [1]: <first|total> order Sobol' index
    <first|total>_order_half_width(... input) [1]: half width of its confidence interval
    <first|total>_order_corrected(... input) [1]: <first|total> order Sobol' index without \
        sampling noise
variables (made by sensitivity_indices):
    proportion(setting output) [1]: share of runs
    value(setting input): value of the input
    <low|high>(input): <lowest|highest> value
attributes:
    samples number: samples of the design
    confidence number: of the half widths
    seed number: seed of the bootstrap
    pure_noise_<first_order_half_width|total_order> number: what pure noise would have
attributes (made by sensitivity_indices):
    runs number: runs of each setting
    left_out number: runs without an outcome
    blocks number: blocks in the tank
    input_units text: units of the inputs, in their order
    study
""",
)

YIELD: Final = kind(
    """
kind: yield
version: 1
dimensions:
    setting: settings that were compared, in the order in which they were begun
    time: from the start of the runs to their end
variables:
    runs(setting) [1] int: runs that chose
    reached(setting) [1] int: those of them that had the target by the time
    rounds(setting) [1] int: rounds of halving that it stayed in; 0 of a setting of the local search
    difference(setting) [1]: yield of the best less that of the setting, over the runs they share
    difference_low(setting) [1]: lower limit of the difference, at all looks and settings at once
    difference_high(setting) [1]: upper limit of the difference
    standing(setting) text: best, alike (cannot be distinguished from it) or worse
    fresh_runs(setting) [1] int: fresh runs, which chose nothing
    fresh_yield(setting) [1]: share of them with the target by the time; NaN where there are none
    fresh_yield_low(setting) [1]: lower limit of the yield; exact, of a binomial count
    fresh_yield_high(setting) [1]: upper limit of the yield; exact, of a binomial count
    share(setting time) [1]: share with the target; of the fresh runs where there are some
    front_setting(time) [1] int: setting that the first runs choose for the time
    front_yield(time) [1]: its share of the fresh runs
    front_yield_<low|high>(time) [1]: <lower|upper> limit of it; exact
    time(time) [s]: time from the start of the run
attributes:
    target text: outcome class to be reached
    by_s number: time by which it is reached
    best number: index of the chosen setting
    within number: no setting is better by more than this, with the confidence
    indifference number: difference of yields that does not matter
    confidence number: of the choice and of the intervals
    searched text: axes with a range, which were searched
    selection_runs number: runs of halving
    chosen_runs number: runs that chose, of all settings
    reported_runs number: fresh runs, of all settings
    left_out number: runs that broke down, which count as without the target
    duration_s number: length of a run
    <seed|study>
attributes (their number does not vary):
    blocks number: blocks in the tank
""",
    *(replace(one, dims="setting", when="it varies") for one in AXES),
    *SOURCE_WARNINGS,
)
