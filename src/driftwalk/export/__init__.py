"""The way out: a calibrated model as something that another program runs."""

from driftwalk.export.registry import TARGETS, target_named
from driftwalk.export.target import Source, Target, Verification
from driftwalk.export.write import export_run

__all__ = [
    "TARGETS",
    "Source",
    "Target",
    "Verification",
    "export_run",
    "target_named",
]
