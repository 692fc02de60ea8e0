"""A recovery study: recordings of known truth, simulated and estimated one by one."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, NamedTuple, TypeVar

import numpy as np

from driftwalk.calibration.estimation.identifiability import DETERMINED, relative_half_width
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.core.intervals import proportion_interval
from driftwalk.core.progress import Progress
from driftwalk.core.random_streams import RecoveryStream, world_keys
from driftwalk.model import Study
from driftwalk.schema import Parameter
from driftwalk.schema.kinds.recovery import ESTIMATED, NOT_ESTIMATED, NOT_SIMULATED
from driftwalk.sweep import SweepStudy, WorkUnit

if TYPE_CHECKING:
    import xarray as xr


Tell = Callable[[int, int, str], None]
"""Called with what is done, all of it, and the work under way."""

RecordingT = TypeVar("RecordingT")


class BrokenSimulation(InputError):
    """One recording cannot be simulated, by chance: the study goes on with the others."""


@dataclass(frozen=True)
class EstimationMethod(SweepStudy["xr.Dataset"], Generic[RecordingT]):
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

    def counted(self, tell: Tell) -> Progress:
        """Return a progress that counts the parts of recordings."""
        return lambda done, total: tell(self.parts * done, self.parts * total, self.work)

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
            "message": np.array([message], dtype=object),
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


COVERAGE_CONFIDENCE: Final = 0.95
"""Confidence of the Clopper-Pearson interval of a coverage; by convention."""


class Summary(NamedTuple):
    """Summary of one parameter over recordings that were made alike."""

    median_absolute_error: float
    """Median of the size of the relative error."""
    absolute_error_90: float
    """Size of the relative error that 90 % of the recordings stay within."""
    bias: float
    """Mean relative error."""
    rms_error: float
    """Root mean square of ln(estimate / truth): chance and bias together."""
    spread: float
    """Standard deviation of ln(estimate) over the recordings."""
    rms_z: float
    """Root mean square of the error in stated standard deviations; 1 if these are right."""
    coverage: float
    """Share of the intervals that hold the truth."""
    coverage_low: float
    """Lower end of the coverage's own interval."""
    coverage_high: float
    """Its upper end."""


def summarise(error: Floats, z: Floats, covered: Floats) -> Summary:
    """Return the summary of recordings.

    Examples
    --------
    >>> error = np.array([-0.1, 0.2])
    >>> found = summarise(error, error / 0.1, np.array([1.0, 0.0]))
    >>> round(found.bias, 3), found.coverage, round(found.rms_z, 3)
    (0.05, 0.5, 1.581)
    """
    if error.size == 0:
        return Summary(*[np.nan] * len(Summary._fields))
    low, high = proportion_interval(covered.sum(), covered.size, confidence=COVERAGE_CONFIDENCE)
    return Summary(
        median_absolute_error=float(np.median(np.abs(error))),
        absolute_error_90=float(np.quantile(np.abs(error), 0.9)),
        bias=float(error.mean()),
        rms_error=float(np.sqrt(np.mean(np.log1p(error) ** 2))),
        spread=float(np.log1p(error).std(ddof=1)) if error.size >= 2 else np.nan,
        rms_z=float(np.sqrt(np.mean(z**2))),
        coverage=float(covered.mean()),
        coverage_low=float(low),
        coverage_high=float(high),
    )


def relative_errors(
    estimate: Floats, truth: Floats, ranges: Floats, scales: Sequence[str]
) -> Floats:
    """Return the errors of estimates, shape (recordings, parameters).

    Examples
    --------
    >>> bounds = np.array([[[-5.0, 5.0]]])
    >>> relative_errors(np.array([[0.2]]), np.array([0.0]), bounds, ["linear"]).tolist()
    [[0.4]]
    """
    error = np.empty_like(estimate)
    for index, scale in enumerate(scales):
        found, value = estimate[:, index], float(truth[index])
        if scale == "log":
            with np.errstate(divide="ignore"):
                error[:, index] = np.log(found / value)
        else:
            low, high = ranges[:, index].T
            error[:, index] = (found - value) / np.maximum(
                abs(value), DETERMINED.small_part * (high - low)
            )
    return error


