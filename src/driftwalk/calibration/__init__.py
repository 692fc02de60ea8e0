"""The paper's calibration of a motion model on a recording, and which of several explains it."""

from driftwalk.calibration.model_recovery import ModelRecovery, recover_model
from driftwalk.calibration.ranking.compare import (
    ALL_MODELS,
    DEFAULT_MODELS,
    check_models,
    compare_models,
)
from driftwalk.calibration.run import MOST_PARAMETERS, calibrate, check_recording

__all__ = [
    "ALL_MODELS",
    "DEFAULT_MODELS",
    "MOST_PARAMETERS",
    "ModelRecovery",
    "calibrate",
    "check_models",
    "check_recording",
    "compare_models",
    "recover_model",
]
