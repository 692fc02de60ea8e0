"""Pages: the data of a report as one JSON object, and the HTML file that shows it."""

from driftwalk.page.arrays import decode_array, encode_array
from driftwalk.page.html import report_html, write_report
from driftwalk.page.run_page import (
    dataset_page,
    joined_page,
    manifest_section,
    name_apart,
    recording_page,
    report_page,
)
from driftwalk.page.sections.assembly import assembly_sections
from driftwalk.page.sections.calibration import (
    bootstrap_section,
    calibration_sections,
    profile_sections,
)
from driftwalk.page.sections.fit import fit_sections
from driftwalk.page.sections.flow import flow_section
from driftwalk.page.sections.map import map_section
from driftwalk.page.sections.motion_models import model_sections
from driftwalk.page.sections.recording import trajectory_section
from driftwalk.page.sections.recovery import model_recovery_sections, recovery_sections
from driftwalk.page.sections.sensitivity import sensitivity_sections

__all__ = [
    "assembly_sections",
    "bootstrap_section",
    "calibration_sections",
    "dataset_page",
    "decode_array",
    "encode_array",
    "fit_sections",
    "flow_section",
    "joined_page",
    "manifest_section",
    "map_section",
    "model_recovery_sections",
    "model_sections",
    "name_apart",
    "profile_sections",
    "recording_page",
    "recovery_sections",
    "report_html",
    "report_page",
    "sensitivity_sections",
    "trajectory_section",
    "write_report",
]
