"""The figures of a run: a table from their names to what draws them, and the writer of such."""

from driftwalk.figures.assembly import LABELS, assembly_figures, sensitivity_figures
from driftwalk.figures.calibration import calibration_figures
from driftwalk.figures.fit import (
    check_figures,
    fit_figures,
    laws_figures,
    plot_flow_error,
    plot_laws,
)
from driftwalk.figures.motion_models import (
    comparison_figures,
    model_calibration_figures,
    plot_models,
)
from driftwalk.figures.recovery import (
    model_recovery_figures,
    plot_flow_recovery,
    plot_model_recovery,
    plot_recovery,
    plot_recovery_error,
    recovery_figures,
)
from driftwalk.figures.write import write_figures

__all__ = [
    "LABELS",
    "assembly_figures",
    "calibration_figures",
    "check_figures",
    "comparison_figures",
    "fit_figures",
    "laws_figures",
    "model_calibration_figures",
    "model_recovery_figures",
    "plot_flow_error",
    "plot_flow_recovery",
    "plot_laws",
    "plot_model_recovery",
    "plot_models",
    "plot_recovery",
    "plot_recovery_error",
    "recovery_figures",
    "sensitivity_figures",
    "write_figures",
]
