"""Run directories: long work that resumes, with its figures and its manifest."""

from driftwalk.runs.assembly import LABELS, AssemblyResult, AssemblyWork, run_assembly
from driftwalk.runs.calibration import CalibrationWork, result_file, run_calibration
from driftwalk.runs.fit import Fitted, FitWork, run_fit, steady_flows
from driftwalk.runs.folder import Progress
from driftwalk.runs.found import RUN_KINDS, FoundRun, read_found, run_folder
from driftwalk.runs.model_comparison import ModelComparisonWork, run_model_comparison
from driftwalk.runs.model_recovery import ModelRecoveryWork, run_model_recovery
from driftwalk.runs.recovery import RecoveryWork, run_recovery
from driftwalk.runs.sensitivity import (
    SensitivityResult,
    SensitivityWork,
    draw_sensitivity,
    run_sensitivity,
)
from driftwalk.schema.stores.netcdf import netcdf_bytes

__all__ = [
    "LABELS",
    "RUN_KINDS",
    "AssemblyResult",
    "AssemblyWork",
    "CalibrationWork",
    "FitWork",
    "Fitted",
    "FoundRun",
    "ModelComparisonWork",
    "ModelRecoveryWork",
    "Progress",
    "RecoveryWork",
    "SensitivityResult",
    "SensitivityWork",
    "draw_sensitivity",
    "netcdf_bytes",
    "read_found",
    "result_file",
    "run_assembly",
    "run_calibration",
    "run_fit",
    "run_folder",
    "run_model_comparison",
    "run_model_recovery",
    "run_recovery",
    "run_sensitivity",
    "steady_flows",
]
