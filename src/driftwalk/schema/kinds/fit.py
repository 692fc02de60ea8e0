"""The dataset of a likelihood fit."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import (
    ARENA,
    SIMULATED,
    SOURCE,
    STUDY,
    Attribute,
    Kind,
    Variable,
)
from driftwalk.schema.kinds.flow import ORIGIN

_ON: Final = "[flow] y x"
_SWITCHED: Final = "with switching times"
_TURNING: Final = "the angle is in the state"
_ASKED: Final = "a precision of C_d is asked for"
_CHECKED: Final = "the model was checked"
_LAWS: Final = "the fit was made by a version that looks for the force law"
_SAYS: Final = "the fit was made by a version that keeps it"
_WALL: Final = "contacts with the wall were looked for"
_WALL_FOUND: Final = "the wall was estimated, from eight passages or more"
_COMPARED_LAWS: Final = "two laws were fitted"
_NO_ADDED_MASS: Final = "no added mass was stated, and the paper's law was found"
_TABLE: Final = "laws were compared"
_COMPARED: Final = "the angle is in the state, and the second fit has a solution"

FIT: Final = Kind(
    name="fit",
    version=2,
    dimensions={
        "flow": "flows, by name, with switching times",
        "y": "nodes of the flow",
        "x": "nodes of the flow",
        "component": "u, v",
        "knot_y": "knots of the spline",
        "knot_x": "knots of the spline",
        "parameter": "fitted parameters, by name",
        "bound": "lower, upper",
        "warning": "sentences",
        "finding": "sentences",
        "criterion": "criteria of the check, by name",
        "residual_component": "errors in x, in y, and in the angle where it is in the state",
        "cell_y": "centres of the cells of the check",
        "cell_x": "centres of the cells of the check",
        "log_parameter": "logarithms of the fitted parameters",
        "other_log_parameter": "the same",
        "axis": "x, y",
        "switch": "switching times",
        "profile": "values of C_d, by their value",
        "flow_interval": "between the switching times",
        "compared_law": "force laws that were compared, by name",
        "number": "numbers of departures from the model, by name",
        "law": "force laws that were fitted, by name",
        "departure": "numbers of departures that were tested, by name",
    },
    variables=(
        Variable(
            "estimate", "parameter", None, "estimates of the parameters",
            note="drag_coefficient C_d, force_std σ_F, force_noise_intensity σ_F² times the force "
            "interval, tracking_noise; with the angle in the state also force_lever and "
            "orientation_noise; where they were estimated or stated, the numbers of the force law "
            "and of the camera; in the units of the coordinate unit",
        ),
        Variable(
            "interval", "parameter bound", None, "intervals of the parameters",
            note="at the confidence; infinite where the recording leaves an end open",
        ),
        Variable("warning", "warning", None, "evidence against the fit", "text"),
        Variable(
            "explained", "", None, "whether the model explains the recordings", "bool",
            when=_CHECKED,
        ),
        Variable(
            "finding", "finding", None, "evidence against the model", "text", when=_CHECKED
        ),
        Variable("p_value", "criterion", "1", "p value of the criterion", when=_CHECKED),
        Variable("converged", "", None, "whether the search came to its end", "bool"),
        Variable(
            "restricted", "", None, "whether the restricted likelihood has a minimum", "bool"
        ),
        Variable("confidence", "", "1", "confidence of the intervals"),
        Variable(
            "force_interval", "", "s", "time after which a force is redrawn",
            note="σ_F depends on it",
        ),
        Variable(
            "maximum_likelihood_drag_coefficient", "", "1", "C_d of the plain likelihood"
        ),
        Variable("drag_coefficient_relative_std", "", "1", "standard deviation of ln C_d"),
        Variable(
            "drag_coefficient_precision", "", "1", "precision of C_d that is asked for",
            when=_ASKED,
        ),
        Variable(
            "needed_duration", "", "s", "length of a recording like this for that precision",
            note="for 0.1 if none is asked for",
        ),
        Variable("wetted_depth", "", "m", "depth of the block in the water"),
        Variable("wall_share", "", "1", "share of the intervals at the wall, left out"),
        Variable(
            "visited_share", "", "1", "share of the tank's nodes that the block has been over",
            note="the smallest of all flows",
        ),
        Variable("samples", "", "1", "samples of the recordings", "int"),
        Variable(
            "samples_used", "", "1", "samples that were near enough to their prediction", "int"
        ),
        Variable(
            "mistakes", "", "1", "samples left out as mistakes of the tracker", "int",
            when="the fit was made by a version that looks for them",
        ),
        Variable(
            "jumps_removed", "", "1", "samples left out when the recordings were read, as too far "
            "away for the greatest speed", "int",
            when="the fit was made by a version that counts them",
        ),
        Variable(
            "dropped_frames", "", "1", "frames that the recording lacks although its stamps do not "
            "say so", "int", when="the fit was made by a version that looks for them",
            note="their time is put in",
        ),
        Variable("intervals_usable", "", "1", "intervals that might have been used", "int"),
        Variable("duration", "", "s", "length of the recordings together"),
        Variable("recordings", "", "1", "recordings", "int"),
        Variable(
            "chi_squared_per_dof", "", "1", "mean square of the whitened innovations",
            note="1 if the model is right",
        ),
        Variable(
            "autocorrelation", "", "1", "correlation of whitened innovations one sample apart",
            note="0 if the model is right",
        ),
        Variable("autocorrelation_std", "", "1", "its standard deviation if the model is right"),
        Variable("iterations", "", "1", "steps of the search", "int"),
        Variable("roughness_weight", "", "1", "weight of the flow's roughness"),
        Variable("size_weight", "", "1", "weight of the flow's size"),
        Variable(
            "drag_coefficient_angle_given", "", "1", "C_d with the angle as an input",
            when=_COMPARED,
        ),
        Variable(
            "drag_coefficient_angle_given_interval", "bound", "1", "its interval", when=_COMPARED
        ),
        Variable(
            "angle_disagreement_std", "", "1",
            "difference of the two ln C_d in combined standard deviations", when=_TURNING,
            note="NaN where the second fit has no solution",
        ),
        Variable(
            "law_settled_by", "", "1",
            "difference of the logarithms of the evidence for the law and for the other one",
            when=_COMPARED_LAWS, note="below 3 the recording cannot tell them apart",
        ),
        Variable(
            "law_log_evidence", "law", "1", "logarithm of the evidence for each law",
            when=_LAWS, note="without its constant, in the beginning of the recordings",
        ),
        Variable(
            "filter_drag_coefficient", "", "1", "C_d of the filter, without added mass",
            when=_LAWS,
        ),
        Variable(
            "number_value", "number", None, "numbers of departures from the model",
            when=_LAWS, note="as the filter takes them, in SI units",
        ),
        Variable(
            "number_opened", "number", None, "whether the number was estimated", "bool",
            when=_LAWS,
        ),
        Variable(
            "departure_estimate", "departure", None,
            "estimates of closed numbers by score tests at the end of the search",
            when=_LAWS, note="in SI units; the model is 0",
        ),
        Variable(
            "departure_std", "departure", None, "their standard deviations", when=_LAWS
        ),
        Variable(
            "drag_coefficient_any_added_mass_interval", "bound", "1",
            "interval of C_d if the block may carry the usual added mass", when=_NO_ADDED_MASS,
        ),
        Variable(
            "force_std_any_added_mass_interval", "bound", "N",
            "the same of σ_F", when=_NO_ADDED_MASS,
        ),
        Variable(
            "compared_log_evidence", "compared_law", "1",
            "logarithm of the evidence in the first 70 % of the recordings", when=_TABLE,
        ),
        Variable(
            "compared_log_score", "compared_law", "1",
            "mean logarithm of the predicted density of a held out sample", when=_TABLE,
            note="in SI units; NaN where the law has no solution",
        ),
        Variable(
            "compared_log_score_std", "compared_law", "1",
            "standard error of its difference from the best law's", when=_TABLE,
        ),
        Variable(
            "compared_filter_drag_coefficient", "compared_law", "1",
            "C_d of the filter under the law, without added mass", when=_TABLE,
        ),
        Variable("compared_law", "compared_law", None, "force law", "text", when=_TABLE),
        Variable(
            "wall_contacts", "", "1", "passages of the block along the wall", "int", when=_WALL
        ),
        Variable(
            "wall_restitution", "", "1", "restitution of the wall", when=_WALL_FOUND
        ),
        Variable("wall_restitution_interval", "bound", "1", "its interval", when=_WALL_FOUND),
        Variable("wall_friction", "", "1", "friction of the wall", when=_WALL_FOUND),
        Variable(
            "wall_friction_interval", "bound", "1", "its interval", when=_WALL_FOUND,
            note="infinite where every contact may stick",
        ),
        Variable("number", "number", None, "number", "text", when=_LAWS),
        Variable("law", "law", None, "force law", "text", when=_LAWS),
        Variable("departure", "departure", None, "number that was tested", "text", when=_LAWS),
        Variable("parameter", "parameter", None, "parameter", "text"),
        Variable("unit", "parameter", None, "unit of the parameter", "text"),
        Variable("bound", "bound", None, "end of an interval", "text"),
        Variable("u", _ON, "m s-1", "flow velocity x"),
        Variable("v", _ON, "m s-1", "flow velocity y"),
        Variable(
            "u_standard_error", _ON, "m s-1", "standard error of flow velocity x",
            note="at every node, filled ones too",
        ),
        Variable("v_standard_error", _ON, "m s-1", "standard error of flow velocity y"),
        Variable("count", _ON, "1", "samples with the block over the node"),
        Variable("flag", _ON, None, "origin of the node's value", "int", flags=ORIGIN),
        Variable(
            "coefficient", "[flow] component knot_y knot_x", "m s-1",
            "coefficients of the bicubic splines",
        ),
        Variable(
            "covariance", "log_parameter other_log_parameter", "1",
            "covariance of the logarithms of the parameters",
        ),
        Variable("profile_deviance", "profile", "1", "deviance along C_d"),
        Variable(
            "profile_half_log_determinant", "profile", "1",
            "half the logarithm of the determinant along C_d",
        ),
        Variable(
            "residual", "residual_component cell_y cell_x", "1", "mean error in its sd",
            when=_CHECKED, note="by cell",
        ),
        Variable("residual_count", "cell_y cell_x", "1", "samples", when=_CHECKED),
        Variable(
            "residual_distance", "cell_y cell_x", "1",
            "distance of the mean error from zero, in its sd after fitting", when=_CHECKED,
            note="the largest exceeds its attribute limit once in twenty",
        ),
        Variable(
            "noise_ratio", "cell_y cell_x", "1", "mean square against that of all", when=_CHECKED
        ),
        Variable(
            "noise_ratio_std", "cell_y cell_x", "1", "its standard deviation", when=_CHECKED
        ),
        Variable("residual_cell_size", "", "m", "size of a cell of the check", when=_CHECKED),
        Variable("criterion", "criterion", None, "criterion", "text", when=_CHECKED),
        Variable(
            "residual_component", "residual_component", None, "component", "text", when=_CHECKED
        ),
        Variable("cell_x", "cell_x", "m", "x", when=_CHECKED),
        Variable("cell_y", "cell_y", "m", "y", when=_CHECKED),
        Variable("x", "x", "m", "x"),
        Variable("y", "y", "m", "y"),
        Variable("component", "component", None, "component", "text"),
        Variable("spline_origin", "axis", "m", "first knot of the splines"),
        Variable("spline_spacing", "", "m", "distance between knots"),
        Variable("cell_size", "", "m", "distance between nodes"),
        Variable("log_parameter", "log_parameter", None, "logarithm of a parameter", "text"),
        Variable(
            "other_log_parameter", "other_log_parameter", None, "logarithm of a parameter", "text"
        ),
        Variable("axis", "axis", None, "axis", "text"),
        Variable("profile", "profile", "1", "C_d"),
        Variable("flow", "flow", None, "flow", "text", when=_SWITCHED),
        Variable(
            "interval_flow", "flow_interval", "1",
            "number of the flow in each interval between the switching times", "int",
            when=_SWITCHED,
        ),
        Variable(
            "switching_time", "switch", "s", "when the flow changes", when=_SWITCHED,
            note="on the clock of the recordings",
        ),
        Variable(
            "recording_start", "", "s", "first sample of the first recording", when=_SWITCHED
        ),
    ),
    attributes=(
        Attribute("angle", "text", 'how the orientation was used: "state", "given" or "none"'),
        Attribute(
            "force_law", "text", 'force law, found or stated: "paper" or "floating body"',
            _LAWS,
        ),
        Attribute(
            "force_law_stated", "text", '"yes" where the fit tried no other, else "no"', _SAYS
        ),
        Attribute(
            "drag_law", "text", 'how the drag goes with the speed: "quadratic", "linear", "mixed" '
            'of both, or "power"', _SAYS,
        ),
        Attribute(
            "drag_law_stated", "text", '"yes" where the fit tried no other, else "no"', _SAYS
        ),
        Attribute("check_left_out", "text", "reason why the model was not checked", "it was not"),
        Attribute(
            "wall_left_out", "text", "reason why the wall was not estimated",
            "asked for, and it was not",
        ),
        SIMULATED,
        ARENA,
        SOURCE,
        STUDY,
    ),
)  # fmt: skip

KINDS: Final = (FIT,)
