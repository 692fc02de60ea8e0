"""The particle filter: how particles are drawn, and what they begin with."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from driftwalk.core.random_streams import world_keys
from driftwalk.likelihood.contacts import particles
from driftwalk.likelihood.contacts.particles import (
    PARTICLE,
    PASSAGE,
    Part,
    Passages,
    WallLikelihood,
    _propagated,
    _resampled,
    _with_short_force_interval,
    filtered_covariance,
    passages_of,
    thinned,
)
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import build_flow_field
from driftwalk.simulation.backend import Camera, native_model


def test_particles_are_drawn_by_their_weights() -> None:
    weight = np.array([[0.0, 3.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    state = [np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]])]
    (drawn,) = _resampled(state, weight, np.array([[0.5], [0.5]]))
    assert drawn.tolist() == [[1.0, 1.0, 1.0, 2.0], [4.0, 5.0, 6.0, 7.0]]


def test_what_is_known_of_a_state_is_a_steady_filter() -> None:
    """The Riccati equation of a steady state, held to scipy's solution."""
    from scipy.linalg import solve_discrete_are

    noise, q, dt = 3e-4, 4e-5, 0.1
    moved = np.array([[1.0, dt], [0.0, 1.0]])
    added = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    predicted = solve_discrete_are(moved.T, np.array([[1.0], [0.0]]), added, noise**2)
    gain = predicted[:, 0] / (predicted[0, 0] + noise**2)
    want = predicted - np.outer(gain, predicted[0])
    np.testing.assert_allclose(filtered_covariance(noise, q, dt), want, rtol=1e-4)


@pytest.mark.parametrize("rate", [10.0, 120.0, 500.0])
def test_the_force_is_as_strong_whatever_the_rate_of_the_camera(rate: float) -> None:
    """The spread of the positions one interval after rest, in still water: sd² = q t³ / 3."""
    interval = 1.0 / rate
    forces = {"forces.force_interval_s": 0.016, "forces.force_std_N": 1e-3}
    study = _with_short_force_interval(apply_overrides(Study(), forces), interval)
    axis = np.linspace(-0.15, 0.15, 11)
    x, _ = np.meshgrid(axis, axis)
    still = build_flow_field(axis, axis, u=0 * x, v=0 * x, flag=np.ones(x.shape, dtype=np.int8))
    step, count = study.time_step_s, 4000
    model = native_model(study, still, np.array([interval, interval + step]), Camera())
    state = [np.zeros((1, count)) for _ in range(6)]
    keys = world_keys(0, trial=0, replicate=np.arange(count))
    moved = _propagated(model, study, state, keys, step)
    pose, motion = moved[:3], moved[3:]
    intensity = (1e-3 / study.block.mass_kg) ** 2 * 0.016
    # Two held draws in place of white noise: (4 + 1) / 16 in place of 1 / 3, and the rate is
    # that of the step after the sample.
    assert pose[0].std() == pytest.approx(np.sqrt(intensity * interval**3 / 3.0), rel=0.1)
    assert motion[0].std() == pytest.approx(np.sqrt(intensity * interval), rel=0.15)


POINT = Point(
    np.zeros((2, 1, 1)), 0.0, math.log(2e-3), math.log(3e-4), math.log(3e-3), math.log(0.01)
)


def passages_at(*contacts: int, samples: int = 100, **broken: Any) -> Passages:
    """Return the passages of a series with these left out; x of a sample is its number."""
    count = np.arange(float(samples))
    excluded = np.isin(count, contacts).astype(np.uint8)
    time, x = 0.1 * count, count.copy()
    for late in broken.get("late", ()):
        time[late:] += 0.1
    x[list(broken.get("lost", ()))] = np.nan
    series = Series(time, x, 100.0 + count, 200.0 + count, 0.0 * count, excluded)
    states = np.outer(count, np.ones(6))
    states[list(broken.get("unknown", ()))] = np.nan
    passes = SimpleNamespace(states=lambda *_: states)
    return passages_of(SimpleNamespace(point=POINT, passes=passes), series)  # type: ignore[arg-type]


