"""The dataset of a likelihood fit, and what its answer calls its numbers."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import Number, kind
from driftwalk.schema.kinds.flow import ORIGIN

_ON: Final = "[flow] y x"

FIT: Final = kind(
    f"""
kind: fit
version: 3
dimensions:
    flow: flows, by name, with switching times
    <y|x> [m]: nodes of the flow
    component text: u, v
    knot_<y|x>: knots of the spline
    parameter text: fitted parameters, by name
    bound: lower, upper
    <warning|verdict_reason>: sentences
    criterion: criteria of the check, by name
    residual_component: errors in x, in y, and in the angle where it is in the state
    cell_<y|x>: centres of the cells of the check
    log_parameter: logarithms of the fitted parameters
    other_log_parameter: the same
    axis text: x, y
    switch: switching times
    profile: values of C_d, by their value
    flow_interval: between the switching times
    compared_law: force laws that were compared, by name
    flow_mode: modes of the flow in time
    mode_time: times in a period of the modes, or of the measured frames
    strength_time: frames of the strength of the flow
    number text: numbers of departures from the model, by name
    law: force laws that were fitted, by name
    departure: numbers of departures that were tested, by name
    measured_<y|x>: nodes of a measured flow
    body_distance: ranges of the distance of two bodies
    stirring_quantile: equal shares of a posterior
variables:
    estimate(parameter): estimates of the parameters; drag_coefficient C_d, force_std σ_F, \
        force_noise_intensity σ_F² times the force interval, tracking_noise; with the angle in the \
        state also force_lever and orientation_noise; where they were estimated or stated, the \
        numbers of the force law and of the camera; in the units of the coordinate unit
    interval(parameter bound): intervals of the parameters; at the confidence; infinite where the \
        recording leaves an end open
    warning(warning) text: evidence against the fit
    converged bool: whether the search came to its end
    restricted bool: whether the restricted likelihood has a minimum
    confidence [1]: confidence of the intervals
    force_interval [s]: time after which a force is redrawn; σ_F depends on it
    maximum_likelihood_drag_coefficient [1]: C_d of the plain likelihood
    drag_coefficient_relative_std [1]: standard deviation of ln C_d
    needed_duration [s]: length of a recording like this for that precision; for 0.1 if none is \
        asked for
    wetted_depth [m]: depth of the block in the water
    wall_share [1]: share of the intervals at the wall, left out
    visited_share [1]: share of the tank's nodes that the block has been over; the smallest of all \
        flows
    samples [1] int: samples of the recordings
    samples_used [1] int: samples that were near enough to their prediction
    outliers [1] int: samples left out as outliers of the track
    jumps_removed [1] int: samples left out when the recordings were read, as too far away for the \
        greatest speed
    dropped_frames [1] int: frames that the recording lacks although its stamps do not say so; \
        their time is put in
    intervals_usable [1] int: intervals that might have been used
    duration [s]: length of the recordings together
    recordings [1] int: recordings
    chi_squared_per_dof [1]: mean square of the whitened innovations; 1 if the model is right
    autocorrelation [1]: correlation of whitened innovations one sample apart; 0 if the model is \
        right
    autocorrelation_std [1]: its standard deviation if the model is right
    iterations [1] int: steps of the search
    <roughness|size>_weight [1]: weight of the flow's <roughness|size>
    law_log_evidence(law) [1]: logarithm of the evidence for each law; without its constant, in \
        the beginning of the recordings
    filter_drag_coefficient [1]: C_d of the filter, without added mass
    number_value(number): numbers of departures from the model; as the filter takes them, in SI \
        units
    number_opened(number) bool: whether the number was estimated
    law(law) text: force law
    unit(parameter) text: unit of the parameter
    bound(bound) text: end of an interval
    <u|v>({_ON}) [m s-1]: flow velocity <x|y>
    u_standard_error({_ON}) [m s-1]: standard error of flow velocity x; at every node, filled ones \
        too
    v_standard_error({_ON}) [m s-1]: standard error of flow velocity y
    count({_ON}) [1]: samples with the block over the node
    flag({_ON}) flags: origin of the node's value
    coefficient([flow] component knot_y knot_x) [m s-1]: coefficients of the bicubic splines
    covariance(log_parameter other_log_parameter) [1]: covariance of the logarithms of the \
        parameters
    profile_deviance(profile) [1]: deviance along C_d
    profile_half_log_determinant(profile) [1]: half the logarithm of the determinant along C_d
    spline_origin(axis) [m]: first knot of the splines
    <spline_spacing|cell_size> [m]: distance between <knots|nodes>
    log_parameter(log_parameter) text: logarithm of a parameter
    other_log_parameter(other_log_parameter) text: logarithm of a parameter
    profile(profile) [1]: C_d
