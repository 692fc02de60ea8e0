"""Schemas of the datasets that the stages hand to each other: one file per kind."""

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
    "build_flow_field",
    "build_trajectory",
    "check_flow_field",
    "check_trajectory",
]
