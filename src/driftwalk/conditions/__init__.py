"""Facts that a simulation or a fit takes from a recording: the tank and the block."""

from driftwalk.conditions.study import study_for
from driftwalk.conditions.tank import require_inside, study_in_arena

__all__ = ["require_inside", "study_for", "study_in_arena"]
