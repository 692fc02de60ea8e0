"""The flows of a fit: one for each interval between the switching times of the pumps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.likelihood.fitted_modes import moving_fields, stored_frames
from driftwalk.schema import FLAGS, Track, build_flow_field
from driftwalk.schema.check import refuse_other_version, require_kind
from driftwalk.schema.kinds.flow import FIT_PREFIX

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True)
class Intervals:
    """When the flow changes, and to which one.

    Attributes
    ----------
    times : tuple of float
        Switching times on the clock of each recording [s], increasing; empty for a steady flow.
    flows : tuple of int
        Number of the flow in each interval, one more than times.
    labels : tuple of str
        Names of the flows.

    Examples
    --------
    >>> Intervals((600.0, 1200.0), (0, 1, 0), ("A", "B")).of_flow(0)
    [0, 2]
    """

    times: tuple[float, ...]
    flows: tuple[int, ...]
    labels: tuple[str, ...]

    @property
    def steady(self) -> bool:
        """Whether there is but one flow."""
        return len(self.labels) == 1

    def of_flow(self, flow: int) -> list[int]:
        """Return the intervals in which the water flows so."""
        return [index for index, one in enumerate(self.flows) if one == flow]

    def describe(self, index: int) -> str:
        """Return "600 s to 1200 s"."""
        low = "the start" if index == 0 else f"{self.times[index - 1]:g} s"
        high = "the end" if index == len(self.times) else f"{self.times[index]:g} s"
        return f"{low} to {high}"

    def describe_flow(self, flow: int) -> str:
        """Return "flow A (the start to 600 s)"."""
        spans = ", ".join(self.describe(index) for index in self.of_flow(flow))
        return f"flow {self.labels[flow]} ({spans})"

    def index_of(self, time: np.ndarray) -> np.ndarray:
        """Return the interval of each time; a switching time begins the next one."""
        return np.searchsorted(self.times, time, side="right")


def intervals_of(study: Study) -> Intervals:
    """Return the intervals that the section [fit] of a study names.

    Examples
    --------
    >>> from driftwalk.model import Study
    >>> intervals_of(Study(fit={"switching_times_s": [600, 1200]})).labels
    ('A', 'B', 'C')
    """
    times = study.fit.switching_times_s or ()
    # A, B, ..., Z, A1, B1, ...
    letters = [f"{chr(ord('A') + k % 26)}{k // 26 or ''}" for k in range(len(times) + 1)]
    names = study.fit.flow_labels or tuple(letters)
    labels = tuple(dict.fromkeys(names))
    return Intervals(tuple(times), tuple(labels.index(name) for name in names), labels)


def fitted_intervals(fit: xr.Dataset) -> Intervals:
    """Return the intervals of a fit."""
    if "flow" not in fit.dims:
        return Intervals((), (0,), ("A",))
    return Intervals(
        *(tuple(fit[name].values.tolist()) for name in ("switching_time", "interval_flow", "flow"))
    )


def cut_track(track: Track, intervals: Intervals, *, fewest: int, where: str) -> list[Track]:
    """Cut a track at the switching times, one part for each interval."""
    if not intervals.times:
        return [track]
    first, last = float(track.time[0]), float(track.time[-1])
    for time in intervals.times:
        if not first < time <= last:
            raise InputError(
                f"{where}the switching time {time:g} s is outside the recording ({first:g} s to "
                f"{last:g} s): give switching times on the recording's own clock "
                "(`fit.switching_times_s`)"
            )
    index = intervals.index_of(track.time)
    parts = [Track(*(column[index == one] for column in track)) for one in range(index[-1] + 1)]
    for one, part in enumerate(parts):
        if part.time.size < fewest:
            usual = float(np.median(np.diff(track.time)))
            raise InputError(
                f"{where}the interval from {intervals.describe(one)} has {part.time.size} "
                f"positions; the fit needs {fewest} at least ({fewest * usual:.3g} s at this "
                "rate), and ten minutes to be of use: leave out a switching time, or what is "
                "before or after it (`start`, `stop` of `load`)"
            )
    return parts


def switched_frames(
    intervals: Intervals,
    fields: Mapping[str, Sequence[np.ndarray]],
    *,
    first: float,
    more: npt.ArrayLike = (),
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return frames of a flow that jumps at the switches, where frames are joined by lines.

    Frames at `more` times [s] stand between them.

    Examples
    --------
    >>> steps = Intervals((5.0,), (0, 1), ("A", "B"))
    >>> time, frames = switched_frames(steps, {"u": [np.zeros(1), np.ones(1)]}, first=2.0)
    >>> time.tolist(), frames["u"].tolist()
    ([2.999999, 3.000001], [[0.0], [1.0]])
    """
    half = 1e-6  # [s], for a field is linear between its frames
    switches = np.array(intervals.times) - first
    time = np.unique(np.concatenate([switches - half, switches + half, np.asarray(more)]))
    flow = np.array(intervals.flows)[np.searchsorted(switches, time, side="right")]
    return time, {name: np.stack([values[one] for one in flow]) for name, values in fields.items()}


def require_fit(dataset: xr.Dataset) -> xr.Dataset:
    """Return a fit; refuse any other dataset, and a fit of another schema version."""
    return refuse_other_version(require_kind(dataset, "fit", "fit_motion makes one"))


