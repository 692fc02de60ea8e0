"""The calibrated block of a run: its study, its flow, and what another simulator needs of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.export.target import Source

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


TAKEN: Final = (
    "give the run directory of `driftwalk calibrate` or `driftwalk fit`, or a study file with a "
    "flow field (`flow`)"
)


@dataclass(frozen=True)
class Block:
    """A block that floats in a stirred tank, with its estimates.

    Attributes
    ----------
    study : Study
        With the estimated drag coefficient and force, and with the seed of the export.
    flow : xarray.Dataset
        The flow field, steady.
    origin : str
        Where it is from, in words.
    """

    study: Study
    flow: xr.Dataset
    origin: str

    @property
    def seed(self) -> int:
        """Seed of the stochastic force."""
        return self.study.simulation.seed

    @property
    def step_s(self) -> float:
        """Time step for another simulator [s]; it divides the force interval."""
        interval = self.study.forces.force_interval_s
        # The contacts of another simulator are soft and need a short step.
        return interval / math.ceil(interval / 2e-3 - 1e-9)

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of the model, units in the keys."""
        study = self.study
        forces = study.forces
        if study.block.shape != "square":
            raise InputError(
                f"a simulator is given the square block, and the body is '{study.block.shape}' "
                "(`block.shape`): driftwalk simulate knows it"
            )
        return {
            "side_m": study.block.side_m,
            "mass_kg": study.block.mass_kg,
            "inertia_kg_m2": study.block.inertia_kg_m2,
            "added_mass_share": forces.added_mass_share,
            "wetted_depth_m": study.wetted_depth_m,
            "strips_per_face": study.block.strips_per_face,
            "water_density_kg_m3": study.water.density_kg_m3,
            "drag_coefficient": forces.drag_coefficient,
            "linear_drag_kg_s": forces.linear_drag_kg_s,
            "drag_power": forces.drag_power,
            "drag_speed_m_s": forces.drag_speed_m_s,
            "displaced_mass_kg": study.displaced_mass_kg if forces.pressure_gradient else 0.0,
            "force_std_N": forces.force_std_N,
            "force_interval_s": forces.force_interval_s,
            "force_memory_s": forces.force_memory_s,
            "time_step_s": study.time_step_s,
            "seed": self.seed,
        }

    def nodes(self) -> dict[str, Floats]:
        """Return the nodes of the flow as driftwalk's kernels hold them: in 16 bits.

        Velocity, and with the push of water that accelerates (u . grad) u.
        """
        x, y, u, v = (
            np.asarray(self.flow[name].values, dtype=np.float64) for name in ("x", "y", "u", "v")
        )
        found = {"x_m": x, "y_m": y, **_rounded({"u_m_s": u, "v_m_s": v})}
        if self.study.forces.pressure_gradient:
            dx, dy = ((axis[-1] - axis[0]) / (axis.size - 1) for axis in (x, y))
            found |= _rounded(
                {
                    name: u * np.gradient(part, dx, axis=1) + v * np.gradient(part, dy, axis=0)
                    for name, part in (("ax_m_s2", u), ("ay_m_s2", v))
                }
            )
        return found


def _rounded(nodes: dict[str, Floats]) -> dict[str, Floats]:
    # 16 bits from 0 to the largest number, as in driftwalk's kernels.
    step = max(float(np.abs(values).max()) for values in nodes.values()) / 32767 or 1.0
    return {name: np.round(values / step) * step for name, values in nodes.items()}


def read_block(source: Source) -> Block:
    """Read the block of a run directory, or of a study file with a flow.

    Parameters
    ----------
    source : Source
        What the user named.

    Raises
    ------
    InputError
        When it holds no calibrated block in a steady flow; in a sentence that says what can be
        exported.

    Examples
    --------
    >>> import driftwalk as dw
    >>> read_block(Source(Path("run"))).origin  # doctest: +SKIP
    'the calibration in run'
    """
    from driftwalk.model import apply_overrides
    from driftwalk.simulation.backend import Camera, native_model

    study, flow, origin = _read(source)
    if source.seed is not None:
        study = apply_overrides(study, {"simulation.seed": source.seed})
    if "time" in flow["u"].dims:
        raise InputError(
            f"the flow of {origin} changes in time, and an export has one steady flow: name the "
            "flow field of one interval (`flow`)"
        )
    # Its checks of flow and tank are those of a simulation.
    native_model(study, flow, np.zeros(1), Camera())
    return Block(study, flow, origin)


def _read(source: Source) -> tuple[Study, xr.Dataset, str]:
    if source.path.is_dir():
        return _of_run(source)
    if not source.path.exists():
        raise InputError(f"{source.path} does not exist: {TAKEN}")
    if source.path.suffix.lower() != ".toml":
        raise InputError(f"{source.path} is no study file (.toml) and no run directory: {TAKEN}")
    from driftwalk.model import load_study

    study = load_study(source.path)
    if source.flow is None:
        raise InputError(f"{source.path} says no flow of the water: give a flow field (`flow`)")
    return study, _flow(source.flow, study), f"the study {source.path.name}"


def _of_run(source: Source) -> tuple[Study, xr.Dataset, str]:
    from driftwalk.runs import read_found

    found = read_found(source.path, give=TAKEN)
    study = found.block_study(why=f"another simulator gets the block in stirred water: {TAKEN}")
    origin = f"the {found.words} in {source.path.resolve().name}"
    if source.flow is not None:
        return study, _flow(source.flow, study), origin
    flow, lacks = found.mean_flow(study)
    if lacks is not None:
        source.tell(lacks)
        origin += ", with its mean flow"
    return study, flow, origin


def _flow(path: Path, study: Study) -> xr.Dataset:
    from driftwalk.flow import load_flow

    return load_flow(path, arena=study.tank.to_arena(), own_flags="keep")
