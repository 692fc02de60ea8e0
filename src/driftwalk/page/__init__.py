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

__all__ = [
    "dataset_page",
    "decode_array",
    "encode_array",
    "joined_page",
    "manifest_section",
    "name_apart",
    "recording_page",
    "report_html",
    "report_page",
    "write_report",
]