def spans(found: Passages) -> list[tuple[int, int]]:
    """Return the first and the last sample of each passage."""
    return [(int(np.nanmin(row)), int(np.nanmax(row))) for row in found.x]


def test_a_passage_goes_from_before_the_wall_to_behind_it() -> None:
    """Three samples before the first contact, four behind the last; near ones are one passage."""
    found = passages_at(20, 22, 25, 50)
    assert spans(found) == [(17, 29), (47, 54)]
    # It begins at the state of the sample before, and holds all three coordinates.
    assert found.state[:, 0].tolist() == [16.0, 46.0]
    length = PASSAGE.longest + PASSAGE.before + 1
    assert found.x.shape == found.y.shape == found.theta.shape == (2, length)
    for axis, off in ((found.y, 100.0), (found.theta, 200.0)):
        np.testing.assert_array_equal(axis - off, found.x)
    assert np.isfinite(found.x).sum(axis=1).tolist() == [13, 8]


def test_a_long_passage_is_cut() -> None:
    assert spans(passages_at(*range(20, 60))) == [(17, 19 + PASSAGE.longest)]


@pytest.mark.parametrize(
    ("contacts", "broken", "wanted"),
    [
        ((3, 50), {}, [(47, 54)]),  # too near the beginning
        ((4, 50), {}, [(47, 54)]),
        ((5, 50), {}, [(2, 9), (47, 54)]),
        ((50, 94), {}, [(47, 54), (91, 98)]),
        ((50, 95), {}, [(47, 54)]),  # too near the end
        ((50, 99), {}, [(47, 54)]),
        ((20, 30), {}, [(17, 24), (27, 34)]),
        ((20, 50), {"lost": [46]}, [(17, 24)]),
        ((20, 50), {"lost": [54]}, [(17, 24)]),
        ((20, 50), {"lost": [45, 55]}, [(17, 24), (47, 54)]),
        ((20, 50), {"late": [47]}, [(17, 24)]),
        ((20, 50), {"late": [46, 55]}, [(17, 24), (47, 54)]),
        ((20, 50), {"unknown": [16]}, [(47, 54)]),
        ((), {}, []),
    ],
)
def test_passages_that_are_whole_count(
    contacts: tuple[int, ...], broken: dict[str, list[int]], wanted: list[tuple[int, int]]
) -> None:
    found = passages_at(*contacts, **broken)
    assert spans(found) == wanted
    assert found.state.shape == (len(wanted), 6)


def test_a_share_of_the_passages_is_taken_evenly() -> None:
    some = Passages(*(np.arange(9.0)[:, None] for _ in range(4)))
    assert thinned(some, 0.33).x.ravel().tolist() == [0.0, 4.0, 8.0]
    assert thinned(some, 0.01).x.ravel().tolist() == [0.0]
    assert thinned(some, 1.0).state.ravel().tolist() == list(range(9))


def walls() -> WallLikelihood:
    return WallLikelihood(Study(), POINT, [], 3)


def test_particles_have_twice_the_noise_of_the_camera() -> None:
    """The angle is turned by the force at its lever over the moment of a square, a^2 / 6."""
    found = walls()
    assert found.noises == pytest.approx((6e-4, 6e-4, 0.02))
    side = Study().block.side_m
    turning = 2e-3 * (3e-3 / (side**2 / 6.0)) ** 2
    assert found.intensity == pytest.approx([2e-3, 2e-3, turning])


