"""Figures of stored datasets: functions that take axes and return them."""

from driftwalk.plot.assembly_courses import (
    plot_assembly_sizes as assembly_sizes,
    plot_attraction as attraction,
    plot_class_times as class_times,
    plot_growth as growth,
    plot_survival as survival,
)
from driftwalk.plot.components import plot_biplot as biplot
from driftwalk.plot.distances import plot_ks_map as map, plot_refined_map as refined_map
from driftwalk.plot.film import require_film_writer, write_animation
from driftwalk.plot.flow_field import plot_flow as flow
from driftwalk.plot.model_check import (
    plot_innovations as innovations,
    plot_predicted_steps as predicted_steps,
    plot_residual_map as residuals,
    plot_residual_time as residual_time,
)
from driftwalk.plot.outcome_bars import plot_outcomes as outcomes
from driftwalk.plot.sensitivity_maps import (
    plot_class_key as class_key,
    plot_class_panels as class_panels,
    plot_l1_map as l1_map,
)
from driftwalk.plot.step_densities import (
    plot_density_panels as density_panels,
    plot_step_density as step_density,
    plot_steps as steps,
)
from driftwalk.plot.tank import (
    plot_blocks as blocks,
    plot_film_strip as film_strip,
    plot_trajectory as trajectory,
)
from driftwalk.plot.uncertainty import (
    plot_bootstrap as bootstrap,
    plot_distance_profile as distance_profile,
    plot_validation as validation,
)

__all__ = [
    "assembly_sizes",
    "attraction",
    "biplot",
    "blocks",
    "bootstrap",
    "class_key",
    "class_panels",
    "class_times",
    "density_panels",
    "distance_profile",
    "film_strip",
    "flow",
    "growth",
    "innovations",
    "l1_map",
    "map",
    "outcomes",
    "predicted_steps",
    "refined_map",
    "require_film_writer",
    "residual_time",
    "residuals",
    "step_density",
    "steps",
    "survival",
    "trajectory",
    "validation",
    "write_animation",
]
