"""What a simulation or a fit takes over from a recording: the tank, reconciled with the study."""

from driftwalk.conditions.study import study_for
from driftwalk.conditions.tank import require_inside, study_in_arena

__all__ = ["require_inside", "study_for", "study_in_arena"]
