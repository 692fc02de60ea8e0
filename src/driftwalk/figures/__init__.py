"""The figures of a run: all of them, written into one folder."""

from driftwalk.figures.assembly import write_assembly_figures, write_sensitivity_figures
from driftwalk.figures.calibration import write_figures
from driftwalk.figures.fit import plot_flow_error, write_fit_figures
from driftwalk.figures.laws import plot_laws, write_laws_figure
from driftwalk.figures.model_calibration import write_model_calibration_figures
from driftwalk.figures.model_check import write_check_figures
from driftwalk.figures.model_comparison import plot_models, write_model_figures
from driftwalk.figures.model_recovery import (
    plot_model_recovery,
    write_model_recovery_figures,
)
from driftwalk.figures.recovery import (
    plot_flow_recovery,
    plot_recovery,
    plot_recovery_error,
    write_recovery_figures,
)

__all__ = [
    "plot_flow_error",
    "plot_flow_recovery",
    "plot_laws",
    "plot_model_recovery",
    "plot_models",
    "plot_recovery",
    "plot_recovery_error",
    "write_assembly_figures",
    "write_check_figures",
    "write_figures",
    "write_fit_figures",
    "write_laws_figure",
    "write_model_calibration_figures",
    "write_model_figures",
    "write_model_recovery_figures",
    "write_recovery_figures",
    "write_sensitivity_figures",
]
