"""One line of a notebook each: load, fit, simulate, compare, calibrate, assemble, report.

Every call takes what an earlier one returned. Tank and block are stated once, when the recording is
loaded; a second, different statement is an error.
"""

from driftwalk.notebook.fitting import calibrate, compare_models, fit
from driftwalk.notebook.outcomes import infer_outcomes, maximise_yield
from driftwalk.notebook.reporting import report
from driftwalk.notebook.simulating import assemble, compare, kinetics, simulate

__all__ = [
    "assemble",
    "calibrate",
    "compare",
    "compare_models",
    "fit",
    "infer_outcomes",
    "kinetics",
    "maximise_yield",
    "report",
    "simulate",
]
