"""How far simulated worlds are from a recording: by the model itself, or world by world."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.comparison import Statistic, StepDistance, StepReference, StepTable, step_table
from driftwalk.comparison.statistic import BINS
from driftwalk.conditions.recorded import Conditions
from driftwalk.core.arrays import Bools, Floats, Keys, Singles
from driftwalk.motion.protocol import Details, MotionModel, Scores, ScoresItself, Values, Worlds
from driftwalk.simulation.backend import BROKEN


def score_worlds(
    model: MotionModel,
    values: Values,
    like: Conditions,
    keys: Keys,
    reference: StepReference,
    *,
    statistic: Statistic | None = None,
    details: Details = "none",
) -> Scores:
    """Simulate worlds and compare each with the recording.

    Parameters
    ----------
    model : MotionModel
        What is simulated.
    values : mapping of str to ndarray, shape (worlds,)
        The value of every parameter in every world.
    like : Conditions
        The conditions of the recording.
    keys : ndarray of uint64, shape (worlds,)
        The address of every world's random numbers.
    reference : StepReference
        The recording's steps.
    statistic : Statistic, optional
        The distance; default: `StepDistance`.
    details : {"none", "steps", "all"}
        What else to keep: nothing, the steps of every world, or its step density and the first 30
        seconds of its path.

    Returns
    -------
    dict of ndarray
        One entry per world each: ``ks_distance`` (1 for a world without motion or steps), its place
        ``ks_step_length`` [m], ``ks_turning_angle`` [rad] and ``ks_quadrant``, ``status``,
        ``pairs``; ``step_length``, ``turning_angle`` with the steps; ``step_density``,
        ``excerpt_x``, ``excerpt_y`` [m] with all.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import body_track
    >>> from driftwalk.simulation.backend import Camera
    >>> track = body_track(dw.tank30_recording().isel(time=slice(0, 600)))
    >>> block = dw.motion.BlockModel(dw.Study())
    >>> camera = Camera(position_noise=3e-4)
    >>> like = dw.conditions.recorded_conditions(
    ...     track, dw.Study(), camera=camera, flow=dw.tank30_flow()
    ... )
    >>> values = {"drag_coefficient": np.array([0.4]), "force_std": np.array([6e-4])}
    >>> reference = dw.comparison.StepDistance().prepare(track)
    >>> keys = np.array([1], dtype=np.uint64)
    >>> float(dw.motion.score_worlds(block, values, like, keys, reference)["ks_distance"][0]) < 0.3
    True
    """
    chosen = StepDistance() if statistic is None else statistic
    if isinstance(model, ScoresItself) and isinstance(chosen, StepDistance):
        return model.score(values, like, keys, reference, details=details)
    worlds = model.simulate(values, like, keys)
    table = step_table(reference.plan, worlds.x, worlds.y)
    # As in the core: what has no motion, or lost its numbers, is as far as can be.
    counted = table._replace(pairs=np.where(worlds.status == 0, table.pairs, 0))
    found = chosen.distances(reference, counted, threads=like.threads)
    scores: Scores = {
        "pairs": table.pairs,
        "status": worlds.status,
        "ks_distance": found.distance,
        "ks_step_length": found.step_length,
        "ks_turning_angle": found.turning_angle,
        "ks_quadrant": found.quadrant,
    }
    if details == "steps":
        scores |= {"step_length": table.length, "turning_angle": table.angle}
    if details == "all":
        first = excerpt_samples(like)
        scores |= {
            "step_density": step_densities(reference, table),
            "excerpt_x": worlds.x[:, :first].astype(np.float32),
            "excerpt_y": worlds.y[:, :first].astype(np.float32),
        }
    return scores


def broken_worlds(status: npt.NDArray[np.uint32]) -> Bools:
    """Return which worlds lost their numbers: they have no distance."""
    return np.asarray((status & BROKEN) != 0)


def excerpt_samples(like: Conditions) -> int:
    """Return the number of samples in the first 30 seconds."""
    return int(np.searchsorted(like.sample_time, 30.0, side="right"))


def step_densities(reference: StepReference, table: StepTable) -> Singles:
    """Return the share of each world's steps in every bin, (worlds, 32 lengths, 32 angles).

    The last bin of the lengths holds all longer steps, the outer bins of the angles all beyond.
    """
    density = np.zeros((table.pairs.size, BINS, BINS), dtype=np.float32)
    across = table.length / reference.length_limit * BINS
    around = (table.angle / reference.angle_limit + 1.0) * 0.5 * BINS
    row, column = (np.clip(place, 0.0, BINS - 1.0).astype(np.int64) for place in (across, around))
    for world, count in enumerate(table.pairs):
        counts = np.bincount(row[world, :count] * BINS + column[world, :count], minlength=BINS**2)
        density[world] = counts.reshape(BINS, BINS) / np.float32(max(count, 1))
    return density


class NativeModel(ABC):
    """A motion model that the native core simulates and scores: the block, and the family."""

    # Of the latest conditions: made once for all work units of a map or a search.
    _ready: tuple[Conditions, _core.Model, Floats | None] | None = None

    @abstractmethod
    def _worlds(
        self, values: Values, like: Conditions, keys: Keys
    ) -> tuple[Floats, _core.Particle | None]:
        """Return starts and numbers of worlds, one row each, and what all have in common."""

    @abstractmethod
    def _native(self, like: Conditions) -> tuple[_core.Model, Floats | None]:
        """Return the core's form of the conditions, and where other bodies are at every step."""

    def simulate(self, values: Values, like: Conditions, keys: Keys) -> Worlds:
        """Return one world per key; see `MotionModel.simulate`.

        Raises
        ------
        InputError
            When the water carries the body and the conditions have no flow, or it feels other
            bodies and there are none.
        """
        worlds, particle = self._worlds(values, like, keys)
        x, y, theta, status = _core.simulate(
            self.native(like),
            worlds,
            keys,
            threads=like.threads,
            precision="single",
            particle=particle,
            flow_start=like.flow_start,
        )
        return Worlds(x, y, theta, status)

    def score(
        self,
        values: Values,
        like: Conditions,
        keys: Keys,
        reference: StepReference,
        *,
        details: Details = "none",
    ) -> Scores:
        """Return how far every world is from the recording; see `score_worlds`.

        Raises
        ------
        InputError
            As `simulate`.
        """
        worlds, particle = self._worlds(values, like, keys)
        full = details == "all"
        return dict(
            _core.score(
                self.native(like),
                worlds,
                keys,
                left=reference.plan.left,
                weight=reference.plan.weight,
                triple=reference.plan.triple,
                reference=reference.steps,
                bins=BINS if full else 0,
                length_limit=reference.length_limit,
                angle_limit=reference.angle_limit,
                excerpt=excerpt_samples(like) if full else 0,
                keep_steps=details == "steps",
                threads=like.threads,
                particle=particle,
                flow_start=like.flow_start,
            )
        )

    def native(self, like: Conditions) -> _core.Model:
        """Return the core's form of the model under the conditions of a recording.

        Raises
        ------
        InputError
            As `simulate`, or when the grid of the flow is too fine for the tank.
        """
        return self._made_ready(like)[1]

    def _made_ready(self, like: Conditions) -> tuple[Conditions, _core.Model, Floats | None]:
        ready = self._ready
        if ready is None or ready[0] is not like:
            ready = self._ready = (like, *self._native(like))
        return ready

    def __getstate__(self) -> dict[str, Any]:
        """Leave the core's form out: it is made again where the model is used."""
        return {**self.__dict__, "_ready": None}
