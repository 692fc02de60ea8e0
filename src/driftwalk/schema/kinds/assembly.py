"""Datasets of runs of many blocks: the runs, their paths, attraction, classified recordings."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import SOURCE_WARNINGS, attributes, kind, variables
from driftwalk.schema.kinds.flow import FLOW_SERIES, began_in_flow
from driftwalk.schema.kinds.motion import WORLD_STATUS

SETTINGS: Final = (
    *attributes("""
    blocks number: blocks in the tank
    runs number: simulated worlds
    duration_s number: length of a run at most
    seed
    trial number: address of the random numbers
    chirality text: whether mirror images are one class
    latching text: when two blocks latch
    hidden_face_drag text: drag on joined faces
    block_<restitution|friction> number: of collisions
    block_side_m number: side of a block, diameter of a disc, length of a rectangle
    arena
    force_interval_s number: how long a force lasts
    time_step_s number: step of the integrator
    backend text: what computed it
    study
attributes (blocks that are no squares):
    block_shape text: their shape
    block_width_m number: width of a rectangle
attributes (bonds break):
    bond_rate_per_s number: rate at which a bond breaks without load
    bond_force_N number: tension that multiplies the rate by e; 0: the rate is constant
    bond_strength_N number: tension that breaks a bond at once; 0: none
    relatch_clearance number: distance of centres in sides from which parted blocks latch again
attributes (blocks start glued to bodies):
    glued text: rows of the blocks of a body; its joinings are those at time 0
attributes (faces have types):
    faces text: kinds of blocks, and which types of their faces latch
attributes (latching by a connector):
    connector_<distance_m|axis_rad|rotation_rad> number: tolerance of the connector
"""),
    *FLOW_SERIES,
)
CLASS: Final = (
    "class(class) text: outcome class; [names](../explanation/assembly.md#outcome-classes)"
)
"""Variable of the kinds with one number for each outcome class."""
_ORDER: Final = "first of the assembly that stayed, then of the one that was moved"
_FACES: Final = "faces that joined, in the blocks' own frames: 0 +x, 1 +y, 2 -x, 3 -y"
_POLES: Final = """
variables (faces are magnets, and stay so):
    pole(block face) [1] int: pole of the magnet at each face +x, +y, -x, -y of the block: 1 N, \
        -1 S, 0 none
"""
_LOWEST: Final = "assembly of the block, as its lowest block"
_NOWHERE: Final = "-1 where there is none"

ASSEMBLY: Final = kind(
    f"""
kind: assembly
version: 1
dimensions:
    run int: simulated worlds
    event: joinings in a run, in order; one less than there are blocks, at least one; where bonds \
        break, joinings, partings and bonds of loops
    side: of the assembly that stayed, of the one that was moved
    part: stayed, moved, became
    block int: blocks
    axis: x, y
    face: faces of a block, where they are magnets
    class: every class up to 8 squares; beyond that, and of discs, those that occurred
    shape: polyominoes; contact graphs of discs
variables:
    outcome(run) int: outcome class at the end, -1 for none: index into 'class'
    event_count(run) [1] int: number of joinings
    event_time(run event) [s]: time of the joining; end of the step; NaN where there is none
    event_block(run event side) int: blocks whose faces joined, {_ORDER}; {_NOWHERE}
    event_assembly(run event side) int: lowest block of the assemblies that joined, {_ORDER}; \
        {_NOWHERE}
    event_shape(run event part) int: shapes of the assembly that stayed, of the one moved, of both \
        joined: index into 'shape'; {_NOWHERE}
    event_class(run event) int: outcome class of the whole world after the joining: index into \
        'class'; {_NOWHERE}
    first_contact_time(run) [s]: time of the first contact of blocks; NaN where it did not happen
    completion_time(run) [s]: time at which all blocks had become one assembly; NaN where it did \
        not happen
    end_time(run) [s]: time at which the run stopped
    <x|y>(run block) [m]: position <x|y> of the block's centre; at the end
    theta(run block) [rad]: orientation of the block, counter-clockwise from x; at the end
    assembly(run block) int: {_LOWEST}
    drag_coefficient(run) [1]: drag coefficient
    force_std(run) [N]: standard deviation of the force
    status(run) bits: problems in a run; 0 is sound
    {CLASS}
    shape(shape) text: shape of an assembly
variables (blocks that are squares):
    event_face(run event side) int: {_FACES}; {_NOWHERE}
    cell(run block axis) int: cell of the block on its assembly's lattice, x and y
    quarter(run block) int: quarter turns of the block against its assembly
variables (bonds break):
    event_kind(run event) int: what an event is, of which not all are joinings: 0 joining, 1 \
        parting (first the part with more blocks; the third shape is what they were), 2 a bond of \
        a loop broke, 3 one formed; {_NOWHERE}
variables (drawn from a fit whose force law has it):
    linear_drag(run) [kg s-1]: linear drag of the block
    drag_power(run) [1]: power of the speed in the drag
    force_memory(run) [s]: correlation time of the force