def test_densities_are_those_of_a_normal_law_or_of_a_mistake() -> None:
    found = walls()
    one = np.array([[0.01, np.nan]])
    passages = Passages(one, one + 0.02, one + 3.0, np.zeros((1, 6)))
    pose = [np.array([[0.0104, 0.05]]), np.array([[0.0297, 0.03]]), np.array([[3.02, 3.0]])]
    pose[2] = pose[2] - 2.0 * np.pi  # an angle, and not a number of turns
    logs = found._densities(passages, 0, pose)
    law = multivariate_normal(np.zeros(3), np.diag(np.square(found.noises)))
    width = Study().tank.extent_m[0]
    anywhere = PARTICLE.mistake / (width**2 * 2.0 * np.pi)
    for k, turned in ((0, 0.01), (1, -0.01)):
        apart = np.array([pose[0][0, k] - 0.01, pose[1][0, k] - 0.03, turned])
        assert logs[0, k] == pytest.approx(math.log(law.pdf(apart) + anywhere), rel=1e-6)
    # Behind the end of a passage all particles are alike.
    np.testing.assert_allclose(np.diff(found._densities(passages, 1, pose)), 0.0, atol=1e-12)


def test_particles_begin_about_the_state_that_the_filter_knows() -> None:
    """Their moments within five standard errors of the covariance, half as wide again."""
    found, count = walls(), 40
    state = np.arange(6.0) + np.zeros((count, 6))
    none = np.zeros((count, 1))
    passages = Passages(none, none, none, state)
    first = found._first(passages, 0.1, np.random.default_rng(2))
    number = count * PARTICLE.particles
    for a in range(3):
        wanted = 2.25 * filtered_covariance(found.noises[a], found.intensity[a], 0.1)
        drawn = np.stack([first[a].ravel() - a, first[a + 3].ravel() - a - 3])
        scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
        assert np.abs((np.cov(drawn) - wanted) / scale).max() < 5.0 * math.sqrt(2.0 / number)
        assert (np.abs(drawn.mean(axis=1)) < 5.0 * np.sqrt(np.diag(wanted) / number)).all()


def test_the_likelihood_of_a_body_that_nothing_pushes_is_that_of_its_path(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Particles that go on as they did, with next to no noise of their own.

    The product over the samples of the density of the recorded pose about the particle's: then
    there is nothing to draw by chance. Two parts add up, and what is behind the end of a passage
    counts for nothing.
    """
    monkeypatch.setattr(particles, "native_model", lambda *_: None)
    monkeypatch.setattr(
        particles, "PARTICLE", PARTICLE._replace(particles=4, spread=1e-9, rough=1e-9)
    )

    def drift(_: Any, study: Any, state: Any, keys: Any, step: float) -> Any:
        assert keys.size == state[0].size
        pose = [one + 0.1 * rate for one, rate in zip(state[:3], state[3:], strict=True)]
        return [*pose, *state[3:]]

    monkeypatch.setattr(particles, "_propagated", drift)
    state = np.array([[0.0, 0.01, 0.1, 0.02, -0.01, 0.3], [0.05, 0.0, 1.0, 0.0, 0.0, 0.0]])
    after = 0.1 * np.arange(1, 4)
    poses = state[:, :3, None] + state[:, 3:, None] * after
    off = 1e-4 * np.random.default_rng(1).normal(size=poses.shape) * np.array([1, 1, 50])[:, None]
    seen = poses + off
    seen[1, :, 2] = np.nan
    part = Part(Passages(seen[:, 0], seen[:, 1], seen[:, 2], state), None, 0.1)  # type: ignore[arg-type]
    found = WallLikelihood(Study(), POINT, [part, part], 3)
    law = multivariate_normal(np.zeros(3), np.diag(np.square(found.noises)))
    anywhere = PARTICLE.mistake / (Study().tank.extent_m[0] ** 2 * 2.0 * np.pi)
    wanted = sum(
        math.log(law.pdf(off[row, :, k]) + anywhere)
        for row, k in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1))
    )
    assert found.log_likelihood(0.5, 0.2) == pytest.approx(2.0 * wanted, rel=1e-5)
