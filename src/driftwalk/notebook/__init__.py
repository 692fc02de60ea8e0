"""One line of a notebook each: load, fit, simulate, compare, calibrate, assemble, report.

Every call takes what an earlier one returned. Tank and block are stated once, when the recording is
loaded; a second, different statement is an error.
"""

from driftwalk.notebook.assembling import assemble
from driftwalk.notebook.calibrating import calibrate
from driftwalk.notebook.comparing import compare
from driftwalk.notebook.comparing_models import compare_models
from driftwalk.notebook.fitting import fit
from driftwalk.notebook.reporting import report
from driftwalk.notebook.simulating import simulate

__all__ = ["assemble", "calibrate", "compare", "compare_models", "fit", "report", "simulate"]
