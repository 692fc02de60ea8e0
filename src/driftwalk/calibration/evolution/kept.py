"""A search that resumes: what each of its calls gave is kept, and read when it is made again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from driftwalk.calibration.evolution.search import Floats, Objective
from driftwalk.sweep import Store, WorkUnit, run_sweep


@dataclass(frozen=True, eq=False)
class CachedObjective:
    """An objective that computes nothing twice.

    A search asks for the same settings in the same order whenever it is run, so a call is known by
    the numbers of its evaluations.

    Attributes
    ----------
    objective : callable
        Scores of settings, see `search_minimum`.
    store : Store or None
        Where they are kept; None keeps nothing.

    Examples
    --------
    >>> from driftwalk.sweep import MemoryStore
    >>> retained = CachedObjective(lambda settings, *_: settings.sum(axis=1), MemoryStore())
    >>> retained(np.array([[0.25, 0.5]]), 0, 2).tolist()
    [0.75]
    """

    objective: Objective
    store: Store | None

    def __call__(self, settings: Floats, first: int, replicates: int) -> Floats:
        """Return the scores of settings, shape (settings,)."""
        unit = WorkUnit(first, first + len(settings), {})

        def compute(_: WorkUnit) -> dict[str, Floats]:
            return {"score": np.asarray(self.objective(settings, first, replicates))}

        return np.asarray(run_sweep(compute, [unit], store=self.store)["score"])