variables (the model was checked):
    verdict text: whether the model explains the recordings; "explains", "does not explain" or \
        "cannot tell"
    verdict_reason(verdict_reason) text: reason for the verdict
    p_value(criterion) [1]: p value of the criterion
    residual(residual_component cell_y cell_x) [1]: mean error in its sd; by cell
    residual_count(cell_y cell_x) [1]: samples
    residual_distance(cell_y cell_x) [1]: distance of the mean error from zero, in its sd after \
        fitting; the largest exceeds its attribute limit once in twenty
    noise_ratio(cell_y cell_x) [1]: mean square against that of all
    noise_ratio_std(cell_y cell_x) [1]: its standard deviation
    residual_cell_size [m]: size of a cell of the check
    criterion text
    residual_component(residual_component) text: component
    cell_<x|y>(cell_<x|y>) [m]: <x|y>
variables (a measured flow was given):
    measured_u(measured_y measured_x) [m s-1]: measured velocity x; NaN where nothing was measured
    measured_v(measured_y measured_x) [m s-1]: measured velocity y
    measured_u_error(measured_y measured_x) [m s-1]: its standard deviation, as the fit takes it
    measured_v_error(measured_y measured_x) [m s-1]: the same of y
    measured_flow_chi_squared [1]: squared difference of the measured flow from the fitted one, \
        over its variance
    measured_flow_expected [1]: its expected value where they agree to 2 %
    measured_flow_expected_std [1]: its standard deviation
    measured_flow_p_value [1]: chance of such a difference
    measured_flow_detectable [m s-1]: random difference of the flows that is found nine times in ten
    measured_flow_determined [1]: coefficients of the flow that it determines
    measured_flow_farthest(axis) [m]: where they differ most
    measured_flow_difference [m s-1]: by how much, there
    measured_<x|y>(measured_<x|y>) [m]: <x|y>
variables (a measured flow was given that changes in time):
    measured_u_mode(flow_mode measured_y measured_x) [m s-1]: measured velocity x of the modes; \
        NaN where nothing was measured
    measured_v_mode(flow_mode measured_y measured_x) [m s-1]: measured velocity y of the modes
    measured_u_mode_error(flow_mode measured_y measured_x) [m s-1]: its standard deviation, as the \
        fit takes it
    measured_v_mode_error(flow_mode measured_y measured_x) [m s-1]: the same of y
variables (a measured flow was given, and its scale is not exact):
    measured_flow_scale_std [1]: standard deviation of its scale
    measured_flow_scale_p_value [1]: chance of a scale so far from 1
    measured_flow_scale_detectable [1]: relative change of the scale that is found nine times in ten
variables (glued blocks, after a fit of one block; or free bodies in one recording):
    stirring_misfit_std [1]: by how much force and torque of a glued body disagree on the \
        correlation, or how far the correlation of the forces on free bodies is from its kernel at \
        one of the distances, in standard deviations
    stirring_length_quantile(stirring_quantile) [m]: length of the stirring at the middles of \
        equal shares of its posterior
variables (free bodies in one recording):
    force_correlation(body_distance) [1]: correlation of the stochastic forces on two bodies
    force_correlation_interval(body_distance bound) [1]: its interval
    body_distance(body_distance) [m]: mean distance of the bodies
variables (with orientations, in one flow):
    spin_correlation [1]: correlation of the block's spin with the vorticity of a first estimate \
        of the flow
variables (a precision of C_d is asked for):
    drag_coefficient_precision [1]: precision of C_d that is asked for
variables (the angle is in the state, and the second fit has a solution):
    drag_coefficient_angle_given [1]: C_d with the angle as an input
    drag_coefficient_angle_given_interval(bound) [1]: its interval
