"""Which parameters fit a recording, and how well they are known."""

from driftwalk.calibrate.check import check_recording
from driftwalk.calibrate.fit import check_fit, fit_motion
from driftwalk.calibrate.fit_check import check_model
from driftwalk.calibrate.fit_result import fitted_flow
from driftwalk.calibrate.own_flow import recording_flow
from driftwalk.calibrate.recover import recovery_study
from driftwalk.calibrate.recover_check import check_recovery
from driftwalk.calibrate.run import calibrate
from driftwalk.calibrate.score import score_fit

__all__ = [
    "calibrate",
    "check_fit",
    "check_model",
    "check_recording",
    "check_recovery",
    "fit_motion",
    "fitted_flow",
    "recording_flow",
    "recovery_study",
    "score_fit",
]
