"""Unsteady flow: continuation beyond its frames, and the start time of each world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import Purpose
from driftwalk.schema.kinds.flow import flow_series_words

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class FlowContinuationPolicy(NamedTuple):
    """How a flow in frames continues after its last frame."""

    most_missing: float = 0.01
    """Share of a series that may be missing at its end, and no more than one frame: 600 frames
    of 0.1 s are a minute, although the last one stands at 59.9 s; chosen by hand."""
    closed: float = 1e-3
    """Change from the last frame to the first, over the usual one between frames, below which
    both are the same moment of a period: a formula leaves rounding there, a measurement its
    noise; chosen by hand."""


_CONTINUATION: Final = FlowContinuationPolicy()


class Series(NamedTuple):
    """The clock of a flow in frames."""

    time: Floats
    """Times of the frames [s]."""
    repeat: str
    """How it goes on beyond them: "none", "loop", "mirror" or "hold"."""
    begin: float
    """Time at which a world without a drawn start begins [s]."""
    closing: float
    """In a loop, time from the last frame to the first one again [s]; 0 where both are the same."""

    @property
    def span(self) -> float:
        """Time from the first frame to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def period(self) -> float:
        """Time after which all is as before [s]; 0 where it never is."""
        return {"loop": self.span + self.closing, "mirror": 2.0 * self.span}.get(self.repeat, 0.0)


def is_series(flow: xr.Dataset | None) -> bool:
    """Return whether a flow changes in time."""
    return flow is not None and "time" in flow["u"].dims and flow.sizes["time"] > 1


def flow_since(flow: xr.Dataset | None, begin: float) -> xr.Dataset | None:
    """Return a flow whose clock begins at a time [s]; a steady one, and None, as they are."""
    if flow is None or not is_series(flow):
        return flow
    return flow.assign_coords(time=flow["time"].copy(data=flow["time"].values - begin))


def series_of(flow: xr.Dataset) -> Series:
    """Return the clock of a flow in frames; of how it goes on what `continued_flow` has added.

    Raises
    ------
    InputError
        When its times do not increase.
    """
    attrs = flow.attrs
    time = np.ascontiguousarray(flow["time"].values, dtype=np.float64)
    if not (np.diff(time) > 0).all():
        raise InputError("the times of the flow field do not increase")
    return Series(
        time,
        str(attrs.get("repeat", "none")),
        float(attrs.get("series_begin_s", time[0])),
        float(attrs.get("series_closing_s", 0.0)),
    )


def continued_flow(
    flow: xr.Dataset, study: Study, *, duration: float, begin: float | None = None
) -> xr.Dataset:
    """Return a flow that knows how it goes on beyond its frames, for worlds of a duration [s].

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`; a steady one is returned as it is.
    study : Study
        Its [flow] says how a series goes on, where the series does not say so itself.
    duration : float
        How long the worlds last [s]; infinite for one that is never over.
    begin : float, optional
        Time on the clock of the frames at which all worlds begin [s], where they share a clock with
        the series; default: any, chosen by `flow_starts`.

    Returns
    -------
    xarray.Dataset
        With the attribute ``repeat``, and what `series_of` reads.

    Raises
    ------
    InputError
        When the series is over before the worlds are, and nothing says how it goes on; when its
        times do not increase.

    Examples
    --------
    >>> import driftwalk as dw
    >>> flow = dw.uniform_flow(0.01, 0.0).expand_dims(time=[0.0, 10.0])
    >>> study = dw.Study(flow={"repeat": "loop"})
    >>> continued_flow(flow, study, duration=60.0).attrs["repeat"]
    'loop'
    """
    if not is_series(flow):
        return flow
    series = series_of(flow)
    time, span, interval = series.time, series.span, float(np.median(np.diff(series.time)))
    stated = study.flow.repeat
    repeat = stated if stated != "none" else series.repeat
    if repeat == "none":
        missing = min(interval, _CONTINUATION.most_missing * span)
        first = float(time[0]) if begin is None else begin
        if first < time[0] - missing or first + duration > time[-1] + missing:
            raise InputError(_ended(time, duration, begin))
    # A series that says itself how it goes on has a clock whose 0 is the begin of a run.
    own = 0.0 if "repeat" in flow.attrs else float(time[0])
    closing = 0.0 if _join(flow) < _CONTINUATION.closed else interval
    return flow.assign_attrs(
        repeat=repeat,
        series_begin_s=float(flow.attrs.get("series_begin_s", own)) if begin is None else begin,
        # Kept where frames are drawn from their errors: the clock is the same for all of them.
        series_closing_s=float(flow.attrs.get("series_closing_s", closing)),
    )


def flow_starts(
    flow: xr.Dataset | None, study: Study, keys: npt.NDArray[np.uint64], *, duration: float
) -> Floats | None:
    """Return the time on the clock of the frames at which each world begins [s].

    With `flow.start = "random"` each world of a series that repeats begins anywhere in its period,
    and in one that does not anywhere that leaves it time to end, by a number of its own address.

    Parameters
    ----------
    flow : xarray.Dataset or None
        As `continued_flow` returns it.
    study : Study
        Its [flow] says whether worlds begin at random.
    keys : ndarray of uint64, shape (worlds,)
        The address of every world's random numbers.
    duration : float
        How long the worlds last [s].

    Returns
    -------
    ndarray or None
        Shape (worlds,); None where the flow is steady.

    Examples
    --------
    >>> import driftwalk as dw
    >>> flow = dw.uniform_flow(0.01, 0.0).expand_dims(time=[0.0, 10.0])
    >>> study = dw.Study(flow={"start": "first"})
    >>> flow = continued_flow(flow, study, duration=4.0)
    >>> flow_starts(flow, study, np.array([1, 2], dtype=np.uint64), duration=4.0).tolist()
    [0.0, 0.0]
    """
    if flow is None or not is_series(flow):
        return None
    series = series_of(flow)
    room = series.period
    if series.repeat == "none":
        room = max(series.span - duration, 0.0)
    if study.flow.start == "first" or room == 0.0:
        return np.full(keys.size, series.begin)
    words = [_core.philox(int(key), [0, 0, 0, Purpose.FLOW])[0] for key in keys]
    return series.begin + room * (np.array(words, dtype=np.float64) * 2.0**-32)


