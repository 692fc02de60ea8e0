"""Free bodies in one recording: the joint likelihood against a dense one, and what it tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from euler_blocks import DEPTH_M, FORCE_INTERVAL_S, MASS_KG, SIDE_M
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from driftwalk import InputError, Study, apply_overrides
from driftwalk.conditions import one_body_each
from driftwalk.likelihood.filter.difference_pairs import factor, forward
from driftwalk.likelihood.interaction.shared_stirring import (
    JointErrors,
    joint_errors,
    joint_log_likelihoods,
)
from driftwalk.likelihood.preparation import PreparedRecordings, prepare
from driftwalk.likelihood.start import first_point
from driftwalk.schema import build_trajectory

STUDY = apply_overrides(
    Study(),
    {
        "tank.diameter_m": 0.32,
        "block.side_m": SIDE_M,
        "block.mass_kg": MASS_KG,
        "block.depth_m": DEPTH_M,
        "forces.force_interval_s": FORCE_INTERVAL_S,
        "fit.interaction": True,
    },
)


def recording(samples: int = 400) -> xr.Dataset:
    """Return two blocks that go round at two speeds, one through the other, with a noisy camera."""
    time, noise = 0.1 * np.arange(samples), np.random.default_rng(5)
    turned = np.outer(time, [0.3, 0.5]) - [0.0, 0.5 * np.pi]
    x, y, theta = 0.06 * np.cos(turned), 0.06 * np.sin(turned), 0.5 * turned
    x, y, theta = (one + 3e-4 * noise.normal(size=one.shape) for one in (x, y, theta))
    return build_trajectory(time, x, y, theta)


def small_errors() -> JointErrors:
    """Return two made-up filters of 9 samples, in which a sample lacks and a state begins anew."""
    rng = np.random.default_rng(3)
    count, bodies, size, width = 9, 2, 4, 2
    shape = (count, bodies)
    transition = np.eye(size) + 0.3 * rng.normal(size=(*shape, size, size))
    drive = 0.5 * rng.normal(size=(*shape, size, 3))
    rest = 0.2 * rng.normal(size=(*shape, size, size))
    transition[5, 1], drive[5, 1] = 0.0, 0.0
    seen = np.ones(shape, dtype=bool)
    seen[3, 0] = seen[5, 1] = False
    return JointErrors(
        transition=transition,
        noise=drive @ drive.swapaxes(2, 3) + rest @ rest.swapaxes(2, 3),
        drive=drive,
        gain=np.where(seen[..., None, None], 0.4 * rng.normal(size=(*shape, size, width)), 0.0),
        innovation=np.where(seen[..., None], rng.normal(size=(*shape, width)), 0.0),
        sample_noise=np.tile(0.3 * np.eye(width), (*shape, 1, 1)),
        seen=seen,
        apart=np.ones((*shape, bodies)),
    )


def dense(errors: JointErrors, rho: Sequence[float]) -> float:
    """Return the log density of all innovations by the covariance of the noises behind them."""
    count, bodies, size, width = errors.gain.shape
    noises, kept, values = [], [], []
    for k in range(count):
        noise = block_diag(*errors.noise[k])
        across = rho[k] * errors.drive[k, 0] @ errors.drive[k, 1].T
        noise[:size, size:], noise[size:, :size] = across, across.T
        noises += [noise, block_diag(*errors.sample_noise[k])]
    basis = np.eye(count * bodies * (size + width))
    state, rows = np.zeros((bodies * size, len(basis))), []
    for k in range(count):
        first = k * bodies * (size + width)
        state = block_diag(*errors.transition[k]) @ state + basis[first : first + bodies * size]
        sample = basis[first + bodies * size :][: bodies * width]
        places = np.concatenate([state[:width], state[size : size + width]])
        seen = np.repeat(errors.seen[k], width)
        innovation = places + sample
        rows.append(innovation[seen])
        values.append(errors.innovation[k].ravel()[seen])
        state = state - block_diag(*errors.gain[k]) @ innovation
        kept.append(seen)
    of_noises = np.concatenate(rows)
    covariance = of_noises @ block_diag(*noises) @ of_noises.T
    value = np.concatenate(values)
    constant = 0.5 * value.size * np.log(2.0 * np.pi)
    return float(multivariate_normal(cov=covariance).logpdf(value)) + constant


def test_the_joint_likelihood_is_that_of_a_dense_covariance() -> None:
    errors = small_errors()
    trials = np.array([np.zeros(9), np.full(9, 0.6), np.linspace(-0.7, 0.9, 9)])
    found = joint_log_likelihoods(errors, lambda k: np.tile(trials[:, k, None, None], (1, 2, 2)), 3)
    assert found == pytest.approx([dense(errors, rho) for rho in trials], abs=1e-9)


@pytest.mark.parametrize(
    ("angle", "memory"), [("state", 0.0), ("given", 0.0), ("none", 0.0), ("state", 0.2)]
)
def test_without_correlation_it_is_that_of_the_filters(angle: str, memory: float) -> None:
    """With a gap, a mistake of the tracker, and contacts, at any use of the angle."""
    made = recording()
    made["x"].values[200:230] = np.nan
    made["y"].values[350, 1] += 0.01
    ready = prepare([made], STUDY, angle, None)  # type: ignore[arg-type]
    point = first_point(ready)
    point = replace(point, log_intensity=np.log(3e-5), log_noise=np.log(4e-4))
    if memory:
        point = point.with_extra("force_memory", memory)
    errors = joint_errors(ready.passes, point, ready.series)
    (found,) = joint_log_likelihoods(errors, lambda _: np.zeros((1, 2, 2)), 1)
    assert found == pytest.approx(sum(alone(ready, point)), rel=1e-9)
    # All that a body's noise has in common with a like one's: the whole of it but the torque.
    shared = errors.drive @ errors.drive.swapaxes(2, 3)
    driven = errors.drive.any(axis=(2, 3))
    assert driven.mean() > 0.5
    velocities = slice(errors.innovation.shape[2], errors.innovation.shape[2] + 2)
    np.testing.assert_allclose(
        shared[driven][:, velocities, velocities],
        errors.noise[driven][:, velocities, velocities],
        atol=1e-20,
    )


def alone(ready: PreparedRecordings, point: object) -> list[float]:
    """Return the log likelihood of each body's innovations by its own filter."""
    found, times = [], [one.time for one in ready.series]
    for own, other in ((0, 1), (1, 0)):
        series = ready.series[own].at(np.flatnonzero(np.isin(times[own], times[other])))
        one = ready.passes.kernel(series, point).run(series.time.size, errors=True)  # type: ignore[arg-type]
        before, after = one["errors"][:, 1], one["errors"][:, 2]
        taken = np.isfinite(one["innovation"][:, 0]) & (before != after).any(axis=(1, 2))
        taken &= one["errors"][:, 0].any(axis=(1, 2))
        root = factor(one["covariance"][taken])
        white = forward(root, one["innovation"][taken].T)
        found.append(-0.5 * (white**2).sum() - np.log(np.einsum("aan->an", root)).sum())
    return found


