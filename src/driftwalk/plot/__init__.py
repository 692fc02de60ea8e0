"""Figures of stored datasets: functions that take axes and return them."""

from driftwalk.plot.class_courses import plot_class_times, plot_survival
from driftwalk.plot.components import plot_biplot
from driftwalk.plot.distances import plot_ks_map, plot_refined_map
from driftwalk.plot.flow_field import plot_flow
from driftwalk.plot.model_check import (
    plot_innovations,
    plot_predicted_steps,
    plot_residual_map,
    plot_residual_time,
)
from driftwalk.plot.outcome_bars import plot_outcomes
from driftwalk.plot.panels import plot_density_panels
from driftwalk.plot.path import plot_trajectory
from driftwalk.plot.sensitivity_maps import plot_class_key, plot_class_panels, plot_l1_map
from driftwalk.plot.step_density import plot_step_density, plot_steps
from driftwalk.plot.tank import plot_blocks, plot_film_strip, write_animation
from driftwalk.plot.uncertainty import plot_bootstrap, plot_distance_profile, plot_validation

__all__ = [
    "plot_biplot",
    "plot_blocks",
    "plot_bootstrap",
    "plot_class_key",
    "plot_class_panels",
    "plot_class_times",
    "plot_density_panels",
    "plot_distance_profile",
    "plot_film_strip",
    "plot_flow",
    "plot_innovations",
    "plot_ks_map",
    "plot_l1_map",
    "plot_outcomes",
    "plot_predicted_steps",
    "plot_refined_map",
    "plot_residual_map",
    "plot_residual_time",
    "plot_step_density",
    "plot_steps",
    "plot_survival",
    "plot_trajectory",
    "plot_validation",
    "write_animation",
]
