"""Simulated runs at nodes of the parameters: what the emulator learns from, and is tested with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.assembly.outcome_posterior.records import (
    Record,
    records_from_text,
    records_of_events,
    records_to_text,
)
from driftwalk.assembly.runs.dataset import times_of
from driftwalk.assembly.sensitivity.settings import (
    OF_EACH_RUN,
    Piece,
    Settings,
    make_settings,
    simulate_pieces,
    sweep_texts,
    world_plan,
)
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.study_keys import INFERRED_KEYS
from driftwalk.simulation.backend import BROKEN
from driftwalk.sweep import Store, WorkUnit, grid, settings_per_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True, eq=False)
class Nodes:
    """Runs at some values of the parameters; a work unit is a few nodes.

    Attributes
    ----------
    study : Study
        With the number of runs, their duration and their seed in its [sensitivity] and [assembly].
    flow : xarray.Dataset
        The flow field.
    names : sequence of str
        Parameters that vary, keys of `INFERRED_KEYS`.
    value : ndarray, shape (node, parameter)
        Their values, SI.
    first_trial : int
        Address of the random numbers of the first node.
    threads : int or None
        Threads of a call.
    """

    study: Study
    flow: xr.Dataset
    names: Sequence[str]
    value: Floats
    first_trial: int
    threads: int | None = None

    def __call__(self, unit: WorkUnit) -> Arrays:
        """Return the records of the runs of each node of a unit, as text."""
        settings = self.settings(range(unit.start, unit.stop))
        texts = [""] * settings.size
        for number, plan in enumerate(settings.worlds):
            same = np.flatnonzero(settings.world == number).tolist()
            pieces = [Piece(at, range(plan.index.size)) for at in same]
            found, classes = simulate_pieces(plan, settings, pieces)
            sound = (found["status"].astype(np.int64) & BROKEN) == 0
            time = times_of(found["event_step"], time_step=plan.study.time_step_s)
            for place, at in enumerate(same):
                mine = np.flatnonzero(sound) // plan.index.size == place
                rows = np.flatnonzero(sound)[mine]
                texts[at] = records_to_text(
                    records_of_events(
                        time[rows], found["event_class"][rows], classes,
                        blocks=plan.study.assembly.blocks, end=self.study.assembly.duration_s,
                    )
                )  # fmt: skip
        return {"records": np.array(texts, dtype=object)}

    def settings(self, rows: range) -> Settings:
        """Return some nodes as settings of a map.

        Raises
        ------
        InputError
            When the blocks of a node have no room, or its flow does not cover the tank.
        """
        from driftwalk.model import apply_overrides

        value = self.value[rows.start : rows.stop]
        column = dict(zip(self.names, value.T, strict=True))
        apart = {
            INFERRED_KEYS[name]: column[name] for name in self.names if name not in OF_EACH_RUN
        }
        studies = [self.study]
        if apart:
            studies = [
                apply_overrides(self.study, {key: float(row[at]) for key, row in apart.items()})
                for at in range(len(value))
            ]
        worlds = [world_plan(one, self.flow, threads=self.threads) for one in studies]
        world = np.arange(len(value)) if apart else np.zeros(len(value), dtype=np.int64)
        along = {name: column[name] for name in self.names if name in OF_EACH_RUN}
        return make_settings(worlds, world, first_trial=self.first_trial + rows.start, **along)

    def simulate(
        self,
        *,
        store: Store | None = None,
        progress: Callable[[int, int], None] | None = None,
        executor: Executor | None = None,
    ) -> list[list[Record]]:
        """Simulate all nodes, skipping what a store holds already.

        Raises
        ------
        InputError
            When the blocks of a run find no place in the tank, or no run of a node is sound.
        """
        assembly = self.study.assembly
        steps = self.study.sensitivity.runs * assembly.duration_s / self.study.time_step_s
        nodes = len(self.value)
        units = grid(node=np.arange(nodes)).units(settings_per_unit(nodes, steps * assembly.blocks))
        found = sweep_texts(self, units, store=store, progress=progress, executor=executor)
        records = [records_from_text(text) for text in found["records"].tolist()]
        if not all(records):
            raise InputError("all runs of a node broke down: use a smaller time step")
        return records
