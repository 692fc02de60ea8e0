"""The paper's calibration of a motion model on a recording, and which of several explains it."""

from driftwalk.calibration.check import check_recording
from driftwalk.calibration.models import (
    ALL_MODELS,
    DEFAULT_MODELS,
    check_models,
    compare_models,
)
from driftwalk.calibration.run import calibrate

__all__ = [
    "ALL_MODELS",
    "DEFAULT_MODELS",
    "calibrate",
    "check_models",
    "check_recording",
    "compare_models",
]
