"""Refined maps of a problem, each kept in a store of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.estimation import Stores
from driftwalk.calibration.grid.grid_map import Map, Progress, add_replicates, run_map
from driftwalk.calibration.problem import Axes, Problem
from driftwalk.core.run_stages import MORE
from driftwalk.motion import Details
from driftwalk.sweep import Store


@dataclass(frozen=True)
class MapSimulator:
    """Simulates the maps of one stage.

    Attributes
    ----------
    problem : Problem
        The recording and the model.
    stage : str
        Name of the stage; its random streams are its own.
    details : {"none", "all"}
        Whether densities and excerpts are kept.
    apart : bool
        Whether the distance between replicates of a setting is measured.
    stores : callable, optional
        Where finished work units are kept; memory when left out.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere.
    progress : callable, optional
        Called with the number of finished settings and the total.
    """

    problem: Problem
    stage: str
    details: Details = "none"
    apart: bool = True
    stores: Stores | None = None
    executor: Executor | None = None
    progress: Progress | None = None

    def full(self, axes: Axes, replicates: int) -> Map:
        """Simulate every setting of a grid."""
        return run_map(
            self.problem,
            axes,
            stage=self.stage,
            replicates=replicates,
            details=self.details,
            apart=self.apart,
            store=self._store(self.stage, axes, {"replicates": replicates}),
            executor=self.executor,
            progress=self.progress,
        )

    def more(self, found: Map, chosen: npt.NDArray[np.bool_], replicates: int) -> Map:
        """Give some settings of a map more replicates."""
        facts = {"replicates": replicates, "chosen": np.flatnonzero(chosen).tolist()}
        return add_replicates(
            self.problem,
            found,
            chosen,
            stage=self.stage,
            replicates=replicates,
            details=self.details,
            apart=self.apart,
            store=self._store(f"{MORE}{self.stage}", found.axes, facts),
            executor=self.executor,
            progress=self.progress,
        )

    def _store(self, name: str, axes: Axes, facts: dict[str, object]) -> Store | None:
        if self.stores is None:
            return None
        fingerprint = {"axes": [axis.tolist() for axis in axes], **facts}
        return self.stores(f"{name}-{window_id(axes)}", fingerprint)


class SweepProgress:
    """Progress through sweeps that follow each other.

    Parameters
    ----------
    say : callable
        Called with how much is done, of `1000`.
    share_of : callable
        Returns how much of all is done, from the share of each sweep that has begun: `share_of_map`
        or `share_of_windows`.

    Examples
    --------
    >>> from driftwalk.core.run_stages import share_of_windows
    >>> shares = []
    >>> narrowing = SweepProgress(lambda done, total: shares.append(done / total), share_of_windows)
    >>> for done in (5, 10, 5, 10):
    ...     narrowing(done, 10)
    >>> shares
    [0.25, 0.5, 0.625, 0.75]
    """

    def __init__(self, say: Progress, share_of: Callable[[Sequence[float]], float]) -> None:
        self._say, self._share_of, self._finished = say, share_of, 0

    def __call__(self, done: int, total: int) -> None:
        """Tell how much is done when so many settings of a sweep are."""
        share = self._share_of([*[1.0] * self._finished, done / max(total, 1)])
        self._finished += done >= total
        self._say(round(1000 * share), 1000)


def window_id(window: Axes) -> str:
    """Name a grid by its ends and sizes, so that a moved window has a store of its own."""
    ends = [f"{axis[0]:.6g}-{axis[-1]:.6g}-{axis.size}" for axis in window]
    return "x".join(ends).replace(".", "p").replace("+", "")
