"""Modes of agitation: settings of the pumps, each a flow, its strength and a stochastic force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from driftwalk.assembly.runs.draws import draw_parameters
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

DRAWS = 100
"""Draws from the uncertainty of a fit, one turn of worlds after the other; chosen by hand."""
MOST_MODES = 100
"""Modes, at most: each needs separate runs. Chosen by hand."""


class ModeSource(NamedTuple):
    """One recording's model: a setting of the pumps."""

    study: Study
    flow: xr.Dataset
    uncertainty: xr.Dataset | None = None
    """The `fit` or `calibration` that parameters are drawn from; None where there is none."""
    name: str = ""


@dataclass(frozen=True)
class Modes:
    """The modes that a policy chooses from.

    Attributes
    ----------
    study : Study
        Tank, block, water and assembly, the same in all of them.
    flows : tuple of xarray.Dataset
        Flow fields.
    name : tuple of str
        Name of each mode.
    flow : ndarray of int, shape (mode,)
        Its flow.
    flow_scale : ndarray, shape (mode,)
        Factor on the flow.
    force_std : ndarray, shape (mode, draw)
        sigma_F [N]; the first is the estimate.
    drag_coefficient : ndarray, shape (mode, draw)
        C_d; the first is the estimate.
    """

    study: Study
    flows: tuple[xr.Dataset, ...]
    name: tuple[str, ...]
    flow: Integers
    flow_scale: Floats
    force_std: Floats
    drag_coefficient: Floats

    @property
    def size(self) -> int:
        """Number of modes."""
        return len(self.name)

    def settings(
        self, mode: Integers, draw: Integers, *, force_factor: float = 1.0
    ) -> dict[str, Floats | Integers]:
        """Return what `TankBatch.set` takes, for worlds in a mode each.

        Parameters
        ----------
        mode, draw : ndarray of int
            Mode of each world, and number of its draw, whatever its mode; the first draw comes
            again after the last.
        force_factor : float
            On sigma_F, to try a model that is wrong.
        """
        draw = draw % self.force_std.shape[1]
        return {
            **({"flow": self.flow[mode]} if len(self.flows) > 1 else {}),
            "flow_scale": self.flow_scale[mode],
            "force_std": force_factor * self.force_std[mode, draw],
            "drag_coefficient": self.drag_coefficient[mode, draw],
        }


def make_modes(
    sources: Sequence[ModeSource],
    *,
    flow_scales: Sequence[float] = (1.0,),
    force_stds: Sequence[float] = (),
    seed: int = 1,
) -> Modes:
    """Return the modes of fits, or of one fit with a grid of strengths.

    Parameters
    ----------
    sources : sequence of ModeSource
        One for each setting of the pumps.
    flow_scales : sequence of float
        Factors on every flow.
    force_stds : sequence of float
        Values of sigma_F [N] in place of the estimates, whose relative uncertainty they have.
    seed : int
        Of the draws.

    Raises
    ------
    InputError
        When the tanks, blocks or force laws differ, there is only one mode, or a value is out of
        range.

    Examples
    --------
    >>> import driftwalk as dw
    >>> one = ModeSource(dw.Study(), dw.tank30_flow())
    >>> make_modes([one], flow_scales=[0.5, 1.0], force_stds=[2e-4]).name
    ('flow x 0.5, 0.2 mN', 'flow x 1, 0.2 mN')
    """
    if not sources:
        raise InputError("no mode is given: name fits, or a flow with strengths to vary")
    first = sources[0].study
    for one in sources:
        _require_same(sources[0], one)
    if any(not 0.0 <= scale < math.inf for scale in flow_scales):
        raise InputError(f"flow-scale must be numbers from 0 on, got {list(flow_scales)}")
    if any(not 0.0 <= force < math.inf for force in force_stds):
        raise InputError(f"force-std must be numbers from 0 N on, got {list(force_stds)}")
    rows = list(product(range(len(sources)), flow_scales, force_stds or (None,)))
    if not 2 <= len(rows) <= MOST_MODES:
        raise InputError(
            f"control needs 2 to {MOST_MODES} modes, got {len(rows)}: name more fits, or vary "
            "flow-scale and force-std"
        )
    draws = [_draws(one, seed) for one in sources]
    count = max(force.size for force, _ in draws)
    force, drag = np.empty((2, len(rows), count))
    names = []
    for at, (source, scale, std) in enumerate(rows):
        own = sources[source].study.forces.force_std_N
        # A stated force keeps the relative uncertainty of the estimate. A source with fewer draws
        # than another repeats them.
        ratio = np.resize(draws[source][0], count) / (own or 1.0)
        drawn = own * ratio if own else np.resize(draws[source][0], count)
        force[at] = drawn if std is None else std * (ratio if own else 1.0)
        drag[at] = np.resize(draws[source][1], count)
        words = [sources[source].name or ("flow" if len(sources) == 1 else f"flow {source + 1}")]
        if len(flow_scales) > 1:
            words[0] += f" x {scale:g}"
        names.append(", ".join([*words, *([] if std is None else [f"{1e3 * std:g} mN"])]))
    if len(set(names)) < len(names):
        raise InputError(f"two modes have the same name: {', '.join(names)}")
    return Modes(
        first,
        tuple(one.flow for one in sources),
        tuple(names),
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        force,
        drag,
    )


def _draws(source: ModeSource, seed: int) -> tuple[Floats, Floats]:
    """Return sigma_F [N] and C_d, the estimate first and then draws where there are any."""
    forces = source.study.forces
    force, drag = np.array([forces.force_std_N]), np.array([forces.drag_coefficient])
    if source.uncertainty is None:
        return force, drag
    drawn = draw_parameters(source.uncertainty, runs=DRAWS - 1, seed=seed, trial=0)
    return np.r_[force, drawn.force_std], np.r_[drag, drawn.drag_coefficient]


def _require_same(one: ModeSource, other: ModeSource) -> None:
    """Refuse modes that are not settings of one tank with one kind of block."""
    names = [source.name or "a mode" for source in (one, other)]
    tanks = [source.study.tank for source in (one, other)]
    if tanks[0].to_arena() != tanks[1].to_arena():
        raise InputError(
            f"the modes have different tanks: {names[0]} {tanks[0].describe()}, {names[1]} "
            f"{tanks[1].describe()}; fit recordings of one tank"
        )
    if "time" in other.flow.dims:
        raise InputError(f"the flow of {names[1]} changes in time: control needs steady ones")
    if any(not np.array_equal(one.flow[axis], other.flow[axis]) for axis in "xy"):
        raise InputError(f"the flows of {names[0]} and {names[1]} have different nodes")
    free = {"drag_coefficient": 0.0, "force_std_N": 0.0}
    for section in ("block", "water", "forces", "assembly", "interaction"):
        ours, theirs = (getattr(source.study, section).model_dump() for source in (one, other))
        for key in ours:
            if key not in free and ours[key] != theirs[key]:
                raise InputError(
                    f"the modes differ in [{section}] {key}: {names[0]} has {ours[key]}, "
                    f"{names[1]} {theirs[key]}; only flow, C_d and sigma_F may differ"
                )
