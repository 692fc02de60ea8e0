"""The recordings of known truth: two bundled, four of the other engine of studies/likelihood."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import driftwalk as dw

LIKELIHOOD = Path(__file__).resolve().parents[1] / "likelihood"
sys.path.append(str(LIKELIHOOD))

from ode import PROGRAM, WALL_FRICTION, build_ode  # noqa: E402
from study_sets import cases_of, keep_motion, load_motion, record  # noqa: E402

if TYPE_CHECKING:
    import xarray as xr

ODE_WORLDS = 4
"""The first ones of the set `ode`, two of each family of flows."""


@dataclass(frozen=True)
class Known:
    """A recording with what made it."""

    name: str
    recording: xr.Dataset
    flow: xr.Dataset
    drag_coefficient: float
    force_std_N: float
    tracking_noise_m: float
    overrides: dict[str, Any]
    """What is given to every method: force interval and wall."""

    @property
    def study(self) -> dw.Study:
        """Return the study of this recording."""
        return dw.apply_overrides(dw.Study(), self.overrides)


def recordings(motions: Path) -> Iterator[Known]:
    """Yield the recordings; motions of the other engine that the folder lacks are simulated."""
    yield from bundled()
    cases = cases_of("ode", ODE_WORLDS)
    if not all((motions / case.file).exists() for case in cases):
        motions.mkdir(parents=True, exist_ok=True)
        if not (motions / PROGRAM).exists():
            build_ode(motions)
    for case in cases:
        keep_motion(case, motions)
        world, poses = load_motion(motions / case.file)
        yield Known(
            f"ode-{case.number:03d}",
            record(case, poses),
            world.flow(),
            world.drag_coefficient,
            world.force_std_N,
            case.condition.camera.position_m,
            {"tank.wall_friction": WALL_FRICTION},
        )


def bundled() -> Iterator[Known]:
    """Yield the two recordings that come with driftwalk."""
    truth = dw.tank30_truth()
    overrides = {
        "forces.force_interval_s": truth["force_interval_s"],
        "tank.wall_friction": truth["wall_friction"],
    }
    for name, realisation in (("tank30", "first"), ("tank30, second", "second")):
        yield Known(
            name,
            dw.tank30_recording(realisation),
            dw.tank30_flow(),
            truth["drag_coefficient"],
            truth["force_std_N"],
            truth["tracking_noise_m"],
            overrides,
        )
