"""A recovery study: recordings of known truth, simulated and estimated one by one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import RecoveryStream
from driftwalk.core.seeds import world_keys
from driftwalk.model import Study
from driftwalk.schema.kinds.recovery import ESTIMATED, NOT_ESTIMATED, NOT_SIMULATED
from driftwalk.sweep import Design, Store, WorkUnit, run_sweep

if TYPE_CHECKING:
    import xarray as xr

Tell = Callable[[int, int, str], None]
"""Called with what is done, all of it, and the work under way."""

RecordingT = TypeVar("RecordingT")


class BrokenSimulation(InputError):
    """One recording cannot be simulated, by chance: the study goes on with the others."""


@dataclass(frozen=True)
class EstimationMethod(ABC, Generic[RecordingT]):
    """A way to estimate parameters, and a study that says how its recordings are simulated.

    A sweep calls it with one setting at a time, on whichever worker computes it.
    """

    study: Study

    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""
    kind: ClassVar[str]
    """Kind of the dataset."""
    work: ClassVar[str]
    """Word for the recordings that are done."""
    parts: ClassVar[int] = 1
    """Parts of a recording in which progress is counted."""

    def sweep(self, store: Store | None, executor: Executor | None, tell: Tell) -> xr.Dataset:
        """Simulate and estimate all recordings, and return the dataset of the study."""
        self.check()
        design = self.design()

        def told(done: int, total: int) -> None:
            tell(self.parts * done, self.parts * total, self.work)

        units = design.units(1)
        found = run_sweep(self, units, store=store, executor=executor, progress=told)
        return self.dataset(design.unstack(found))

    @abstractmethod
    def design(self) -> Design:
        """Return the settings of the recordings."""

    @abstractmethod
    def dataset(self, found: Mapping[str, Any]) -> xr.Dataset:
        """Return the dataset of the study, from arrays with the dimensions of the design."""

    @abstractmethod
    def check(self) -> None:
        """Raise what forbids the whole study."""

    @abstractmethod
    def simulate(self, setting: Mapping[str, Any]) -> RecordingT:
        """Return what the camera records in a setting, or raise `BrokenSimulation`."""

    @abstractmethod
    def estimate(self, recording: RecordingT, setting: Mapping[str, Any]) -> dict[str, Any]:
        """Return the estimates of a recording, or raise `InputError`."""

    @abstractmethod
    def missing(self) -> dict[str, Any]:
        """Return what stands in place of the estimates of a recording that has none."""

    def __call__(self, unit: WorkUnit) -> dict[str, Any]:
        """Simulate and estimate the recording of a work unit; each array has one entry."""
        setting = {name: values[0] for name, values in unit.settings.items()}
        status, message = ESTIMATED, ""
        try:
            recording = self.simulate(setting)
        except BrokenSimulation as error:
            found, status, message = self.missing(), NOT_SIMULATED, str(error)
        else:
            try:
                found = self.estimate(recording, setting)
            except InputError as error:
                found, status, message = self.missing(), NOT_ESTIMATED, str(error)
        return {
            **{name: np.asarray(value)[None] for name, value in found.items()},
            "status": np.array([status], dtype=np.int32),
            "message": np.array([message[:400]], dtype="U400"),
        }

    def seed_of(self, recording: int, stream: RecoveryStream) -> int:
        """Return the seed of a stream of random numbers of a recording."""
        seed = self.study.recover.seed
        return int(world_keys(seed, trial=recording, replicate=stream)[0] >> np.uint64(1))

    def clock(self, duration: float) -> Floats:
        """Return the time stamps of a recording of this length [s]."""
        interval = self.study.recover.sample_interval_s
        samples = math.floor(duration / interval + 1e-6) + 1
        return np.asarray(np.arange(samples) * interval, np.float64)

    def missed(self, recording: int, samples: int, tracks: int = 1) -> Bools:
        """Return which samples the camera misses, shape (samples, tracks).

        A longer recording of the same number misses the same samples at first.
        """
        generator = np.random.default_rng(self.seed_of(recording, RecoveryStream.GAPS))
        return np.asarray(
            generator.random((samples, tracks)) < self.study.recover.missing_share, np.bool_
        )
