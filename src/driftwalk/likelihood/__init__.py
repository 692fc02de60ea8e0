"""The likelihood fit: flow, drag, stochastic force and tracking noise of one recording."""

from driftwalk.likelihood.check.run import Judged, check_model, judge_fit
from driftwalk.likelihood.contacts.estimate import estimate_wall
from driftwalk.likelihood.fit import check_fit, fit_motion
from driftwalk.likelihood.flow_intervals import FlowSetting, fitted_flow, flow_settings
from driftwalk.likelihood.interaction.glued import EarlierFit, glued_study
from driftwalk.likelihood.law.held_out import compare_laws
from driftwalk.likelihood.preparation import describe_measured
from driftwalk.likelihood.recovery import FitRecovery, recovery_study
from driftwalk.likelihood.refuse import fit_work
from driftwalk.likelihood.score import score_fit

__all__ = [
    "EarlierFit",
    "FitRecovery",
    "FlowSetting",
    "Judged",
    "check_fit",
    "check_model",
    "compare_laws",
    "describe_measured",
    "estimate_wall",
    "fit_motion",
    "fit_work",
    "fitted_flow",
    "flow_settings",
    "glued_study",
    "judge_fit",
    "recovery_study",
    "score_fit",
]
