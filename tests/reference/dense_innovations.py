"""The innovations filter by whole matrices, and the worlds in which it is tried.

Joseph's update, sensitivities as a dense recursion, second derivatives of the drag by differences.
Only the mean drag is that of the core, which is checked by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.linalg
from uncertain_strips import Block, SplineFlow, bend

from driftwalk import _core

Floats = npt.NDArray[np.float64]

COLUMNS, ROWS, SPACING = 15, 16, 0.03
ORIGIN = np.array([-0.18, -0.2])
NODES = COLUMNS * ROWS
BLOCK = {"side": 0.03, "mass": 0.0116, "depth": 0.03, "strips": 8, "water_density": 1000.0}
GRID = {
    "origin_x": ORIGIN[0],
    "origin_y": ORIGIN[1],
    "spacing": SPACING,
    "columns": COLUMNS,
    "rows": ROWS,
}
NOISE_INTENSITY, POSITION_NOISE = 4.5e-5, 3e-4
FORCE_LEVER, ANGLE_NOISE = 2e-3, 0.01
UNKNOWN_SPEED = 0.1
MISSING_ANGLE_VARIANCE = 1e12


def linear_coefficients(gradient: Any, constant: Any = (0.0, 0.0)) -> Floats:
    """Of u = gradient @ (x, y) + constant: a B-spline counts with the value at its centre."""
    x = ORIGIN[0] + SPACING * (np.arange(COLUMNS) - 1)
    y = ORIGIN[1] + SPACING * (np.arange(ROWS) - 1)
    linear = np.tensordot(np.asarray(gradient), np.stack(np.meshgrid(x, y)), 1)
    return np.ascontiguousarray(linear + np.reshape(constant, (2, 1, 1)))


GRADIENT = np.array([[0.1, -0.4], [0.5, -0.2]])
LINEAR = linear_coefficients(GRADIENT)
WAVY = LINEAR + 0.02 * np.random.default_rng(7).standard_normal(LINEAR.shape)


def mean_drag(
    coefficients: Floats,
    mean: Floats,
    covariance: Floats | None = None,
    *,
    theta: float = 0.4,
    omega: float = 1.3,
    drag_coefficient: float = 0.5,
    orientation: str = "given",
    **block: Any,
) -> dict[str, Floats]:
    """Call the core; with "state" angle and rate are those in `mean`."""
    if orientation == "state":
        theta = omega = np.nan
    return _core.expected_drag(
        **(BLOCK | block),
        **GRID,
        coefficients=np.ascontiguousarray(coefficients),
        drag_coefficient=drag_coefficient,
        orientation=orientation,
        mean=np.ascontiguousarray(mean),
        theta=theta,
        omega=omega,
        covariance=np.zeros((mean.size, mean.size)) if covariance is None else covariance,
    )


def slope(function: Callable[[Floats], Floats], at: Floats, step: float) -> Floats:
    """Central differences: derivatives along the last axis."""
    columns = []
    for unit in np.eye(at.size):
        ahead, back = function(at + step * unit), function(at - step * unit)
        columns.append((ahead - back) / (2 * step))
    return np.stack(columns, axis=-1)


def fourth_order_slope(function: Callable[[Floats], Floats], at: Floats, steps: Floats) -> Floats:
    """Differences of five points, with a step for each number."""
    columns = []
    for unit, step in zip(np.eye(at.size), steps, strict=True):
        near, far = (
            function(at + k * step * unit) - function(at - k * step * unit) for k in (1, 2)
        )
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=-1)


def bend_covariance(
    coefficients: Floats, mean: Floats, covariance: Floats, **options: Any
) -> Floats:
    """tr(H_a V H_b V) / 2: what the mean and slope of the drag leave out, velocities uncertain.

    With the angle in the state the slopes by velocities move with them in one more way, as the turn
    of an uncertain angle does; the filter leaves that out, so H is that of the strips.
    """
    d = mean.size // 2
    if d == 3:
        flow = SplineFlow(coefficients, ORIGIN, SPACING)
        second = bend(Block(**BLOCK), flow, mean, covariance, 0.5)
    else:

        def by_velocity(velocity: Floats) -> Floats:
            moved = np.concatenate([mean[:d], velocity])
            return mean_drag(coefficients, moved, covariance, **options)["by_velocity"]

        # Small against the sd of the closing speeds, which are those of the velocities at least.
        steps = 0.02 * np.sqrt(np.diag(covariance)[d:])
        second = fourth_order_slope(by_velocity, mean[d:], steps)
    bent = second @ covariance[d:, d:]
    return 0.5 * np.einsum("akl,blk->ab", bent, bent)


def unknown_variances(d: int) -> Floats:
    """Of velocities of which nothing is known: 0.1 m/s, and the rate that has the face at it."""
    return UNKNOWN_SPEED**2 * np.array([1, 1, (2 / BLOCK["side"]) ** 2])[:d]


def sample_of(
    track: dict[str, Any], k: int, predicted: Floats | None, noise: Floats
) -> tuple[Floats, Floats]:
    """What is measured at sample k, the angle next to the predicted one, and its covariance."""
    value = np.array([track[name][k] for name in ("x", "y", "theta")[: len(noise)]])
    noise = noise.copy()
    if value.size == 3 and predicted is not None:
        if np.isnan(value[2]):
            value[2], noise[2, 2] = predicted[2], MISSING_ANGLE_VARIANCE
        turned = np.exp(1j * (value[2] - predicted[2]))
        value[2] = predicted[2] + np.angle(turned)
    return value, noise


def strengths_at(strength: Floats | None, k: int, share: float) -> Floats:
    """Of each layer, between the samples k - 1 and k; of one alone by default."""
    if strength is None:
        return np.ones(1)
    return (1 - share) * strength[:, k - 1] + share * strength[:, k]


class World(NamedTuple):
    """What drags a block along a track."""

    track: dict[str, Any]
    layers: Floats
    strength: Floats | None
    orientation: str
    acts: float = 1.0


def kicked(
    world: World, s: Floats, M: Floats, covariance: Floats, h: float, k: int, share: float
) -> tuple[Floats, ...]:
    """Return s and M after the drag of a time h; the kick, W and what its bend adds."""
    track, d = world.track, s.size // 2
    eye, still = np.eye(d), np.zeros(d)
    options: dict[str, Any] = {"orientation": world.orientation}
    weights = strengths_at(world.strength, k, share)
    coefficients = np.tensordot(weights, world.layers, 1)
    if d == 2:
        options |= {
            name: np.interp(share, [0, 1], track[name][k - 1 : k + 1])
            for name in ("theta", "omega")
        }
    found = mean_drag(coefficients, s, covariance, **options)
    found = {name: world.acts * one for name, one in found.items()}
    W = np.linalg.inv(eye - h / 2 * found["by_velocity"])
    kick = np.eye(2 * d)
    kick[d:] += h * W @ np.hstack([found["by_position"], found["by_velocity"]])
    by_parameters = np.hstack(
        [
            *(w * found["by_coefficients"].reshape(d, -1) for w in weights),
            found["acceleration"][:, None],
        ]
    )
    M = kick @ M
    M[d:] += h * W @ by_parameters
    bent = world.acts * bend_covariance(coefficients, s, covariance, **options)
    return s + np.concatenate([still, h * W @ found["acceleration"]]), M, kick, W, bent


def dense_filter(
    track: dict[str, Any],
    layers: Floats,
    *,
    orientation: str = "given",
    largest: float,
    strength: Floats | None = None,
) -> dict[str, Floats]:
    """Run the filter; the outputs are named as those of the core.

    With `strength` (K, n) there are K layers of coefficients, (K, 2, rows, columns).
    """
    time = track["time"]
    d = 3 if orientation == "state" else 2
    eye, still, half = np.eye(d), np.zeros(d), np.eye(2 * d)
    observe = np.eye(d, 2 * d)
    lever = 6 / BLOCK["side"] ** 2 * FORCE_LEVER
    intensity = NOISE_INTENSITY * np.diag([1, 1, lever**2][:d])
    noise = np.diag([POSITION_NOISE**2, POSITION_NOISE**2, ANGLE_NOISE**2][:d])
    unknown = np.diag(unknown_variances(d))
    layers = np.reshape(layers, (-1, *WAVY.shape))
    width = 2 * NODES * len(layers) + 1
    lower = np.tril_indices(d)
    rows: dict[str, list[Any]] = {"innovation": [], "covariance": [], "used": [], "state": []}
    rows |= {"whitened": [], "jacobian": []}
    s = P = M = None
    last, outliers = -np.inf, 0
    # After a gap or a contact, and no sample has given a velocity since: nothing drags, and no
    # error counts. The sample that gives it gives that of `undragged` [s] before.
    restarted, undragged = False, 0.0
    world = World(track, layers, strength, orientation)
    for k in range(time.size):
        e, S, used = np.full(d, np.nan), np.full((d, d), np.nan), False
        whitened, jacobian = np.zeros(d), np.zeros((d, width))
        interval = time[k] - time[k - 1]
        if time[k] - last > 1.0:
            restarted = restarted or s is not None
            s = None
        if s is not None:
            steps = max(1, int(np.ceil(interval / largest - 1e-9)))
            h = interval / steps
            if undragged:
                s, M, kick = kicked(world, s, M, P, undragged, k, 0.0)[:3]
                P, undragged = kick @ P @ kick.T, 0.0
            half[:d, d:] = h / 2 * eye
            for i in range(steps):
                share = (i + 0.5) / steps
                s, P, M = half @ s, half @ P @ half.T, half @ M
                middle = P + scipy.linalg.block_diag(0 * eye, h / 2 * intensity)
                dragging = world._replace(acts=float(not restarted))
                s, M, kick, W, bent = kicked(dragging, s, M, middle, h, k, share)
                spread = intensity + interval * bent
                growth = np.kron([[h**3 / 3, h**2 / 2], [h**2 / 2, h]], W @ spread @ W.T)
                s, M = half @ s, half @ M
                P = half @ kick @ P @ kick.T @ half.T + growth
            if track["excluded"][k]:
                P = P + scipy.linalg.block_diag(0 * eye, unknown)
                restarted = True
        value, R = sample_of(track, k, s, noise)
        there = not np.isnan(value[:2]).any()
        if s is not None and there:
            e, S = value - observe @ s, observe @ P @ observe.T + R
            outlier = e @ np.linalg.solve(S, e) >= 40
            used = not outlier and not track["excluded"][k] and not restarted
            L = np.linalg.cholesky(S)
            whitened, jacobian = (used * np.linalg.solve(L, one) for one in (e, observe @ M))
            outliers = outliers + 1 if outlier and not track["excluded"][k] else 0
            if outliers == 3:
                outliers = 0
                s, P = np.concatenate([value, s[d:]]), scipy.linalg.block_diag(noise, unknown)
                undragged = 0.0
                M = np.zeros((2 * d, width))
            elif outliers == 0:
                K = np.linalg.solve(S, observe @ P).T
                keep = np.eye(2 * d) - K @ observe
                s, P, M = s + K @ e, keep @ P @ keep.T + K @ R @ K.T, keep @ M
                if restarted and not track["excluded"][k]:
                    restarted, undragged = False, (time[k] - last) / 2
        whole = not np.isnan([track[name][k] for name in ("x", "y", "theta")[:d]]).any()
        prior = track.get("velocity_prior", np.full((time.size, 6), np.nan))[k]
        known = not np.isnan(prior[0])
        if whole and (s is None or (known and track["excluded"][k])):
            velocity, spread = (
                (prior[:d], np.diag(prior[3 : d + 3] ** 2)) if known else (still, unknown)
            )
            s, P = np.concatenate([value, velocity]), scipy.linalg.block_diag(noise, spread)
            outliers, undragged = 0, 0.0
            M = np.zeros((2 * d, width))
        last = time[k] if there else last
        rows["innovation"].append(e)
        rows["covariance"].append(S[lower])
        rows["used"].append(used)
        rows["state"].append(np.full(2 * d, np.nan) if s is None else s)
        rows["whitened"].extend(whitened)
        rows["jacobian"].extend(jacobian)
    return {name: np.array(values) for name, values in rows.items()}


def make_filter(track: dict[str, Any], coefficients: Floats = WAVY, **changes: Any) -> Any:
    settings: dict[str, Any] = {
        "coefficients": np.ascontiguousarray(coefficients),
        "drag_coefficient": 0.5,
        "noise_intensity": NOISE_INTENSITY,
        "position_noise": POSITION_NOISE,
        "force_lever": FORCE_LEVER,
        "angle_noise": ANGLE_NOISE,
        **BLOCK,
        **GRID,
    }
    return _core.InnovationsFilter(**track, **(settings | changes))


def run_filter(track: dict[str, Any], coefficients: Floats = WAVY, **changes: Any) -> Any:
    return make_filter(track, coefficients, **changes).run(track["time"].size)


def make_track(time: Floats, seed: int = 5) -> dict[str, Any]:
    """A block that circles and turns, with noise: no model made it."""
    rng = np.random.default_rng(seed)
    noise = POSITION_NOISE * rng.standard_normal((2, time.size))
    return {
        "time": time,
        "x": 0.05 * np.cos(0.7 * time) + noise[0],
        "y": 0.04 * np.sin(0.7 * time + 0.3) + noise[1],
        "theta": 0.4 * np.sin(time) + 0.2 * time,
        "omega": 0.4 * np.cos(time) + 0.2,
        "excluded": np.zeros(time.size, np.uint8),
    }


def difficult_track() -> dict[str, Any]:
    """Uneven clock, missing samples, a gap of 0.7 s and one of 3 s, excluded ones, an outlier, two
    in a row, and a jump. Behind the gap of 3 s and two contacts the velocity has a prior."""
    rng = np.random.default_rng(11)
    time = np.cumsum(rng.uniform(0.02, 0.16, 160))
    time[60:] += 0.7
    time[110:] += 3.0
    track = make_track(time)
    track["x"][[0, 20, 21, 22, 75, 110]] = np.nan
    track["y"][[0, 20, 21, 22, 90, 110]] = np.nan
    track["excluded"][[30, 31, 32, 21, 91]] = 1
    track["x"][45] += 0.05
    track["y"][[50, 51]] += [0.05, -0.04]
    track["x"][130:] += 0.05
    track["velocity_prior"] = np.full((160, 6), np.nan)
    track["velocity_prior"][88:] = [0.02, -0.01, 0.3, 0.02, 0.03, 0.5]
    track["velocity_prior"][32] = [-0.01, 0.03, -0.2, 0.03, 0.02, 0.4]
    return track
