"""Figures of stored datasets: functions that take axes and return them, and a writer of files.

And pages: the data of a report as one JSON object, and the HTML file that shows it.
"""

from driftwalk.report.assembly_figures import write_assembly_figures, write_sensitivity_figures
from driftwalk.report.check_figures import write_check_figures
from driftwalk.report.figures import write_figures
from driftwalk.report.fit_figures import plot_flow_error, write_fit_figures
from driftwalk.report.page import joined_page, recording_page, report_page
from driftwalk.report.page_arrays import decode_array, encode_array
from driftwalk.report.page_assembly import assembly_sections
from driftwalk.report.page_calibration import calibration_sections
from driftwalk.report.page_fit import fit_sections
from driftwalk.report.page_flow import flow_section
from driftwalk.report.page_html import report_html, write_report
from driftwalk.report.page_manifest import manifest_section
from driftwalk.report.page_map import map_section
from driftwalk.report.page_recording import trajectory_section
from driftwalk.report.page_recovery import recovery_sections
from driftwalk.report.page_sensitivity import sensitivity_sections
from driftwalk.report.plot_biplot import plot_biplot
from driftwalk.report.plot_blocks import plot_blocks, plot_film_strip, write_animation
from driftwalk.report.plot_check import (
    plot_innovations,
    plot_predicted_steps,
    plot_residual_map,
    plot_residual_time,
)
from driftwalk.report.plot_class_times import plot_class_times, plot_survival
from driftwalk.report.plot_density_panels import plot_density_panels
from driftwalk.report.plot_flow import plot_flow
from driftwalk.report.plot_ks_map import plot_ks_map, plot_refined_map
from driftwalk.report.plot_l1_map import plot_class_key, plot_class_panels, plot_l1_map
from driftwalk.report.plot_outcomes import plot_outcomes
from driftwalk.report.plot_steps import plot_step_density, plot_steps
from driftwalk.report.plot_trajectory import plot_trajectory
from driftwalk.report.plot_validation import (
    plot_bootstrap,
    plot_distance_profile,
    plot_validation,
)
from driftwalk.report.recovery_figures import (
    plot_flow_recovery,
    plot_recovery,
    plot_recovery_error,
    write_recovery_figures,
)

__all__ = [
    "assembly_sections",
    "calibration_sections",
    "decode_array",
    "encode_array",
    "fit_sections",
    "flow_section",
    "joined_page",
    "manifest_section",
    "map_section",
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
    "plot_flow_error",
    "plot_flow_recovery",
    "plot_innovations",
    "plot_ks_map",
    "plot_l1_map",
    "plot_outcomes",
    "plot_predicted_steps",
    "plot_recovery",
    "plot_recovery_error",
    "plot_refined_map",
    "plot_residual_map",
    "plot_residual_time",
    "plot_step_density",
    "plot_steps",
    "plot_survival",
    "plot_trajectory",
    "plot_validation",
    "recording_page",
    "recovery_sections",
    "report_html",
    "report_page",
    "sensitivity_sections",
    "trajectory_section",
    "write_animation",
    "write_assembly_figures",
    "write_check_figures",
    "write_figures",
    "write_fit_figures",
    "write_recovery_figures",
    "write_report",
    "write_sensitivity_figures",
]
