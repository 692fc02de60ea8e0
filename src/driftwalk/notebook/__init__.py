"""One line of a notebook each: load, fit, simulate, compare, calibrate, assemble, report.

Every call takes what an earlier one returned. Tank and block are stated once, when the recording is
loaded; a second, different statement is an error.
"""

from driftwalk.notebook.comparing import compare, compare_models
from driftwalk.notebook.fitting import calibrate, fit
from driftwalk.notebook.reporting import report
from driftwalk.notebook.simulating import assemble, simulate

__all__ = ["assemble", "calibrate", "compare", "compare_models", "fit", "report", "simulate"]
