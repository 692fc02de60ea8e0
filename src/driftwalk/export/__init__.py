"""The way out: a calibrated model as something that another program runs."""

from driftwalk.export.registry import TARGETS, export_run, target_named
from driftwalk.export.target import Source, Target, Verification

__all__ = [
    "TARGETS",
    "Source",
    "Target",
    "Verification",
    "export_run",
    "target_named",
]
