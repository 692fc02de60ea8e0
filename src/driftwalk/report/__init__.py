"""Figures of stored datasets: functions that take axes and return them, and a writer of files."""

from driftwalk.report.figures import write_figures
from driftwalk.report.plot_density_panels import plot_density_panels
from driftwalk.report.plot_flow import plot_flow
from driftwalk.report.plot_ks_map import plot_ks_map, plot_refined_map
from driftwalk.report.plot_steps import plot_step_density, plot_steps
from driftwalk.report.plot_trajectory import plot_trajectory
from driftwalk.report.plot_validation import (
    plot_bootstrap,
    plot_distance_profile,
    plot_validation,
)

__all__ = [
    "plot_bootstrap",
    "plot_density_panels",
    "plot_distance_profile",
    "plot_flow",
    "plot_ks_map",
    "plot_refined_map",
    "plot_step_density",
    "plot_steps",
    "plot_trajectory",
    "plot_validation",
    "write_figures",
]
