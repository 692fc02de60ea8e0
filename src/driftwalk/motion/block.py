"""The block in a stirred tank as one motion model among others, with its fused native path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from driftwalk import _core
from driftwalk.conditions.recorded import Conditions
from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.errors import InputError
from driftwalk.motion.protocol import Values
from driftwalk.motion.score import NativeModel
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import native_model
from driftwalk.simulation.initial import world_table

if TYPE_CHECKING:
    from driftwalk.model import Study


class BlockModel(NativeModel):
    """A floating block, dragged by the water and pushed by a stochastic force.

    Parameters
    ----------
    study : Study
        Block, tank, water and times; its section [calibration] has the ranges of the two
        parameters.

    Examples
    --------
    >>> import driftwalk as dw
    >>> [parameter.name for parameter in BlockModel(dw.Study()).parameters]
    ['drag_coefficient', 'force_std']
    """

    name = "block"
    needs_flow = True

    def __init__(self, study: Study) -> None:
        self.study = study
        search = study.calibration
        self.parameters = (
            Parameter(
                "drag_coefficient", "1", search.drag_coefficient_min, search.drag_coefficient_max,
                search.drag_coefficient_step, label="drag coefficient", symbol="C_d",
                refined_step=search.refined_drag_coefficient_step,
            ),
            Parameter(
                "force_std", "N", search.force_std_min_N, search.force_std_max_N,
                search.force_std_step_N, label="force_std", symbol="sigma_F",
                refined_step=search.refined_force_std_step_N,
            ),
        )  # fmt: skip

    def describe(self) -> dict[str, Any]:
        """Return the study that it was made from."""
        return {"name": self.name, "study": self.study.to_dict()}

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:
        """Return the force interval, without which sigma_F has no meaning, and what hangs on it."""
        interval = self.study.forces.force_interval_s
        return {
            "force_interval_s": interval,
            "force_noise_intensity_N2_s": estimate["force_std"] ** 2 * interval,
            "wetted_depth_m": self.study.wetted_depth_m,
            "time_step_s": self.study.time_step_s,
        }

    def _native(self, like: Conditions) -> tuple[_core.Model, None]:
        if like.flow is None:
            raise InputError("a block drifts in water: its conditions need a flow field")
        return native_model(self.study, like.flow, like.sample_time, like.camera), None

    def _worlds(self, values: Values, like: Conditions, keys: Keys) -> tuple[Floats, None]:
        table = world_table(
            like.start,
            keys,
            drag_coefficient=values["drag_coefficient"],
            force_std=values["force_std"],
        )
        return table, None
