"""The dataset of a likelihood fit."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import (
    ARENA,
    SIMULATED,
    SOURCE,
    STUDY,
    WARNINGS,
    Attribute,
    Kind,
    Variable,
)
from driftwalk.schema.kinds.flow import ORIGIN

_ON: Final = "[flow] y x"
_SWITCHED: Final = "with switching times"
_TURNING: Final = "the angle is in the state"
_INTERVAL: Final = "[low, high] at the confidence"

FIT: Final = Kind(
    name="fit",
    version=1,
    dimensions={
        "flow": "flows, by name, with switching times",
        "y": "nodes of the flow",
        "x": "nodes of the flow",
        "component": "u, v",
        "knot_y": "knots of the spline",
        "knot_x": "knots of the spline",
        "parameter": "logarithms of the fitted parameters",
        "other_parameter": "the same",
        "profile": "values of C_d, by their value",
        "interval": "between the switching times",
    },
    variables=(
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
            "covariance", "parameter other_parameter", "1",
            "covariance of the logarithms of the parameters",
        ),
        Variable("profile_deviance", "profile", "1", "deviance along C_d"),
        Variable(
            "profile_half_log_determinant", "profile", "1",
            "half the logarithm of the determinant along C_d",
        ),
        Variable("x", "x", "m", "x"),
        Variable("y", "y", "m", "y"),
        Variable("component", "component", None, "component", "text"),
        Variable("parameter", "parameter", None, "parameter", "text"),
        Variable("other_parameter", "other_parameter", None, "parameter", "text"),
        Variable("profile", "profile", "1", "C_d"),
        Variable("flow", "flow", None, "flow", "text", when=_SWITCHED),
        Variable(
            "interval_flow", "interval", "1",
            "number of the flow in each interval between the switching times", "int",
            when=_SWITCHED,
        ),
    ),
    attributes=(
        Attribute("drag_coefficient", "number", "drag coefficient C_d"),
        Attribute("drag_coefficient_interval", "numbers", _INTERVAL),
        Attribute("force_std_N", "number", "standard deviation σ_F of the force"),
        Attribute("force_std_N_interval", "numbers", _INTERVAL),
        Attribute("force_noise_intensity_N2_s", "number", "σ_F² times the force interval"),
        Attribute("force_noise_intensity_N2_s_interval", "numbers", _INTERVAL),
        Attribute("tracking_noise_m", "number", "standard deviation of the positions' errors"),
        Attribute("tracking_noise_m_interval", "numbers", _INTERVAL),
        Attribute("force_lever_m", "number", "lever of the force", _TURNING),
        Attribute("force_lever_m_interval", "numbers", _INTERVAL, _TURNING),
        Attribute("orientation_noise_rad", "number", "noise of the orientation", _TURNING),
        Attribute("orientation_noise_rad_interval", "numbers", _INTERVAL, _TURNING),
        Attribute("confidence", "number", "of the intervals"),
        Attribute("force_interval_s", "number", "how long a force lasts; σ_F depends on it"),
        SIMULATED,
        WARNINGS,
        ARENA,
        SOURCE,
        STUDY,
    ),
)  # fmt: skip

KINDS: Final = (FIT,)
