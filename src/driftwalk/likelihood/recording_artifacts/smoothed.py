"""Smoothed positions, recognised by Whittle's likelihood of their spectrum.

A moving average, or a parabola through some frames (Savitzky and Golay), takes certain frequencies
out of a track altogether, of the motion and of the tracking noise alike; averages over three frames
have nothing left at a third of the frame rate. No motion with white noise on it has such holes: its
spectrum only falls, and ends in the floor of the noise. The spectrum of the second differences is
compared with the spectrum of a motion and its noise, smoothed in each of these ways and not at all.

An exponential filter leaves no holes. It turns a motion with its noise into one whose force seems
to remember, and is not looked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema import Track


class SmoothingPolicy(NamedTuple):
    """When the positions of a track are taken for smoothed (docs/explanation/likelihood.md)."""

    segment: int = 64
    """Second differences in a segment; segments overlap by half. Chosen by hand."""
    fewest_segments: int = 8
    """Segments of x and y together without which nothing is said: 16 s at 10 Hz; chosen by hand."""
    lowest_frequency: float = 0.08
    """Cycles per sample: below, the flow rules the motion. Chosen by hand."""
    orbit_frequency: float = 0.2
    """Cycles per sample: above, the evidence has to be clear too. Measured: blocks in the core of
    an eddy went round with 0.09 to 0.13 of them: such a line next to the noise looks like
    smoothing."""
    evidence: float = 50.0
    """Log likelihood ratio from which on positions are smoothed. Measured: recordings of the model
    reach 2, 300 random tracks 10; smoothed ones reach 50 in half a minute at 10 Hz."""
    most_deviance_left: float = 0.15
    """Share of the deviance of a motion and its noise that smoothing may leave. Measured: smoothed
    recordings of the model leave 0.01 of it; those of animals and robots, whose reason is another,
    0.25 and more."""
    clearly: float = 10.0
    """Log likelihood ratio over all other ways of smoothing when a way is named. Chosen by hand."""
    independent: float = 0.36
    """Degrees of freedom of the spectrum in one of its numbers: neighbours in frequency and
    overlapping segments are correlated by the taper. Chosen by hand, below the 0.48 that white
    noise has in closed form."""
    uneven: float = 0.1
    """Share of the usual interval by which one may differ within a segment; chosen by hand."""


SMOOTHING: Final = SmoothingPolicy()
FREQUENCIES: Final = 1024
"""Frequencies of a spectrum before the taper, all around the circle; chosen by hand."""
TURN: Final = 2.0 * np.pi * np.arange(FREQUENCIES) / FREQUENCIES
"""Frequencies around the circle [rad per sample]."""
HANN: Final = np.hanning(SMOOTHING.segment + 2)[1:-1]
"""Hann's window without its zeros at the ends."""
TAPER: Final = HANN / np.sqrt((HANN**2).sum())
"""The same of unit power, so that a spectrum keeps its level."""
BAND: Final = slice(int(np.ceil(SMOOTHING.lowest_frequency * SMOOTHING.segment)), None)
"""Where a segment's spectrum is compared."""
_SEEN_AT: Final = np.arange(SMOOTHING.segment // 2 + 1)[BAND] / SMOOTHING.segment
"""Frequencies of the band [cycles per sample]."""


class Smoothing(NamedTuple):
    """How positions seem to be smoothed."""

    way: str
    """In words, such as "averages over 3 frames"."""
    evidence: float
    """Logarithm of the likelihood ratio of this over no smoothing."""


def find_smoothing(track: Track) -> Smoothing | None:
    """Return how the positions of a track are smoothed; None where they do not seem to be.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 1000))
    >>> time = 0.1 * np.arange(1000)
    >>> x, y = 0.1 * np.cos(0.2 * time) + noise[0], 0.1 * np.sin(0.2 * time) + noise[1]
    >>> theta = np.zeros(1000)
    >>> find_smoothing(Track(time, x, y, theta)) is None
    True
    >>> x, y = (np.convolve(axis, np.full(3, 1 / 3), mode="same") for axis in (x, y))
    >>> find_smoothing(Track(time, x, y, theta)).way
    'averages over 3 frames'
    """
    seen, segments = _spectrum(track)
    if segments < SMOOTHING.fewest_segments or not seen.all():
        return None
    weight = np.full(seen.size, SMOOTHING.independent * segments)
    weight[-1] *= 0.5  # the highest frequency has no phase
    best = -float((weight * (np.log(seen) + 1.0)).sum())
    plain = _likelihood(seen, _plain(), weight)
    if best - plain < SMOOTHING.evidence:
        return None
    found = {way: _likelihood(seen, parts, weight) - plain for way, parts in _expected().items()}
    way, *others = sorted(found, key=lambda name: -found[name])
    evidence = found[way]
    left = best - plain - evidence
    if evidence < SMOOTHING.evidence or left > SMOOTHING.most_deviance_left * (best - plain):
        return None
    above = weight * (SMOOTHING.orbit_frequency < _SEEN_AT)
    gained = _likelihood(seen, _expected()[way], above) - _likelihood(seen, _plain(), above)
    if gained < SMOOTHING.clearly:
        return None
    clear = evidence - found[others[0]] > SMOOTHING.clearly
    return Smoothing(way if clear else "averages over some frames", evidence)


def require_raw(track: Track, *, where: str) -> None:
    """Refuse positions that a tracker has smoothed."""
    found = find_smoothing(track)
    if found is not None:
        raise InputError(
            f"{where}the positions look like {found.way}: the fit would take the missing noise and "
            "the lost quick motion for drag; switch the smoothing of the tracker off, or export "
            "the raw positions"
        )


def _spectrum(track: Track) -> tuple[Floats, int]:
    """Return the mean spectrum of second differences in the band, and its number of segments."""
    interval = np.diff(track.time)
    if interval.size < SMOOTHING.segment + 1:
        return np.zeros(0), 0
    usual = float(np.median(interval))
    breaks = np.flatnonzero(np.abs(interval - usual) > SMOOTHING.uneven * usual) + 1
    total, count = np.zeros(SMOOTHING.segment // 2 + 1), 0
    for first, last in zip([0, *breaks], [*breaks, track.time.size], strict=True):
        for axis in (track.x, track.y):
            change = np.diff(axis[first:last], 2)
            if change.size < SMOOTHING.segment:
                continue
            windows = np.lib.stride_tricks.sliding_window_view(change, SMOOTHING.segment)
            parts = windows[:: SMOOTHING.segment // 2]
            total += (np.abs(np.fft.rfft(parts * TAPER, axis=1)) ** 2).sum(axis=0)
            count += len(parts)
    mean: Floats = total / max(count, 1)
    return mean[BAND], count


def _parts() -> Floats:
    """Return what spectra are made of without smoothing, shape (parts, FREQUENCIES)."""
    turn = TURN
    difference = np.abs(1.0 - np.exp(1j * turn)) ** 2
    motion = (2.0 + np.cos(turn)) / 3.0
    # A force that remembers, by its correlation from one sample to the next.
    forgetting = [
        motion * (1.0 - one) ** 2 / np.abs(1.0 - one * np.exp(1j * turn)) ** 2
        for one in (0.3, 0.5, 0.7, 0.85, 0.95)
    ]
    # Tracking noise, jumps of the position, of the velocity, and of an acceleration that lasts.
    return np.stack([difference**2, difference, motion, *forgetting])


@cache
def _plain() -> Floats:
    """Return the same for a segment, shape (f, parts)."""
    return _tapered(_parts())


@cache
def _expected() -> Mapping[str, Floats]:
    """Return what spectra are made of, by the way of smoothing. Shapes (f, parts)."""
    parts = _parts()
    found = {}
    for way, weights in _ways().items():
        gain = np.abs(np.exp(-1j * np.outer(TURN, np.arange(weights.size))) @ weights) ** 2
        # Rounding comes after the smoothing.
        found[way] = _tapered(np.concatenate([gain * parts, parts[:1]]))
    return found


def _ways() -> dict[str, Floats]:
    # Slow to load, and asked for only where the plain spectrum does not fit.
    from scipy.signal import savgol_coeffs

    ways = {f"averages over {n} frames": np.full(n, 1.0 / n) for n in (2, 3, 4, 5, 6, 7, 9, 11)}
    ways["weighted averages over 3 frames"] = np.array([0.25, 0.5, 0.25])
    ways["weighted averages over 5 frames"] = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
    # A degree of 3 gives the same weights as 2.
    for frames, degree in ((5, 2), (7, 2), (9, 2), (11, 2), (7, 4), (9, 4), (11, 4)):
        name = {2: "parabolas", 4: "quartics"}[degree]
        ways[f"{name} through {frames} frames (Savitzky-Golay)"] = savgol_coeffs(frames, degree)
    return ways


def _tapered(spectra: Floats) -> Floats:
    """Return the mean of tapered spectra of a segment whose true ones are given, (f, parts)."""
    covariance = np.fft.ifft(spectra, axis=1).real[:, : SMOOTHING.segment]
    covariance *= np.correlate(TAPER, TAPER, mode="full")[SMOOTHING.segment - 1 :]
    covariance[:, 1:] *= 2.0
    turn = 2.0 * np.pi * np.arange(SMOOTHING.segment // 2 + 1) / SMOOTHING.segment
    found: Floats = np.cos(np.outer(turn, np.arange(SMOOTHING.segment))) @ covariance.T
    return found[BAND]


def _likelihood(seen: Floats, parts: Floats, weight: Floats) -> float:
    """Return Whittle's log likelihood of a spectrum that is a sum of parts, at its maximum.

    The shares of the parts are above zero, and each step raises the likelihood.
    """
    share = np.array([float(np.median(seen / np.maximum(part, 1e-12))) for part in parts.T])
    share /= share.size
    for _ in range(200):
        expected = parts @ share
        up = parts.T @ (weight * seen / expected**2)
        share *= np.sqrt(up / (parts.T @ (weight / expected)))
    expected = parts @ share
    return -float((weight * (np.log(expected) + seen / expected)).sum())
