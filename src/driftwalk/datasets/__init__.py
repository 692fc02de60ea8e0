"""Example recordings that come with the package, all of them simulated and named so."""

from driftwalk.datasets.tank30 import tank30_flow, tank30_recording, tank30_truth

__all__ = ["tank30_flow", "tank30_recording", "tank30_truth"]