def series_facts(
    flow: xr.Dataset | None, starts: npt.ArrayLike | None, *, duration: float
) -> dict[str, Any]:
    """Return attributes of a result that say how worlds met a flow in frames; none of a steady one.

    Parameters
    ----------
    flow : xarray.Dataset or None
        As `continued_flow` returns it.
    starts : array_like or None
        When the worlds began in it [s]; None: with the recording that they are compared with.
    duration : float
        How long the worlds last [s].
    """
    if flow is None or not is_series(flow):
        return {}
    series = series_of(flow)
    begin = None if starts is None else np.atleast_1d(np.asarray(starts, dtype=np.float64))
    together = begin is None or begin.size < 2 or float(np.ptp(begin)) == 0.0
    facts: dict[str, Any] = {
        "flow_span_s": series.span,
        "flow_repeat": series.repeat,
        "flow_begins": "recorded" if begin is None else "together" if together else "random",
    }
    if series.period:
        facts["flow_period_s"] = series.period
    elif not together:
        facts["flow_slack_s"] = series.span - duration
    if series.repeat == "loop" and series.closing:
        facts["flow_join"] = _join(flow)
    return facts


def series_warnings(flow: xr.Dataset | None, *, duration: float) -> list[str]:
    """Return what to know where a flow in frames is met on the clock of a recording."""
    return flow_series_words(series_facts(flow, None, duration=duration))


def frames_of(flow: xr.Dataset) -> tuple[Floats, Floats, Floats, str]:
    """Return u, v (frames, y, x) [m/s], times [s] and repetition of a flow, for the native core.

    A loop is closed by its first frame.
    """
    u, v = (np.asarray(flow[name].values, dtype=np.float64) for name in ("u", "v"))
    if not is_series(flow):
        return u.reshape(-1, *u.shape[-2:]), v.reshape(-1, *v.shape[-2:]), np.zeros(1), "hold"
    series = series_of(flow)
    time = series.time
    if series.repeat == "loop" and series.closing:
        u, v = (np.concatenate([values, values[:1]]) for values in (u, v))
        time = np.append(time, time[-1] + series.closing)
    return (
        np.ascontiguousarray(u),
        np.ascontiguousarray(v),
        time,
        series.repeat if series.repeat in ("loop", "mirror") else "hold",
    )


def within_frames(time: Floats, clock: Floats, repeat: str) -> Floats:
    """Return the moments between the first frame and the last that repeat at times [s]."""
    span = clock[-1] - clock[0]
    turn, within = np.divmod(time - clock[0], span)
    backwards = (turn % 2 == 1) & (repeat == "mirror")
    return np.asarray(clock[0] + np.where(backwards, span - within, within))


def velocity_at(
    flow: xr.Dataset, x: npt.ArrayLike, y: npt.ArrayLike, time: npt.ArrayLike = 0.0
) -> tuple[Floats, Floats]:
    """Return the water's velocity [m/s] at points [m] and times on the clock of the frames [s].

    Linear between nodes and frames, and beyond its frames as the flow says; beyond the grid the
    nearest node's.
    """
    from scipy.interpolate import RegularGridInterpolator

    *values, clock, repeat = frames_of(flow)
    nodes = [flow[axis].values for axis in ("y", "x")]
    when, *at = np.broadcast_arrays(np.asarray(time, dtype=np.float64), y, x)
    if clock.size == 1:
        values, clock = [np.repeat(one, 2, axis=0) for one in values], np.array([0.0, 1.0])
    elif repeat != "hold":
        when = within_frames(when, clock, repeat)
    axes = (clock, *nodes)
    places = [np.clip(one, axis[0], axis[-1]) for one, axis in zip((when, *at), axes, strict=True)]
    u, v = (RegularGridInterpolator(axes, one)(np.stack(places, axis=-1)) for one in values)
    return np.asarray(u), np.asarray(v)


def _join(flow: xr.Dataset) -> float:
    """Return the change from the last frame to the first, over the usual one between frames."""
    squares = [
        (np.roll(flow[name].values, -1, axis=0) - flow[name].values) ** 2 for name in ("u", "v")
    ]
    changes = np.sqrt((squares[0] + squares[1]).mean(axis=(1, 2)))
    usual = float(np.median(changes[:-1]))
    if usual > 0:
        return float(changes[-1] / usual)
    return math.inf if changes[-1] > 0 else 0.0


def _ended(time: Floats, duration: float, begin: float | None) -> str:
    clock = "" if begin is None else " on the clock of the recording"
    begin = float(time[0]) if begin is None else begin
    lasts = (
        "the tank moves without end"
        if math.isinf(duration)
        else f"what is simulated needs {begin:g} to {begin + duration:g} s{clock}"
    )
    return (
        f"the flow series spans {time[0]:g} to {time[-1]:g} s, and {lasts}: say how it goes on "
        'with `flow.repeat="loop"`, "mirror" or "hold", simulate for a shorter time, or take a '
        "longer series"
    )
