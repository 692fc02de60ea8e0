"""The dataset that says whether a fitted model explains its recordings."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SIMULATED, SOURCE, Attribute, Kind, Variable

_COMPARED: Final = "the motion could be compared"
_CRITERIA: Final = "../explanation/likelihood.md#does-the-model-explain-the-recording"


def _density(name: str, unit: str, words: str) -> tuple[Variable, ...]:
    on, per = f"{name}_bin", f"{unit}-1"
    return (
        Variable(
            f"{name}_density_recording", on, per, f"density of {words}, recording", when=_COMPARED
        ),
        Variable(
            f"{name}_density_median", on, per, f"density of {words}, median of the replicates",
            when=_COMPARED, note="with drawn parameters",
        ),
        Variable(
            f"{name}_density_low", on, per, f"density of {words}, lower end of the band",
            when=_COMPARED, note="90 %",
        ),
        Variable(
            f"{name}_density_high", on, per, f"density of {words}, upper end of the band",
            when=_COMPARED,
        ),
        Variable(
            f"{name}_edge", f"{name}_edge", unit, f"edges of the bins of {words}", when=_COMPARED
        ),
    )  # fmt: skip


MODEL_CHECK: Final = Kind(
    name="model_check",
    version=2,
    dimensions={
        "finding": "sentences",
        "criterion": "criteria, by name",
        "component": "errors in x, in y, and in the angle where it is in the state",
        "lag": "samples",
        "y": "centres of cells",
        "x": "centres of cells",
        "part": "tenths of the recordings",
        "speed_range": "ranges of the speed",
        "replicate": "simulations at the estimate",
        "pair": "pairs of them",
        "drawn_replicate": "simulations with drawn parameters",
        "step_length_bin": "bins",
        "turning_angle_bin": "bins",
        "step_length_edge": "edges of the bins",
        "turning_angle_edge": "edges of the bins",
    },
    variables=(
        Variable("explained", "", None, "whether the model explains the recordings", "bool"),
        Variable("finding", "finding", None, "evidence against the model", "text"),
        Variable(
            "p_value", "criterion", "1", "p value of the criterion",
            note=f"[the criteria]({_CRITERIA})",
        ),
        Variable("failed", "criterion", None, "1 where the criterion failed", "int"),
        Variable("autocorrelation", "component lag", "1", "autocorrelation of the errors"),
        Variable(
            "autocorrelation_expected", "component lag", "1",
            "value after fitting if the model is right",
        ),
        Variable("autocorrelation_std", "component lag", "1", "its standard deviation"),
        Variable("chi_squared_per_dof", "component", "1", "mean square of the errors"),
        Variable("chi_squared_expected", "component", "1", "mean square that fitting leaves"),
        Variable("excess_kurtosis", "component", "1", "excess kurtosis of the errors"),
        Variable("tail_share", "component", "1", "share beyond 3 sd"),
        Variable("residual", "component y x", "1", "mean error in its sd", note="by cell"),
        Variable("residual_count", "y x", "1", "samples"),
        Variable(
            "residual_distance", "y x", "1",
            "distance of the mean error from zero, in its sd after fitting",
            note="the largest exceeds its attribute limit once in twenty",
        ),
        Variable("noise_ratio", "y x", "1", "mean square against that of all"),
        Variable("noise_ratio_std", "y x", "1", "its standard deviation"),
        Variable("part_residual", "part component", "1", "mean error in its sd"),
        Variable("part_count", "part", "1", "samples"),
        Variable(
            "part_chi_squared", "part", "1",
            "squared distances of the cells' mean errors, summed up",
        ),
        Variable("part_dof", "part", "1", "their degrees of freedom", "int"),
        Variable("part_noise_ratio", "part", "1", "mean square against that of all"),
        Variable("part_noise_ratio_std", "part", "1", "its standard deviation"),
        Variable(
            "flow_change", "part", "1", "relative change of the flow's strength",
            note="NaN where the fit has absorbed most of it",
        ),
        Variable("flow_change_std", "part", "1", "its standard deviation"),
        Variable("drag_change", "speed_range", "1", "relative change of C_d"),
        Variable("drag_change_std", "speed_range", "1", "its standard deviation"),
        Variable(
            "ks_to_estimate", "replicate", "1",
            "KS distance of the recording to replicates at the estimate", when=_COMPARED,
        ),
        Variable("ks_floor", "pair", "1", "KS distance of two replicates", when=_COMPARED),
        Variable(
            "ks_to_drawn", "drawn_replicate", "1",
            "KS distance of the recording to replicates with drawn parameters", when=_COMPARED,
        ),
        Variable(
            "ks_between_drawn", "drawn_replicate", "1",
            "mean KS distance of a replicate with drawn parameters to the others", when=_COMPARED,
        ),
        *_density("step_length", "m", "step lengths"),
        *_density("turning_angle", "rad", "turning angles"),
        Variable("criterion", "criterion", None, "criterion", "text"),
        Variable("component", "component", None, "component", "text"),
        Variable("lag", "lag", "1", "samples", "int"),
        Variable("x", "x", "m", "x"),
        Variable("y", "y", "m", "y"),
        Variable("part_recording", "part", None, "recording of the part", "int"),
        Variable("part_start", "part", "s", "start of the part", note="from that of the recording"),
        Variable("part_end", "part", "s", "end of the part"),
        Variable("speed_low", "speed_range", "m s-1", "lower end of the range"),
        Variable("speed_high", "speed_range", "m s-1", "upper end of the range"),
    ),
    attributes=(
        Attribute("level", "number", "below which a p value is a finding"),
        Attribute("effective_parameters", "number", "parameters that the fit took out"),
        Attribute("samples", "number", "samples of the recordings"),
        Attribute("samples_used", "number", "samples that the fit used"),
        Attribute("outliers", "number", "of them outliers"),
        Attribute("portmanteau", "number", "statistic of the autocorrelation"),
        Attribute("portmanteau_dof", "number", "its degrees of freedom"),
        Attribute("cell_size_m", "number", "size of a cell"),
        Attribute("replicates", "number", "simulated recordings of either set"),
        Attribute("seed", "number", "their seed"),
        Attribute("ks_distance", "number", "median of ks_to_estimate, NaN without it"),
        Attribute("ks_distance_interval", "numbers", "[low, high] of the replicates", _COMPARED),
        Attribute("ks_noise_floor", "number", "median of ks_floor, NaN without it"),
        Attribute("ks_noise_floor_upper", "number", "its 95 % quantile", _COMPARED),
        Attribute("ks_p_value", "number", "p value of the distance", _COMPARED),
        Attribute("ks_rank_p_value", "number", "p value by rank", _COMPARED),
        Attribute("band", "number", "share of the replicates in a band", _COMPARED),
        Attribute("ks_left_out", "text", "reason why there is no distance", "it was left out"),
        ARENA,
        SOURCE,
        SIMULATED,
    ),
)  # fmt: skip

KINDS: Final = (MODEL_CHECK,)