variables (drawn from a fit of glued blocks):
    hidden_face_drag_share(run) [1]: drag of a hidden face over that of a free one
    stirring_length(run) [m]: distance over which blocks share the stochastic force
variables (flow fields were drawn):
    flow_draw(run) int: which drawn flow field the run had
variables (blocks are of several kinds):
    kind(run block) int: kind of the block at the end, by its place in the table of kinds
{_POLES}attributes (made by a run):
    drawn text: what was drawn for each run, or "no"
""",
    began_in_flow("run"),
    *SETTINGS,
    *SOURCE_WARNINGS,
    flags={"status": WORLD_STATUS},
)

_PATH: Final = "run time block"

ASSEMBLY_PATH: Final = kind(
    f"""
kind: assembly_path
version: 1
read: x y theta run time block
read_attributes: block_side_m
dimensions:
    run int: chosen runs
    time: samples
    block int: blocks
    face: faces of a block, where they are magnets
variables:
    <x|y>({_PATH}) [m]: position <x|y> of the block's centre
    theta({_PATH}) [rad]: orientation of the block, counter-clockwise from x
    assembly({_PATH}) int: {_LOWEST}
    time(time) [s]: time from the start of the run
{_POLES}attributes:
    sample_interval_s number: time between samples
""",
    *SETTINGS,
)

ATTRACTION: Final = kind(
    """
kind: attraction
version: 1
dimensions:
    gap: gaps between two blocks, face to face
variables:
    force(gap) [N]: attraction of the two blocks
    simulated_force(gap) [N]: the same where the time step caps it
    energy(gap) [J]: energy, 0 at the largest gap
    gap(gap) [m]: gap between the faces
attributes:
    between text: what acts between the blocks
    force_at_contact_N number: where the faces touch
    force_at_10mm_N number: at a gap of 10 mm
    binding_energy_J number: work that parts two blocks
    most_simulated_N number: largest force in the simulation
    capped_below_m number: gap below which the simulated force is smaller; 0 where it is not
    study
"""
)


RATES: Final = variables("""
    <joining|parting>_count(class) [1] int: <joinings|partings> while the world was of this class
    <joining|parting>_rate(class) [s-1]: <joinings|partings> over the time in this class; NaN \
        where there is no time
    joining_rate_<low|high>(class) [s-1]: <lower|upper> limit of the rate of joining, Poisson, \
        widened as far as they cluster
    parting_rate_<low|high>(class) [s-1]: <lower|upper> limit of the rate of parting, exact Poisson
""")
"""Rates of joining and parting per class."""

CLASSIFICATION: Final = kind(
    f"""
kind: classification
version: 1
dimensions:
    time [s]: samples of the recording
    body text: bodies, by name
    event: joinings, at least one
    split: partings, at least one
    side: the two blocks
    part: stayed, moved, became
    class: outcome classes
    shape text: polyominoes
variables:
    outcome(time) int: outcome class, -1 unknown; index into 'class'
    assembly(time body) int: lowest body of the assembly, -1 unknown
    proportion(class) [1]: share of the time in which the class is known
    {CLASS}
    event_assembly(event side) int: lowest body of the assemblies that joined; {_NOWHERE}
    event_shape(event part) int: shapes of the two assemblies and of both joined: index into \
        'shape'; {_NOWHERE}
    <event|split>_count [1] int: number of <joinings|partings>
    <event|split>_time(<event|split>) [s]: time of the <joinings|partings>; NaN where there is none
    <event|split>_block(<event|split> side) int: blocks, <joinings|partings>; {_NOWHERE}
    event_face(event side) int: {_FACES}; {_NOWHERE}
    split_face(split side) int: faces that came apart, as those that join; {_NOWHERE}
    <event|split>_class(<event|split>) int: outcome class after the <joinings|partings>: index \
        into 'class'; {_NOWHERE}
variables (made by observe):
    possible(time class) bool: whether the class is possible; none at all: nothing is known
    hidden(time) [1] int: number of blocks that are hidden
attributes:
    blocks number: bodies of the recording
    chirality text: whether mirror images are one class
    block_side_m number: side of a block
    join_distance_m number: how near faces come to be joined
    join_angle_rad number: how parallel faces are when joined
    release_<distance_m|angle_rad> number: how far faces <go|turn> when they part
    min_duration_s number: how long a joining lasts at least
    hold_s number: how long a pose holds without a sample
    play_m number: how far joined faces may move against each other
    dropped_joins number: joinings that contradict others
    left_out_contacts number: contacts at rest that are no joins, as their faces lie otherwise
    closest_m number: smallest distance of two centres
    unknown_samples number: samples of unknown class
    known_s number: time in which the class is known
    rate_confidence number: with which an interval of a rate holds, each on its own
attributes (there was a bond that is in no loop):
    bond_rate_per_s number: partings per bond and second in classes without loops
    bond_rate_low_per_s number: its lower limit, exact Poisson
    bond_rate_high_per_s number: its upper limit
attributes (the recording says so):
    source
attributes (the tank is known):
    arena
""",
    *RATES,
)
