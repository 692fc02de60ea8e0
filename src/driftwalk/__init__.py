"""driftwalk: calibrated stochastic motion models of floating, drifting and stirred robots.

The names that most work needs are here, the others by room: `driftwalk.track.Tracker`,
`driftwalk.plot.flow`. Every name is resolved on first use, so `import driftwalk` loads nothing
heavy; `__init__.pyi` has the same names for type checkers and editors.
"""

from __future__ import annotations

from typing import Any

__version__ = "0.1.0"

_ROOMS = (
    "assembly",
    "calibration",
    "comparison",
    "conditions",
    "datasets",
    "figures",
    "flow",
    "likelihood",
    "model",
    "motion",
    "notebook",
    "page",
    "plot",
    "record",
    "runs",
    "simulation",
    "sweep",
    "track",
    "viewer",
)

# From a module to the names of the package that are found there.
_NAMES = {
    "driftwalk.assembly": (
        "LiveTank",
        "ModeSource",
        "TankBatch",
        "assemble_drawn",
        "assembly_path",
        "assembly_sizes",
        "attraction",
        "class_times",
        "classify",
        "l1_distance",
        "l1_noise_floor",
        "make_modes",
        "outcome_distribution",
        "path_recording",
        "plan_control",
        "principal_components",
        "sensitivity_indices",
        "sensitivity_map",
        "sensitivity_reference",
        "steady_state",
        "try_control",
    ),
    "driftwalk.calibration": ("recover_model",),
    "driftwalk.comparison": (
        "ComparisonWarning",
        "block_permutation_test",
        "compare_replicates",
        "ks_distance",
        "steps",
    ),
    "driftwalk.conditions": ("simulate_like",),
    "driftwalk.core.errors": (
        "ConfigurationError",
        "DriftwalkError",
        "FormatError",
        "InputError",
        "RunDirectoryError",
    ),
    "driftwalk.datasets": (
        "render_video",
        "tank30_flow",
        "tank30_recording",
        "tank30_truth",
        "video_settings",
        "video_truth",
        "write_video",
    ),
    "driftwalk.flow": (
        "extract_flow",
        "flow_from_function",
        "flow_from_tracers",
        "jets_flow",
        "load_flow",
        "save_flow",
        "uniform_flow",
        "vortex_flow",
    ),
    "driftwalk.likelihood": (
        "check_model",
        "fit_motion",
        "fitted_flow",
        "recovery_study",
        "score_fit",
    ),
    "driftwalk.model": (
        "Study",
        "apply_overrides",
        "load_study",
    ),
    "driftwalk.motion": ("models", "motion_model"),
    "driftwalk.notebook": (
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
    ),
    "driftwalk.page": (
        "report_page",
        "write_report",
    ),
    "driftwalk.record": (
        "describe",
        "load",
        "readable_formats",
        "save_trajectory",
    ),
    "driftwalk.track": (
        "observe",
        "open_source",
    ),
    "driftwalk.viewer": ("serve",),
}
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names}

__all__ = ["__version__", *_ROOMS, *_MODULE_OF]


def __getattr__(name: str) -> Any:
    """Resolve a room, or a name of one, on first use."""
    import importlib

    if name in _ROOMS:
        return importlib.import_module(f"driftwalk.{name}")
    if name in _MODULE_OF:
        globals()[name] = getattr(importlib.import_module(_MODULE_OF[name]), name)
        return globals()[name]
    raise AttributeError(f"module 'driftwalk' has no attribute '{name}'")


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
