"""The axes of a sensitivity analysis: from the values to compare to the worlds to simulate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.plan import Plan
from driftwalk.assembly.sensitivity.settings import Settings, world_plan
from driftwalk.core.errors import ConfigurationError, InputError

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

KEYS: Final[dict[str, str]] = {
    "tank_diameter": "tank.diameter_m",
    "blocks": "assembly.blocks",
    "flow": "",
    "latching": "assembly.latching",
    "hidden_face_drag": "assembly.hidden_face_drag",
    "drag_coefficient": "forces.drag_coefficient",
    "force_std": "forces.force_std_N",
}
"""From the name of an axis to the parameter of the study that it varies."""
OF_EACH_RUN: Final = ("drag_coefficient", "force_std")
"""The axes along which runs can be simulated side by side."""


@dataclass(frozen=True, eq=False)
class Axes:
    """The axes of a map, and what the settings along them are.

    Attributes
    ----------
    study : Study
        With the values of the axes in its [sensitivity].
    values : dict of str to tuple
        The values of each axis, in the order of the dimensions.
    flows : dict of str to xarray.Dataset
        The flow fields of the axis ``flow``.
    """

    study: Study
    values: dict[str, tuple[Any, ...]]
    flows: dict[str, xr.Dataset]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(values) for values in self.values.values())

    def coordinates(self) -> dict[str, tuple[str, npt.NDArray[Any]]]:
        """Return the coordinates of the axes for a dataset."""
        return {name: (name, _array(values)) for name, values in self.values.items()}

    def settings(self, flow: xr.Dataset, *, first_trial: int, threads: int | None) -> Settings:
        """Return every combination of the values, the last axis fastest.

        Raises
        ------
        InputError
            When the blocks of a setting have no room, or its flow does not cover its tank.
        """
        apart = [name for name in self.values if name not in OF_EACH_RUN]
        along = [name for name in self.values if name in OF_EACH_RUN]
        worlds = [
            self._world(dict(zip(apart, chosen, strict=True)), flow, threads)
            for chosen in product(*(self.values[name] for name in apart))
        ]
        size = math.prod(self.shape)
        forces = self.study.forces
        table = dict.fromkeys(OF_EACH_RUN, np.empty(0)) | {
            "drag_coefficient": np.full(size, forces.drag_coefficient),
            "force_std": np.full(size, forces.force_std_N),
        }
        inner = np.meshgrid(*(np.array(self.values[name]) for name in along), indexing="ij")
        for name, values in zip(along, inner, strict=True):
            table[name] = np.tile(values.ravel(), len(worlds))
        return Settings(
            worlds=worlds,
            world=np.repeat(np.arange(len(worlds)), size // len(worlds)),
            drag_coefficient=table["drag_coefficient"],
            force_std=table["force_std"],
            trial=first_trial + np.arange(size),
        )

    def _world(self, chosen: dict[str, Any], flow: xr.Dataset, threads: int | None) -> Plan:
        from driftwalk.model import apply_overrides

        changes = {KEYS[name]: value for name, value in chosen.items() if KEYS[name]}
        field = self.flows[chosen["flow"]] if "flow" in chosen else flow
        try:
            return world_plan(apply_overrides(self.study, changes), field, threads=threads)
        except InputError as error:
            if not chosen:
                raise
            where = ", ".join(f"{name} = {value}" for name, value in chosen.items())
            raise InputError(f"at {where}: {error}") from error


def make_axes(study: Study, axes: Mapping[str, Any] | None) -> Axes:
    """Return the axes that a study names, or the given ones in their place.

    Parameters
    ----------
    study : Study
        Its [sensitivity] holds when `axes` is left out.
    axes : mapping, optional
        Values by the name of an axis; for ``flow`` the datasets by name, or files.

    Raises
    ------
    InputError
        When there is no such axis, or a value is out of range.
    """
    from driftwalk.model import apply_overrides
    from driftwalk.model.sensitivity import AXES

    flows: dict[str, xr.Dataset] = {}
    if axes is not None:
        unknown = [name for name in axes if name not in KEYS]
        if unknown or not axes:
            raise InputError(
                f"axes: there is no {', '.join(map(repr, unknown)) or '(none was named)'}; "
                f"choose from {', '.join(KEYS)}"
            )
        if isinstance(axes.get("flow"), Mapping):
            flows = dict(axes["flow"])
        given = {
            f"sensitivity.{key}": _plain(axes[name]) if name in axes else None
            for name, key in AXES.items()
        }
        try:
            study = apply_overrides(study, given)
        except ConfigurationError as error:
            raise InputError(f"axes: {error}") from error
    values = study.sensitivity.axes
    missing = [name for name in values.get("flow", ()) if name not in flows]
    return Axes(study, values, flows | {name: _load(name, study) for name in missing})


def _load(path: str, study: Study) -> xr.Dataset:
    from driftwalk.flow import load_flow

    return load_flow(path, arena=study.tank.to_arena(), own_flags="keep")


def _plain(values: Any) -> list[Any]:
    if isinstance(values, Mapping):
        return [str(name) for name in values]
    if isinstance(values, str):
        raise InputError(f"axes: expected a list of values, got '{values}'")
    return list(np.asarray(values).tolist())


def _array(values: tuple[Any, ...]) -> npt.NDArray[Any]:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)
