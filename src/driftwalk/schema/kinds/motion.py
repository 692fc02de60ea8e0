"""Datasets of recorded and simulated motion, of its steps, and of the distance between motions."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import kind
from driftwalk.schema.kinds.flow import FLOW_SERIES, began_in_flow

WORLD_STATUS: Final = {"non_finite": 1, "escaped": 2, "no_motion": 4}
"""Bits of a simulated world's status; 0 is sound."""


TRAJECTORY: Final = kind("""
kind: trajectory
version: 1
read: x y theta time body
dimensions:
    time: samples, at the union of the bodies' clocks
    body text: bodies, by name
    part: xx, xy, yy, xtheta, ytheta, thetatheta
variables:
    x(time body) [m]: position x; the arena's centre is the origin; NaN is a gap
    y(time body) [m]: position y; y is up
    theta(time body) [rad]: orientation; counter-clockwise, in (-π, π]; NaN where it is unknown
    time(time) [s]: time; increases
variables (tracked videos):
    ambiguous(time body) [1]: score of the best other assignment of identities; above 0 where \
        identities could have been exchanged
    covariance(time body part) [m, m, rad]: covariance of the measurement; in m², m rad and rad²
    part(part) text: part of the covariance
attributes (read from a file):
    source
    format text: format of the file
    sample_rate_Hz number: usual sampling rate
    position_quantum_m number: resolution of the file, 0 where unknown
    y_axis text: which way y ran, and what was done about it
    origin_shift_m list: offset that was subtracted from the positions
    counts object: counts of what cleaning did
attributes (positions in pixels):
    metres_per_pixel number: scale that was given
attributes (the tank is known):
    arena
    arena_found object: how the tank was found
attributes (the block was stated):
    block_shape text: its shape
    block_side_m number: side of the block, diameter of a disc, length of a rectangle
    block_width_m number: width of a rectangle
    block_mass_kg number: mass of the block
    block_depth_m number: wetted depth of a side face
    block_depth text: immersed or archimedes, instead of a length
attributes (several tanks in one recording):
    bodies_apart yes or no: whether each body has its own tank
attributes (simulated):
    simulated yes or no: whether a model made the motion
attributes (simulated by driftwalk):
    force_interval_s number: interval at which the force was redrawn
attributes (tracked videos):
    tracked_from text: the video or camera
    complete yes or no: whether tracking reached the end
    tracking_counts object: frames, dropped, duplicates, stale, what was rejected
attributes (tracking broke off):
    interrupted text: reason why tracking broke off
""")


SIMULATION: Final = kind(
    """
kind: simulation
version: 1
read: x y theta time body
dimensions:
    replicate int: simulated worlds
    time [s]: samples
    body text: the block or body
variables:
    <x|y>(replicate time body) [m]: position <x|y>
    theta(replicate time body) [rad]: orientation; in (-π, π]; NaN where a model has none
    status(replicate) bits: problems in a world; 0 is sound
attributes:
    <arena|seed|study>
attributes (the block):
    drag_coefficient number: drag coefficient C_d
    force_std_N number: standard deviation σ_F of the force
    force_interval_s number: how long a force lasts
    force_noise_intensity_N2_s number: σ_F² times the force interval
    backend text: what computed it
attributes (another motion model):
    model text: name of the motion model
    model_parameters object: value of each parameter, by its name with the unit
attributes (another motion model, and its source is known):
    model_source_sha256 text: hash of the model's source
attributes (the block, or one of the family):
    time_step_s number: step of the integrator
""",
    began_in_flow("replicate"),
    *FLOW_SERIES,
    flags={"status": WORLD_STATUS},
)


STEPS: Final = kind("""
kind: steps
version: 1
read: step_length turning_angle time
dimensions:
    step: pairs of a step and the turn before it
variables:
    step_length(step) [m]: step length; above 0
    turning_angle(step) [rad]: turning angle; in (-π, π]
    time(step) [s]: time; when the step begins
attributes (cut from a recording):
    body text: whose steps
    step_interval_s number: time of a step
    mode text: "exact": samples one interval apart; else "interpolated"
    samples number: samples of the motion
    pairs number: steps
    zero_length number: pairs left out because a step had no length
    gaps number: pairs left out at a gap
    irregular_intervals number: intervals of another length
    warnings
""")


COMPARISON: Final = kind("""
kind: comparison
version: 1
dimensions:
    motion text: a, b
    density_<step_length|turning_angle>: bins
    <step_length|turning_angle>_edge: edges of the bins
variables:
    ks_distance [1]: KS distance
    ks_distance_<a|b> [1]: KS distance, origins in <a|b>
    score [1]: 1 - KS distance
    ks_step_length [m]: step length at which the KS maximum sits
    ks_turning_angle [rad]: turning angle at which the KS maximum sits
    ks_quadrant int: quadrant of the maximum
    tied_fraction [1]: share of points that share a coordinate
    p_value [1]: p value of the permutation test; NaN without it
    noise_floor [1]: median KS distance of the permutations
    block_length [1] int: steps in a block of the permutation test
    autocorrelation_time [1]: autocorrelation time in steps
    pairs(motion) [1] int: steps
    zero_length(motion) [1] int: pairs left out for a step of no length
    gaps(motion) [1] int: pairs left out at a gap
    mode(motion) text: how the steps were cut
    <mean|median>_step_length(motion) [m]: <mean|median> step length
    std_turning_angle(motion) [rad]: standard deviation of the turning angle
    step_density(motion density_step_length density_turning_angle) [1]: fraction of steps
    step_length_edge(step_length_edge) [m]: edges of the step-length bins
    turning_angle_edge(turning_angle_edge) [rad]: edges of the turning-angle bins
attributes:
    step_interval_s number: time of a step
    permutations number: permutations of the test
    seed number: seed of the permutations
    ties text: how points that share a coordinate are counted
    warnings
""")

REPLICATE_COMPARISON: Final = kind("""
kind: replicate_comparison
version: 1
dimensions:
    replicate int: simulations of the recording
variables:
    ks_distance(replicate) [1]: KS distance of a replicate to the recording
    mean_ks_distance [1]: mean KS distance of the replicates to the recording
    noise_floor [1]: mean KS distance of two replicates
    p_value [1]: share of motions as far from the others as the recording
attributes:
    step_interval_s number: time of a step
    ties text: how points that share a coordinate are counted
""")
