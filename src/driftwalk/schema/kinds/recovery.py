"""The datasets of recovery studies: simulated recordings of known truth, and their estimates."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import Variable, kind, variables
from driftwalk.schema.kinds.fit import PARAMETERS

_EACH: Final = "duration angle recording"
_ALL: Final = "parameter duration angle"
RECOVERED: Final = {
    name: PARAMETERS[name] for name in ("drag_coefficient", "force_std", "tracking_noise")
}
"""The numbers of a fit that a recovery study compares with their truth."""
ESTIMATED, NOT_ESTIMATED, NOT_SIMULATED = range(3)
"""Status of a recording, of both kinds; without an estimate it has a message."""


def _statuses(estimated: str, not_estimated: str) -> dict[str, int]:
    return {estimated: ESTIMATED, not_estimated: NOT_ESTIMATED, "not_simulated": NOT_SIMULATED}


def _estimate(name: str, unit: str, words: str) -> tuple[Variable, ...]:
    return variables(f"""
    {name}({_EACH}) [{unit}]: {words}; NaN without a fit
    {name}_<low|high>({_EACH}) [{unit}]: {words}, <lower|upper> end of the interval
    {name}_sd({_EACH}) [1]: stated standard deviation of ln {words}
    {name}_error({_EACH}) [1]: {words}, estimate / truth - 1
    {name}_z({_EACH}) [1]: {words}, ln(estimate / truth) / sd
    {name}_covered({_EACH}) [1]: {words}, 1 if the interval holds the truth
""")


RECOVERY: Final = kind(
    f"""
kind: recovery
version: 1
dimensions:
    duration: lengths of the recordings
    angle: uses of the orientation
    recording int: simulated recordings
    parameter text: drag_coefficient, force_std, tracking_noise
variables:
    flow_error({_EACH}) [1]: rms error of the flow over its rms speed; averaged over the block, \
        where it has been
    flow_point_error({_EACH}) [1]: rms error of the flow at points
    flow_z_rms({_EACH}) [1]: rms error of the flow in standard errors
    flow_cells({_EACH}) [1]: cells in which the flow is compared
    wall_share({_EACH}) [1]: share of the intervals at the wall
    samples_used({_EACH}) [1]: samples that the fit used
    iterations({_EACH}) [1]: iterations of the fit
    converged({_EACH}) [1]: 1 if the fit converged
    fit_time({_EACH}) [s]: time that the fit took
    status({_EACH}) flags: status of the recording
    message({_EACH}) text: reason why there is no fit
    used({_EACH}) int: enters the summary; 1 where fitted, with at most 30 % of the intervals at \
        the wall
    median_absolute_error({_ALL}) [1]: median of the relative error's size
    absolute_error_90({_ALL}) [1]: 90 % quantile of the relative error's size
    bias({_ALL}) [1]: mean of the relative error
    rms_error({_ALL}) [1]: rms of ln(estimate / truth)
    spread({_ALL}) [1]: standard deviation of ln(estimate) over the recordings
    rms_z({_ALL}) [1]: rms of z; 1 if the stated deviations are right
    coverage({_ALL}) [1]: share of intervals that hold the truth
    coverage_low({_ALL}) [1]: lower end of the coverage's interval
    coverage_high({_ALL}) [1]: upper end of the coverage's interval; Clopper-Pearson, 95 %
    median_flow_error(duration angle) [1]: median of the flow's error
    flow_error_90(duration angle) [1]: 90 % quantile of the flow's error
    drag_coefficient_error_scale(angle) [s0.5]: scale of C_d's error; a of rms error = a / √T
    drag_coefficient_error_scale_<low|high>(angle) [s0.5]: scale of C_d's error, <lower|upper> end \
        (90 %)
    needed_duration(angle) [s]: length that the asked precision needs; (a / precision)²; NaN where \
        none is asked
    needed_duration_<low|high>(angle) [s]: length that the asked precision needs, <lower|upper> \
        end (90 %)
    duration(duration) [s]: length of the recording
    angle(angle) text: use of the orientation
attributes:
    <drag_coefficient|force_std_N|force_interval_s|tracking_noise_m> number: the truth
    flow text: the true flow
    sample_interval_s number: time between samples
    recordings_per_fit number: recordings that are fitted together
    missing_share number: share of the samples that is missing
    seed
    confidence number: of the fits' intervals
    coverage_confidence number: of the coverage's interval
    needed_confidence number: of the needed length's interval
    most_wall_share number: share at the wall with which a fit is used
    drag_coefficient_precision number: that is asked, NaN for none
    study
""",
    *_estimate("drag_coefficient", "1", "drag coefficient"),
    *_estimate("force_std", "N", "standard deviation of the force"),
    *_estimate("tracking_noise", "m", "tracking noise"),
    flags={"status": _statuses("fitted", "not_fitted")},
)

_EACH_MODEL: Final = "recording parameter"
_ENDS: Final = "recording parameter bound"

MODEL_RECOVERY: Final = kind(
    f"""
kind: model_recovery
version: 1
dimensions:
    recording: simulated recordings
    parameter text: open parameters of the model
    bound: lower and upper end
variables:
    truth(parameter): true value of the parameter; in its unit
    estimate({_EACH_MODEL}): estimate of the parameter; NaN without a calibration
    interval({_ENDS}): interval of the parameter; NaN where the calibration gives none
    determined({_EACH_MODEL}) bool: whether the recording determines the parameter; within 15 % of \
        its value, with 90 % confidence
    half_width({_EACH_MODEL}) [1]: half the 90 % interval over the value; of its logarithm on a \
        logarithmic scale; infinite at the end of its range
    error({_EACH_MODEL}) [1]: relative error of the estimate; ln(estimate / truth) on a \
        logarithmic scale; on a linear one over the truth, or over a twentieth of the range where \
        the truth is smaller
    error_interval({_ENDS}) [1]: ends of the interval, as errors; it holds the truth where 0 lies \
        between them
    status(recording) flags: what became of the recording
    message(recording) text: why there is no calibration
    median_error(parameter) [1]: median of the size of the error
    determined_median_error(parameter) [1]: median of the size of the error where the parameter is \
        determined
    determined_share(parameter) [1]: share of the calibrations that determine the parameter
    coverage(parameter) [1]: share of the intervals that hold the truth
    coverage_standard_error(parameter) [1]: standard error of the coverage; binomial, of intervals \
        that hold the truth as often as their confidence says
    range({_ENDS}): range of the search; NaN without a calibration
    unit(parameter) text: unit of the parameter
    scale(parameter) text: scale of the parameter: linear or log
    meaning(parameter) text: what the parameter is
    recording(recording) int: number of the recording
    bound(bound) text: end of an interval
attributes:
    model text: name of the model
    fixed object: known values of the model's other numbers, SI units
    duration_s number: length of each recording
    sample_rate_Hz number: samples of each recording per second
    missing_share number: share of the samples that is missing
    seed
    position_noise_m number: true noise of the recorded positions
    noise text: whether the calibrations estimated it: estimated, or known
    confidence number: of the intervals
    <arena|source|study>
""",
    flags={"status": _statuses("calibrated", "not_calibrated")},
)
