"""The paper's calibration: the settings of a model whose simulated steps match the recording's."""

from driftwalk.calibration.check import check_recording
from driftwalk.calibration.run import calibrate

__all__ = ["calibrate", "check_recording"]
