"""Facts that a simulation or a fit takes from a recording, made once and passed down.

The tank and the block, reconciled with the study; times and gaps, start and camera; the flow.
"""

from driftwalk.conditions.own_flow import recording_flow
from driftwalk.conditions.recorded import Conditions, recorded_conditions
from driftwalk.conditions.study import study_for
from driftwalk.conditions.tank import require_inside, study_in_arena

__all__ = [
    "Conditions",
    "recorded_conditions",
    "recording_flow",
    "require_inside",
    "study_for",
    "study_in_arena",
]
