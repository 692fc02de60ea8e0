"""Facts that a simulation or a fit takes from a recording, made once and passed down.

How a recording is read when a study says so, and what is refused; the tank and the block,
reconciled with the study; times and gaps, start and camera; the flow.
"""

from driftwalk.conditions.camera import possible_noises, recorded_camera, study_as_seen
from driftwalk.conditions.reading import (
    ReadRecordings,
    load_for_run,
    load_with_study,
    one_body_each,
    read_recordings,
)
from driftwalk.conditions.recorded import (
    Conditions,
    Neighbours,
    flow_by_study,
    neighbours_of,
    recorded_conditions,
    recorded_start,
    recording_flow,
    simulate_like,
)
from driftwalk.conditions.refuse import (
    jump_warnings,
    require_motion,
    require_positions,
    require_travel,
    sound_track,
    typical_speed,
)
from driftwalk.conditions.study import (
    About,
    block_attributes,
    estimated_study,
    is_stated,
    require_inside,
    study_for,
    study_in_arena,
    study_of_block,
    unstated_warning,
)

__all__ = [
    "About",
    "Conditions",
    "Neighbours",
    "ReadRecordings",
    "block_attributes",
    "estimated_study",
    "flow_by_study",
    "is_stated",
    "jump_warnings",
    "load_for_run",
    "load_with_study",
    "neighbours_of",
    "one_body_each",
    "possible_noises",
    "read_recordings",
    "recorded_camera",
    "recorded_conditions",
    "recorded_start",
    "recording_flow",
    "require_inside",
    "require_motion",
    "require_positions",
    "require_travel",
    "simulate_like",
    "sound_track",
    "study_as_seen",
    "study_for",
    "study_in_arena",
    "study_of_block",
    "typical_speed",
    "unstated_warning",
]
