"""Which motion model explains a recording? All of them searched alike, and judged alike."""

from driftwalk.calibration.models.compare import (
    ALL_MODELS,
    DEFAULT_MODELS,
    check_models,
    compare_models,
)

__all__ = ["ALL_MODELS", "DEFAULT_MODELS", "check_models", "compare_models"]