variables (the angle is in the state):
    angle_disagreement_std [1]: difference of the two ln C_d in combined standard deviations; NaN \
        where the second fit has no solution
variables (two laws were fitted):
    law_settled_by [1]: difference of the logarithms of the evidence for the law and for the other \
        one; below 3 the recording cannot tell them apart
variables (one flow is fitted, and the recording is long enough to see its shape change):
    flow_shape_p_value [1]: chance that the errors of a steady flow go to and fro so much in the \
        cells of the tank together; below 1e-6 the shape of the flow changes
    flow_shape_frequency [Hz]: at which the strength of the flow does most; NaN where it does not
    flow_shape_detectable [1]: change, over the strength of the flow, that this test finds nine \
        times in ten; NaN where it is not known
variables (modes of the flow in time were fitted):
    mode_coefficient(flow_mode component knot_y knot_x) [m s-1]: coefficients of the modes; for \
        amplitudes of unit rms
    <u|v>_mode(flow_mode y x) [m s-1]: velocity <x|y> of the modes
    mode_amplitude(flow_mode mode_time) [1]: amplitudes of the modes, of unit rms; over one \
        period, or in the measured frames
    mode_time(mode_time) [s]: from the first sample on
    mode_share(flow_mode) [1]: speed of the mode over that of the mean flow, both as rms where the \
        block has been
    mode_weight [1]: factor of the two weights for the modes
variables (the strength of the flow changes, or has pulses):
    flow_strength(strength_time) [1]: strength of the flow over its mean; linear between frames
    strength_time(strength_time) [s]: time of a frame; from the first sample of the first \
        recording on
variables (numbers of departures were tested):
    departure_estimate(departure): estimates of closed numbers by score tests at the end of the \
        search; in SI units; the model is 0
    departure_std(departure): their standard deviations
    departure(departure) text: number that was tested
