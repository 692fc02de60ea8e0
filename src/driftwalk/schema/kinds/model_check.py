"""The dataset that says whether a fitted model explains its recordings."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import Variable, kind, variables

_COMPARED: Final = "the motion could be compared"
_CRITERIA: Final = "../explanation/likelihood.md#does-the-model-explain-the-recording"


def _density(name: str, unit: str, words: str) -> tuple[Variable, ...]:
    on, per = f"{name}_bin", f"{unit}-1"
    return variables(f"""
variables ({_COMPARED}):
    {name}_density_recording({on}) [{per}]: density of {words}, recording
    {name}_density_median({on}) [{per}]: density of {words}, median of the replicates; with drawn \
        parameters
    {name}_density_low({on}) [{per}]: density of {words}, lower end of the band; 90 %
    {name}_density_high({on}) [{per}]: density of {words}, upper end of the band
    {name}_edge({name}_edge) [{unit}]: edges of the bins of {words}
""")


MODEL_CHECK: Final = kind(
    f"""
kind: model_check
version: 3
dimensions:
    <verdict_reason|note>: sentences
    criterion text: criteria, by name
    component text: errors in x, in y, and in the angle where it is in the state
    lag: samples
    <y|x> [m]: centres of cells
    part: tenths of the recordings
    speed_range: ranges of the speed
    replicate: simulations at the estimate
    pair: pairs of them
    drawn_replicate: simulations with drawn parameters
    <step_length|turning_angle>_bin: bins
    <step_length|turning_angle>_edge: edges of the bins
variables:
    verdict text: whether the model explains the recordings; "explains", "does not explain" or \
        "cannot tell"
    verdict_reason(verdict_reason) text: reason for the verdict
    p_value(criterion) [1]: p value of the criterion; [the criteria]({_CRITERIA})
    failed(criterion) int: 1 where the criterion failed
    detectable(criterion) [1]: size of misfit that the criterion would find nine times in ten
    detectable_of(criterion) text: misfit that is meant, with its unit
    autocorrelation(component lag) [1]: autocorrelation of the errors
    autocorrelation_expected(component lag) [1]: value after fitting if the model is right
    autocorrelation_std(component lag) [1]: its standard deviation
    chi_squared_per_dof(component) [1]: mean square of the errors
    chi_squared_expected(component) [1]: mean square that fitting leaves
    excess_kurtosis(component) [1]: excess kurtosis of the errors
    tail_share(component) [1]: share beyond 3 sd
    residual(component y x) [1]: mean error in its sd; by cell
    residual_count(y x) [1]: samples
    residual_distance(y x) [1]: distance of the mean error from zero, in its sd after fitting; the \
        largest exceeds its attribute limit once in twenty
    noise_ratio(y x) [1]: mean square against that of all
    noise_ratio_std(y x) [1]: its standard deviation
    part_residual(part component) [1]: mean error in its sd
    part_count(part) [1]: samples
    part_chi_squared(part) [1]: squared distances of the cells' mean errors, summed up
    part_dof(part) [1] int: their degrees of freedom
    part_noise_ratio(part) [1]: mean square against that of all
    part_noise_ratio_std(part) [1]: its standard deviation
    flow_change(part) [1]: relative change of the flow's strength; NaN where the fit has absorbed \
        most of it
    flow_change_std(part) [1]: its standard deviation
    drag_change(speed_range) [1]: relative change of C_d
    drag_change_std(speed_range) [1]: its standard deviation
    lag(lag) [1] int: samples
    part_recording(part) int: recording of the part
    part_start(part) [s]: start of the part; from that of the recording
    part_end(part) [s]: end of the part
    speed_<low|high>(speed_range) [m s-1]: <lower|upper> end of the range
variables (a misfit is sure, but too small to change the verdict):
    note(note) text: the misfit, in a sentence
variables ({_COMPARED}):
    ks_to_estimate(replicate) [1]: KS distance of the recording to replicates at the estimate
    ks_floor(pair) [1]: KS distance of two replicates
    ks_to_drawn(drawn_replicate) [1]: KS distance of the recording to replicates with drawn \
        parameters
    ks_between_drawn(drawn_replicate) [1]: mean KS distance of a replicate with drawn parameters \
        to the others
attributes:
    level number: below which a p value is a finding
    effective_parameters number: parameters that the fit took out
    samples number: samples of the recordings
    samples_used number: samples that the fit used
    outliers number: of them outliers
    portmanteau number: statistic of the autocorrelation
    portmanteau_dof number: its degrees of freedom
    cell_size_m number: size of a cell
    replicates number: simulated recordings of either set
    seed number: their seed
    <ks_distance|ks_noise_floor> number: median of <ks_to_estimate|ks_floor>, NaN without it
    <arena|source|simulated_recording>
attributes ({_COMPARED}):
    ks_distance_interval numbers: [low, high] of the replicates
    ks_noise_floor_upper number: its 95 % quantile
    ks_p_value number: p value of the distance
    ks_rank_p_value number: p value by rank
    band number: share of the replicates in a band
attributes (the comparison was left out):
    ks_left_out text: reason why there is no distance
""",
    *_density("step_length", "m", "step lengths"),
    *_density("turning_angle", "rad", "turning angles"),
)
