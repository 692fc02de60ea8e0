"""The summaries of a motion by their definitions: plain loops over lists, one number at a time.

For time stamps that are multiples of the step interval, where every sample is a point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

FACTORS = (1, 3, 9)
FEWEST_PAIRS = 30
"""Pairs of longer steps below which their interval is left out."""
FEWEST = 4
SMALLEST = 0.02


@dataclass(frozen=True)
class PlainMotion:
    """A track with integer time stamps, and how it is to be summarised.

    Attributes
    ----------
    tick : sequence of int
        When each sample was, in step intervals.
    x, y : sequence of float
        Positions [m]; NaN where the sample is missing.
    counts : callable
        Whether an instant, in step intervals, counts.
    radius : float
        Of the round wall [m].
    unit, depth : float
        Scale of the lengths and of the distances from the wall [m].
    """

    tick: Sequence[int]
    x: Sequence[float]
    y: Sequence[float]
    counts: Callable[[int], bool]
    radius: float
    unit: float
    depth: float

    def follows(self, index: int) -> bool:
        """Whether the next sample comes one step interval later."""
        last = len(self.tick) - 1
        return 0 <= index < last and self.tick[index + 1] - self.tick[index] == 1

    def there(self) -> list[bool]:
        """Which steps count: those of an unbroken pair, at both ends of which the body is seen."""
        found = []
        for at in range(len(self.tick) - 1):
            paired = self.follows(at) and (self.follows(at - 1) or self.follows(at + 1))
            seen = not math.isnan(self.length(at))
            found.append(paired and seen and self.counts(self.tick[at]))
        return found

    def length(self, at: int) -> float:
        """Length of a step [m]."""
        return math.hypot(self.x[at + 1] - self.x[at], self.y[at + 1] - self.y[at])

    def speed(self, at: int) -> float:
        """Logarithm of the length over the usual step."""
        return math.log(self.length(at) / self.unit + SMALLEST)

    def angle(self, first: tuple[int, int], second: tuple[int, int]) -> float:
        """Turn from one displacement, between two samples, to another [rad]."""
        ax, ay = (v[first[1]] - v[first[0]] for v in (self.x, self.y))
        bx, by = (v[second[1]] - v[second[0]] for v in (self.x, self.y))
        return math.atan2(ax * by - ay * bx, ax * bx + ay * by)

    def runs(self) -> list[list[int]]:
        """Samples of each unbroken run."""
        found: list[list[int]] = [[0]]
        for at in range(1, len(self.tick)):
            if self.follows(at - 1):
                found[-1].append(at)
            else:
                found.append([at])
        return found


def plain_summaries(motion: PlainMotion) -> dict[str, list[float]]:
    """Return the summaries by kind, in the order in which `summarise` has them."""
    return {
        "step lengths": _quantiles(_speeds(motion), (0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98)),
        "turns": _turns(motion),
        "changes": _changes(motion),
        "memory": _memory(motion),
        "displacement": _displacement(motion),
        "place": _place(motion),
        "peaks": _peaks(motion),
        **{f"bouts at {level}": _bouts(motion, level) for level in (0.3, 0.7, 1.2)},
    }


def pairs_at(motion: PlainMotion, factor: int) -> list[tuple[int, int, int]]:
    """Return three samples for each pair of steps over some step intervals."""
    found = []
    for run in motion.runs():
        points = run[::factor]
        found += list(zip(points, points[1:], points[2:], strict=False))
    return found


def _turns(motion: PlainMotion) -> list[float]:
    found: list[float] = []
    for factor in FACTORS:
        pairs = pairs_at(motion, factor)
        if factor > 1 and len(pairs) < FEWEST_PAIRS:
            continue
        lengths, angles = [], []
        for a, b, c in pairs:
            first = math.hypot(motion.x[b] - motion.x[a], motion.y[b] - motion.y[a])
            second = math.hypot(motion.x[c] - motion.x[b], motion.y[c] - motion.y[b])
            # A step that was not seen, or has no direction, has no turn.
            if first > 0.0 and second > 0.0 and motion.counts(motion.tick[b]):
                lengths.append(second)
                angles.append(motion.angle((a, b), (b, c)))
        middle = _quantile(lengths, 0.5) if lengths else 0.0
        fast = [angle for angle, length in zip(angles, lengths, strict=True) if length > middle]
        found += [
            _mean([math.cos(one) for one in angles]),
            _mean([math.sin(one) for one in angles]),
            _mean([math.cos(2 * one) for one in angles]),
            _mean([1.0 if abs(one) > math.pi / 2 else 0.0 for one in angles]),
            _mean([math.cos(one) for one in fast]),
            math.log(_mean([min(abs(one), 0.3) for one in fast]) + 1e-3),
        ]
        if factor > 1:
            shares = (0.05, 0.25, 0.5, 0.75, 0.95)
            far = _quantiles(lengths, shares) if len(lengths) >= FEWEST else [0.0] * 5
            found += [math.log(one / motion.unit + SMALLEST) for one in far]
    return found


def _changes(motion: PlainMotion) -> list[float]:
    there = motion.there()
    changes, turns = [], []
    for at in range(len(there) - 1):
        if there[at] and there[at + 1]:
            changes.append(motion.speed(at + 1) - motion.speed(at))
            still = not motion.length(at) * motion.length(at + 1) > 0.0
            angle = motion.angle((at, at + 1), (at + 1, at + 2))
            turns.append(0.0 if still else math.cos(angle))
    found = []
    for kind in (lambda c: c > 0.4, lambda c: c < -0.4, lambda c: abs(c) < 0.1):
        chosen = [turn for turn, change in zip(turns, changes, strict=True) if kind(change)]
        found += [len(chosen) / max(len(changes), 1), _mean(chosen)]
    enough = len(changes) >= FEWEST
    return found + (_quantiles(changes, (0.05, 0.25, 0.5, 0.75, 0.95)) if enough else [0.0] * 5)


def _memory(motion: PlainMotion) -> list[float]:
    there = motion.there()
    counted = [at for at, one in enumerate(there) if one]
    middle = sum(motion.speed(at) for at in counted) / len(counted)
    variance = sum((motion.speed(at) - middle) ** 2 for at in counted) / len(counted)
    square = sum(motion.length(at) ** 2 for at in counted) / len(counted)
    found = []
    for lag in (1, 2, 3, 5, 10, 20, 50):
        speeds, ways = [], []
        for at in counted:
            later = at + lag
            if later < len(there) and there[later]:
                speeds.append((motion.speed(at) - middle) * (motion.speed(later) - middle))
                ways.append(
                    sum(
                        (v[at + 1] - v[at]) * (v[later + 1] - v[later])
                        for v in (motion.x, motion.y)
                    )
                )
        known = len(speeds) >= FEWEST and variance > 0.0 and square > 0.0
        found += [
            sum(speeds) / len(speeds) / variance if known else 0.0,
            sum(ways) / len(ways) / square if known else 0.0,
        ]
    return found


def _displacement(motion: PlainMotion) -> list[float]:
    there = motion.there()
    found = []
    for lag in (1, 3, 10, 30, 100):
        squares = [
            (motion.x[at + lag] - motion.x[at]) ** 2 + (motion.y[at + lag] - motion.y[at]) ** 2
            for at in range(len(there) - lag + 1)
            if all(there[at : at + lag])
        ]
        known = len(squares) >= FEWEST
        mean = sum(squares) / len(squares) if known else 0.0
        found.append(math.log(mean / motion.unit**2 + 1e-12) if known else 0.0)
    return found


def _place(motion: PlainMotion) -> list[float]:
    there = motion.there()
    places = {
        at: (motion.radius - math.hypot(motion.x[at], motion.y[at])) / motion.depth
        for at, one in enumerate(there)
        if one
    }
    found = _quantiles(list(places.values()), (0.05, 0.25, 0.5, 0.75))
    middle = [motion.speed(at) for at, place in places.items() if place > 0.4]
    for low, high in ((-math.inf, 0.05), (0.05, 0.15), (0.15, 0.4)):
        zone = [motion.speed(at) for at, place in places.items() if low < place <= high]
        known = min(len(zone), len(middle)) >= FEWEST
        found.append(_mean(zone) - _mean(middle) if known else 0.0)
    return found


def _peaks(motion: PlainMotion) -> list[float]:
    there = motion.there()
    heights = []
    for at in range(1, len(there) - 1):
        if there[at - 1] and there[at] and there[at + 1]:
            before, now, after = (motion.length(at + k) for k in (-1, 0, 1))
            if before < now >= after:
                heights.append(motion.speed(at))
    if not heights:
        return [0.0, 0.0, 0.0]
    middle = sum(heights) / len(heights)
    spread = math.sqrt(sum((one - middle) ** 2 for one in heights) / len(heights))
    return [math.log(1 + len(heights)), middle, math.log(spread + 1e-3)]


def _bouts(motion: PlainMotion, level: float) -> list[float]:
    there = motion.there()
    fast = [one and motion.length(at) > level * motion.unit for at, one in enumerate(there)]
    bouts: list[tuple[bool, int, int]] = []  # kind, first step, steps
    for at, kind in enumerate(fast):
        if bouts and bouts[-1][0] == kind:
            bouts[-1] = (kind, bouts[-1][1], bouts[-1][2] + 1)
        else:
            bouts.append((kind, at, 1))
    counted = [kind for kind, one in zip(fast, there, strict=True) if one]
    found = [sum(counted) / len(counted)]
    for wanted in (True, False):
        lasts = [steps for kind, _, steps in bouts if kind == wanted] or [1]
        logs = [math.log(one) for one in lasts]
        middle = sum(logs) / len(logs)
        found += [
            middle,
            math.sqrt(sum((one - middle) ** 2 for one in logs) / len(logs)),
            math.log(sum(one**2 for one in lasts) / sum(lasts)),
        ]
    short, long = [], []
    for (_, before, steps), (kind, first, rest), (_, after, _) in zip(
        bouts, bouts[1:], bouts[2:], strict=False
    ):
        if not kind:
            last = before + steps - 1
            turn = math.cos(motion.angle((last, last + 1), (after, after + 1)))
            assert after == first + rest
            (short if rest == 1 else long).append(turn)
    return [*found, _mean(short), _mean(long)]


def _speeds(motion: PlainMotion) -> list[float]:
    return [motion.speed(at) for at, one in enumerate(motion.there()) if one]


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if len(values) >= FEWEST else 0.0


def _quantiles(values: Sequence[float], shares: Sequence[float]) -> list[float]:
    return [_quantile(values, share) for share in shares]


def _quantile(values: Sequence[float], share: float) -> float:
    ordered = sorted(values)
    place = share * (len(ordered) - 1)
    low = math.floor(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (place - low) * (ordered[high] - ordered[low])