def fitted_flow(fit: xr.Dataset, *, interval: int | None = None) -> xr.Dataset:
    """Return the flow of a fit as a flow field, for everything that takes one.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    interval : int, optional
        With switching times: the interval, counted from 0, whose steady flow is wanted. Without
        it the flow that changes is returned: its frames are a microsecond before and after each
        switch, as fields are linear in time between frames; times count from the first sample of
        the first recording, as those of a simulation do.

        A flow whose strength or shape the fit found to change has frames, too: of a whole period
        where that is all, else over the first recording. With `interval` it is the mean flow.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. Nodes that the block has been over are *measured*, the others of the tank
        *filled*: there the spline is continued smoothly. Standard errors stand at measured nodes
        (those of all nodes are in the fit); they are correlated over about the distance of knots.

    Raises
    ------
    InputError
        When the dataset is no fit, or has no such interval.

    Examples
    --------
    >>> import driftwalk as dw
    >>> flow = dw.fitted_flow(dw.fit_motion(dw.tank30_recording()))  # doctest: +SKIP
    """
    fit = require_fit(fit)
    intervals = fitted_intervals(fit)
    if interval is not None and not 0 <= interval < len(intervals.flows):
        raise InputError(
            f"no interval {interval}: the fit has {len(intervals.flows)}, counted from 0"
        )
    attrs: dict[str, Any] = {
        "method": "bicubic spline, fitted with drag and noise by the innovations' likelihood",
        "cell_size_m": float(fit["cell_size"]),
        **{key: fit.attrs[key] for key in ("arena", "source")},
    }
    # A calibration in this flow compares its answer with that of the fit.
    for name in ("drag_coefficient", "force_noise_intensity"):
        if name in fit["parameter"].values:
            ends = fit["interval"].sel(parameter=name).values
            attrs[f"{FIT_PREFIX}{name}"] = [float(end) for end in ends]
    x, y = fit["x"].values, fit["y"].values
    moving = stored_frames(fit) if interval is None else None
    if intervals.steady:
        field = _field_variables(fit)
        if moving is not None:
            attrs |= {"repeat": moving.repeat} if moving.repeat != "none" else {}
            field = {"time": moving.time, **moving_fields(fit, moving, field)}
        return build_flow_field(x, y, attrs=attrs, **field)
    fields = [_field_variables(fit.isel(flow=index)) for index in range(fit.sizes["flow"])]
    if interval is not None:
        flow = intervals.flows[interval]
        attrs["flow_label"] = intervals.labels[flow]
        if "flow_force_std" in fit:
            own = (float(fit[f"flow_force_std_{end}"][flow]) for end in ("low", "high"))
            lasts = float(fit["force_interval"])
            attrs[f"{FIT_PREFIX}force_noise_intensity"] = [end**2 * lasts for end in own]
        attrs["intervals"] = ", ".join(intervals.describe(one) for one in intervals.of_flow(flow))
        return build_flow_field(x, y, attrs=attrs, **fields[flow])
    attrs["repeat"] = "hold"  # before the first switch and after the last the flow is steady
    by_name = {name: [one[name] for one in fields] for name in fields[0]}
    more = () if moving is None else moving.time
    time, frames = switched_frames(
        intervals, by_name, first=float(fit["recording_start"]), more=more
    )
    if moving is not None:
        strength = np.interp(time, moving.time, moving.strength)[:, None, None]
        frames |= {name: strength * frames[name] for name in ("u", "v")}
    return build_flow_field(x, y, time=time, attrs=attrs, **frames)


class FlowSetting(NamedTuple):
    """Flow and parameters that belong to one setting of the pumps."""

    study: Study
    """With the σ_F of the flow, and everything else that the fit found."""
    flow: xr.Dataset
    """A `flow_field`."""
    uncertainty: xr.Dataset
    """The fit with the σ_F of the flow, to draw parameters from."""


def flow_settings(fit: xr.Dataset) -> dict[str, FlowSetting]:
    """Return the settings of the pumps of a fit by their names (`fit.flow_labels`).

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`. Without named flows all have one σ_F.

    Returns
    -------
    dict of str to FlowSetting
        Study, flow and uncertainty of each; without switching times the one is called "A".

    Raises
    ------
    InputError
        When the dataset is no fit, or does not determine C_d or σ_F.

    Examples
    --------
    >>> flow_settings(fit)["B"].study.forces.force_std_N  # doctest: +SKIP
    0.0012
    """
    from driftwalk.conditions import estimated_study

    intervals, found = fitted_intervals(require_fit(fit)), {}
    for flow, label in enumerate(intervals.labels):
        own = {}
        if "flow_force_std" in fit:
            if not np.isfinite(fit["flow_force_std_high"].values[flow]):
                raise InputError(f"the fit does not determine σ_F in flow {label}")
            own = {"forces.force_std_N": float(fit["flow_force_std"][flow])}
        field = fitted_flow(fit, interval=intervals.of_flow(flow)[0])
        found[label] = FlowSetting(estimated_study(fit, own), field, _of_flow(fit, flow))
    return found


def _of_flow(fit: xr.Dataset, flow: int) -> xr.Dataset:
    """Return a fit whose σ_F, and what is known of it, are those of one of its flows."""
    if "flow_force_std" not in fit:
        return fit
    low, high = (np.log(fit[f"flow_force_std_{end}"].values) for end in ("low", "high"))
    part = (high[flow] - low[flow]) / (high[0] - low[0])
    scale = np.where(fit["log_parameter"] == "ln_noise_intensity", part, 1.0)
    named = fit["parameter"] == "force_std"
    return fit.assign(
        estimate=fit["estimate"].where(~named, fit["flow_force_std"][flow]),
        covariance=fit["covariance"] * np.outer(scale, scale),
    )


def _field_variables(fit: xr.Dataset) -> dict[str, Any]:
    """Return the variables of a flow field: standard errors at measured nodes only."""
    measured = fit["flag"].values == FLAGS["measured"]
    errors = {
        name: np.where(measured, fit[name].values, np.nan)
        for name in ("u_standard_error", "v_standard_error")
    }
    return {**{name: fit[name].values for name in ("u", "v", "flag", "count")}, **errors}
