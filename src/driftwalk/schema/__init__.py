"""Schemas of the datasets that the stages hand to each other.

`driftwalk.schema.kinds` says what each kind holds; here is what builds, checks and reads them.
"""

from driftwalk.schema.check import build_dataset, check_dataset, described
from driftwalk.schema.flow_field import FLAGS, build_flow_field, check_flow_field
from driftwalk.schema.parameters import Parameter
from driftwalk.schema.trajectory import (
    Track,
    body_names,
    body_track,
    build_trajectory,
    check_trajectory,
)

__all__ = [
    "FLAGS",
    "Parameter",
    "Track",
    "body_names",
    "body_track",
    "build_dataset",
    "build_flow_field",
    "build_trajectory",
    "check_dataset",
    "check_flow_field",
    "check_trajectory",
    "described",
]
