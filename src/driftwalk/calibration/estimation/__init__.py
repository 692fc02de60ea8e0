"""Which values of many parameters fit, and how well a recording determines them.

Two stages: a search by six two-dimensional KS distances (`driftwalk.calibration.evolution`), and
summaries of the motion, matched by their synthetic likelihood.
"""

from driftwalk.calibration.estimation.run import Stores, Tell, calibrate_many

__all__ = ["Stores", "Tell", "calibrate_many"]
