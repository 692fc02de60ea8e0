"""Run directories: long work that resumes, with its figures and its manifest."""

from driftwalk.runs.assembly import AssemblyResult, AssemblyWork, SensitivityResult, SensitivityWork
from driftwalk.runs.calibration import CalibrationWork, ModelComparisonWork
from driftwalk.runs.control import ControlPlanWork, ControlTestWork
from driftwalk.runs.finished_run import FoundRun, flow_of_result, read_found, run_folder
from driftwalk.runs.fit import Fitted, FitWork, read_earlier_fit
from driftwalk.runs.outcomes import KineticsWork, OutcomePosteriorWork, YieldWork
from driftwalk.runs.recovery import RecoveryWork
from driftwalk.runs.resumable_run import Progress, Run, Work, run_work
from driftwalk.schema.stores.netcdf import netcdf_bytes

__all__ = [
    "AssemblyResult",
    "AssemblyWork",
    "CalibrationWork",
    "ControlPlanWork",
    "ControlTestWork",
    "FitWork",
    "Fitted",
    "FoundRun",
    "KineticsWork",
    "ModelComparisonWork",
    "OutcomePosteriorWork",
    "Progress",
    "RecoveryWork",
    "Run",
    "SensitivityResult",
    "SensitivityWork",
    "Work",
    "YieldWork",
    "flow_of_result",
    "netcdf_bytes",
    "read_earlier_fit",
    "read_found",
    "run_folder",
    "run_work",
]
