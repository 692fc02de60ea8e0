"""Summaries of simulated recordings: of the whole, and of the blocks of time that are searched."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from driftwalk.calibration.evolution import AspectObjective, wall_distance
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.summaries import SummaryPlan, plan_summaries, summarise
from driftwalk.comparison.aspects import block_of
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.processors import map_in_threads, one_blas_thread
from driftwalk.core.run_stages import Progress
from driftwalk.motion.score import broken_worlds
from driftwalk.sweep import Store, WorkUnit, run_sweep, work_units

ALIKE: Final = 16
"""Settings in a row that are seen by one camera. So many points of a Sobol' sequence fill a box."""
POINT: Final = "point"
"""Settings of a unit, in the unit cube; they travel with it."""


class SummaryObjective:
    """Simulates settings of a model and summarises what the camera saw.

    Where the noise of the camera is not known but estimated, simulated cameras have the noises that
    it may have. Their effect on the summaries becomes part of their covariance, as if the noise
    were one more parameter, with the estimate for its prior.

    Parameters
    ----------
    worlds : AspectObjective
        The model, its ranges and its conditions.
    motion : RecordedMotion
        The recording.
    store : Store or None
        Where finished work is kept; None keeps nothing.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, with one thread each.
    tell : callable
        Called with the settings done and the largest number of them.
    most : int
        That number.

    Attributes
    ----------
    recorded : ndarray, shape (2, summaries)
        Summaries of the whole recording, and of its even blocks of time.
    """

    def __init__(
        self,
        worlds: AspectObjective,
        motion: RecordedMotion,
        *,
        store: Store | None,
        executor: Executor | None = None,
        tell: Progress,
        most: int,
    ) -> None:
        self.worlds, self.store, self.tell, self.most = worlds, store, tell, most
        self._executor = executor
        # Units of an executor have one thread each.
        like = worlds.like if executor is None else replace(worlds.like, threads=1)
        self._cameras = [
            replace(worlds, like=replace(like, camera=replace(like.camera, position_noise=noise)))
            for noise in motion.noises
        ]
        self.done = 0

        def all_of(time: Floats) -> Bools:
            return np.ones(time.shape, dtype=bool)

        def even(time: Floats) -> Bools:
            return np.asarray(block_of(time, motion.duration) % 2 == 0)

        wall, scale = wall_distance(worlds.like), {"unit": motion.usual_step, "depth": motion.depth}
        recorded, simulated = (
            [plan_summaries(plan, wall=wall, counts=counts, **scale) for counts in (all_of, even)]
            for plan in (motion.own_plan, motion.plan)
        )
        self.plans = simulated
        self.recorded = np.array([summarise(one, *motion.track[1:3]) for one in recorded])

    def __call__(self, settings: Floats, *, parts: int = 1) -> Floats:
        """Return the summaries of settings in the unit cube, shape (settings, parts, summaries)."""
        first = self.done
        units = work_units({POINT: settings}, ALIKE, first=first)
        function = _Summaries(self._cameras, self.plans[:parts])

        def say(done: int, _: int) -> None:
            self.tell(first + done, self.most)

        found = run_sweep(function, units, store=self.store, executor=self._executor, progress=say)[
            "summaries"
        ]
        self.done += len(settings)
        return np.asarray(found)


@dataclass(frozen=True)
class _Summaries:
    """The function of the sweep: the settings of a unit, summarised wherever it is sent."""

    cameras: Sequence[AspectObjective]
    plans: Sequence[SummaryPlan]
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, Floats]:
        camera = self.cameras[unit.start // ALIKE % len(self.cameras)]
        seen = camera.simulated(unit.settings[POINT], 1, stage="estimation", first=unit.start)

        def one(world: tuple[Floats, Floats]) -> list[Floats]:
            return [summarise(plan, *world) for plan in self.plans]

        with one_blas_thread():
            found = np.array(
                map_in_threads(one, zip(seen.x, seen.y, strict=True), camera.like.threads)
            )
        # A world that lost its numbers is like none.
        found[broken_worlds(seen.status)] = 0.0
        return {"summaries": found}