variables (no added mass was stated, and the paper's law was found):
    drag_coefficient_any_added_mass_interval(bound) [1]: interval of C_d if the block may carry \
        the usual added mass
    force_std_any_added_mass_interval(bound) [N]: the same of σ_F
variables (laws were compared):
    compared_log_evidence(compared_law) [1]: logarithm of the evidence in the first 70 % of the \
        recordings
    compared_log_score(compared_law) [1]: mean logarithm of the predicted density of a held out \
        sample; in SI units; NaN where the law has no solution
    compared_log_score_std(compared_law) [1]: standard error of its difference from the best law's
    compared_filter_drag_coefficient(compared_law) [1]: C_d of the filter under the law, without \
        added mass
    compared_law(compared_law) text: force law
variables (contacts with the wall were looked for):
    wall_contacts [1] int: passages of the block along the wall
variables (the wall was estimated, from eight passages or more):
    wall_restitution [1]: restitution of the wall
    wall_restitution_interval(bound) [1]: its interval
    wall_friction [1]: friction of the wall
    wall_friction_interval(bound) [1]: its interval; infinite where every contact may stick
variables (a recording has almost no camera noise):
    added_position_noise [m]: white noise that was added to its positions; the largest of all \
        recordings
    added_orientation_noise [rad]: the same of its orientations
variables (with switching times):
    flow text
    interval_flow(flow_interval) [1] int: number of the flow in each interval between the \
        switching times
    flow_force_std(flow) [N]: σ_F in the flow, where flows were named; the parameter force_std is \
        that of the first
    flow_force_std_<low|high>(flow) [N]: <lower|upper> end of its interval
    switching_time(switch) [s]: when the flow changes; on the clock of the recordings
    recording_start [s]: first sample of the first recording
attributes:
    angle text: how the orientation was used: "state", "given" or "none"
    force_law text: force law, found or stated: "paper" or "floating body"
    force_law_stated text: "yes" where the fit tried no other, else "no"
    drag_law text: how the drag goes with the speed: "quadratic", "linear", "mixed" of both, or \
        "power"
    drag_law_stated text: "yes" where the fit tried no other, else "no"
    <simulated_recording|arena|source|study>
attributes (a measured flow was given):
    measured_flow text: its source
    measured_flow_errors text: where its errors are from
attributes (a measured flow was given that changes in time):
    mode_repeat text: how it goes on beyond its frames: none, loop, mirror or hold
attributes (the shape of the flow changes):
    flow_shape_change text: how, in a sentence
attributes (the strength of the flow changes, or has pulses):
    flow_strength_repeat text: how it goes on after its last frame: "loop" or "hold"
attributes (the strength changes too fast to be given in frames):
    flow_strength_left_out text: why the flow is given without it
attributes (modes of the flow in time were asked for, and not found):
    flow_modes_unsettled text: why
attributes (the stretches between gaps, or between contacts, are short):
    stretches_unsettled text: how short, and what to do
attributes (the law is not settled):
    law_unsettled text: reasons why a number of the law was not opened, or why the intervals hold \
        those of another law, too
attributes (the model was not checked):
    check_left_out text: reason why the model was not checked
attributes (the wall was to be estimated, and was not):
    wall_left_out text: reason why the wall was not estimated
""",
    flags={"flag": ORIGIN},
)

_CORRECTED: Final = "corrected"
BLOCK_NUMBERS: Final = (
    Number("drag_coefficient", "1", "drag coefficient", "C_d"),
    Number("force_std", "N", "stochastic force", "σ_F"),
    Number("force_noise_intensity", "N2 s", "noise intensity", "σ_F²·τ", "N² s"),
    Number("tracking_noise", "m"),
    Number("force_lever", "m"),
    Number("orientation_noise", "rad", shown="°"),
)
"""Numbers of every fit; lever and noise of the orientation with the angle in the state."""
LAW_NUMBERS: Final = (
    Number("added_mass_share", label="added mass / mass",
           note="stated or assumed: no recording tells it"),
    Number("effective_drag_coefficient", label="C_d per effective mass",
           note="C_d over 1 + added mass / mass"),
    Number("effective_force_std", "N", "σ_F per effective mass", shown="mN",
           note="σ_F over 1 + added mass / mass"),
    Number("linear_drag", "kg s-1", shown="g/s", note="C_d is of the quadratic part alone"),
    Number("drag_power", label="power of the drag", note="C_d holds at 3 cm/s"),
    Number("force_memory", "s", "memory of the force", shown="s",
           note="correlation time; σ_F is of a white force that is as strong at low frequencies"),
    Number("time_stamp_noise", "s", "jitter of the stamps", shown="ms",
           note="standard deviation of the time stamps; corrected"),
    Number("orientation_offset", "rad", shown="°", note="between marker and faces; corrected"),
    Number("marker_x", "m", "marker off by, x", shown="mm", note=_CORRECTED),
    Number("marker_y", "m", "marker off by, y", shown="mm", note=_CORRECTED),
    Number("flow_strength_change", "1", "change of the flow", shown="%",
           note="from the beginning to the end; corrected"),
    Number("pulse_amplitude", "1", "pulses of the flow", shown="%", note="amplitude; corrected"),
    Number("pulse_frequency", "Hz", "frequency of pulses", shown="Hz", note=_CORRECTED),
    Number("mode_frequency", "Hz", "frequency of the modes", shown="Hz",
           note="of the flow, whose shape changes; corrected"),
    # Of 48 pairs in studies/bodies, the one share that was more than 0.1 off had an interval 0.43
    # wide, the others of up to 0.31.
    Number("hidden_face_drag_share", label="drag of hidden faces",
           note="over that of a free face", widest=1 / 3),
    Number("stirring_correlation", label="shared stirring",
           note="correlation of the forces on two blocks side by side"),
    Number("stirring_length", "m", "length of the stirring", shown="mm"),
    Number("measured_flow_scale", label="scale of the measured flow",
           note="over that of the fitted one"),
)  # fmt: skip
"""Numbers of a fit where the recording asks for it, or the user states it."""
WALL_NUMBERS: Final = (
    Number("wall_restitution", note="1: the wall takes no energy"),
    Number("wall_friction", note="0: the wall is smooth"),
)
PARAMETERS: Final = {one.name: one for one in (*BLOCK_NUMBERS, *LAW_NUMBERS)}
"""In the order in which a fit holds them."""