def summary_by_parameter(
    error: Floats, interval: Floats, determined: Bools, truth: Floats, *, confidence: float
) -> dict[str, Floats]:
    """Return the summary of a study, an array by parameter each.

    Examples
    --------
    >>> bounds = np.array([[[0.9, 1.2]], [[1.1, 1.3]]])
    >>> found = summary_by_parameter(
    ...     np.array([[0.05], [0.2]]), bounds, np.array([[True], [False]]), np.array([1.0]),
    ...     confidence=0.9,
    ... )
    >>> found["coverage"].tolist(), found["determined_median_error"].tolist()
    ([0.5], [0.05])
    """
    size = np.abs(error)
    calibrated = np.isfinite(size)
    known = np.isfinite(interval).all(axis=2)
    held = known & (interval[..., 0] <= truth) & (truth <= interval[..., 1])
    counted = known.sum(axis=0).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            "median_error": _medians(size, calibrated),
            "determined_median_error": _medians(size, calibrated & determined),
            "determined_share": (calibrated & determined).sum(axis=0) / calibrated.sum(axis=0),
            "coverage": held.sum(axis=0) / counted,
            "coverage_standard_error": np.where(
                counted > 0.0, np.sqrt(confidence * (1.0 - confidence) / counted), np.nan
            ),
        }


def _medians(size: Floats, counts: Bools) -> Floats:
    """Return the median of what counts in each column, NaN where nothing does."""
    columns = zip(size.T, counts.T, strict=True)
    return np.array(
        [np.median(one[retained]) if retained.any() else np.nan for one, retained in columns]
    )


def calibrated_parameters(found: xr.Dataset, parameters: Sequence[Parameter]) -> dict[str, Any]:
    """Return what a calibration says of its parameters."""
    names = [one.name for one in parameters]
    found = found.sel(parameter=names)
    estimate = found["estimate"].values.astype(np.float64)
    interval = np.full((len(names), 2), np.nan)
    if "interval" in found:
        interval = found["interval"].transpose("parameter", "bound").values.astype(np.float64)
    # The ranges of the family go with the recording.
    searched = np.array([(one.low, one.high) for one in parameters])
    if "half_width" in found:
        searched = found["range"].transpose("parameter", "bound").values.astype(np.float64)
        half_width = found["half_width"].values.astype(np.float64)
        determined = found["determined"].values.astype(bool)
    else:
        confidence = (
            float(found["confidence"]) if np.isfinite(interval).any() else DETERMINED.confidence
        )
        half_width = np.array(
            [
                interval_half_width(bounds, value, one, confidence=confidence)
                for bounds, value, one in zip(interval, estimate, parameters, strict=True)
            ]
        )
        determined = half_width <= DETERMINED.most_half_width
    return {
        "estimate": estimate,
        "interval": interval,
        "range": searched,
        "determined": determined,
        "half_width": half_width,
    }


def interval_half_width(
    bounds: Floats, value: float, parameter: Parameter, *, confidence: float
) -> float:
    """Return half the 90 % interval over the value, from an interval of another confidence.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 0.0, 0.1)
    >>> round(interval_half_width(np.array([0.04, 0.06]), 0.05, speed, confidence=0.9), 3)
    0.2
    """
    from scipy.special import ndtri

    if not np.isfinite(bounds).all():
        return float("nan")
    low, high = (float(parameter.to_coordinate(end)) for end in (parameter.low, parameter.high))
    room = DETERMINED.range_end * (high - low)
    start, end = (float(one) for one in parameter.to_coordinate(bounds))
    if start < low + room or end > high - room:
        return float("inf")
    factor = float(ndtri(0.5 + 0.5 * DETERMINED.confidence) / ndtri(0.5 + 0.5 * confidence))
    return relative_half_width(float(bounds[0]), value, float(bounds[1]), parameter, factor=factor)
