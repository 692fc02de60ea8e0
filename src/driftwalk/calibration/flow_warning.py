"""Whether the flow, taken from the recording itself, is why the model does not explain it."""

from __future__ import annotations

from driftwalk.calibration.goodness_of_fit import GoodnessOfFit
from driftwalk.motion import BlockModel, MotionModel


def own_flow_warning(model: MotionModel, quality: GoodnessOfFit | None) -> str | None:
    """Return what to do where a block is not explained in a flow from its own recording.

    Such a flow is too slow where the block seldom was, and its inward part near the wall is half of
    the true one (docs/validation.md); C_d and sigma_F make up for that.

    Parameters
    ----------
    model : MotionModel
        What was calibrated. Only a block has a fit of flow and parameters together.
    quality : Quality or None
        How well it explains the recording; None where nobody asked.

    Examples
    --------
    >>> import driftwalk as dw
    >>> own_flow_warning(BlockModel(dw.Study()), None) is None
    True
    """
    if not isinstance(model, BlockModel) or quality is None or quality.explained:
        return None
    return (
        "the flow was taken from the recording itself, and the parameters make up for its errors: "
        "for a body that drifts, fit flow and parameters together (driftwalk fit) or give a "
        "measured flow; for one that moves by itself, compare models (driftwalk compare-models)"
    )
