"""How well a set-up recovers the parameters of a motion model: simulated, calibrated, compared."""

from driftwalk.calibration.recover.run import check_model_recovery, recover_model

__all__ = ["check_model_recovery", "recover_model"]