def test_intervals_in_which_bodies_may_touch_are_left_out() -> None:
    made = recording()
    apart = np.hypot(*(np.diff(made[axis].values, axis=1)[:, 0] for axis in "xy"))
    together = prepare([made], STUDY, None, None).series
    free = apply_overrides(STUDY, {"fit.interaction": False})
    one_by_one = [prepare([made], free, None, body).series[0] for body in ("0", "1")]
    limit = SIDE_M * np.sqrt(2.0) + 2e-3
    for both, alone_in_tank in zip(together, one_by_one, strict=True):
        near = (both.excluded != 0) & (alone_in_tank.excluded == 0)
        assert near[1:][apart[:-1] < limit].all()
        # Bodies go less than a centimetre in an interval.
        assert not near[1:][apart[:-1] > limit + 0.01].any()
        assert near.any()


def test_bodies_that_cannot_be_compared_are_refused() -> None:
    made = recording(50)
    assert [one.sizes["body"] for one in one_body_each([made], STUDY)] == [1, 1]
    with pytest.raises(InputError, match="2 to 8 bodies can be compared, and the recording has 1"):
        one_body_each([made.isel(body=[0])], STUDY)
    with pytest.raises(InputError, match="free single bodies, and xx is glued"):
        one_body_each([made], apply_overrides(STUDY, {"block.shape": "xx"}))
