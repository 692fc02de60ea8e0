"""Parameters drawn from the posterior of a fit, against what the fit states of itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, recording
from made_up_fit import made_up_fit
from scipy.special import ndtr, ndtri
from scipy.stats import kstest

import driftwalk as dw
from driftwalk.assembly import (
    assemble_drawn,
    draw_parameters,
    has_uncertainty,
    interaction_quantiles,
)
from driftwalk.assembly.runs.draws import (
    RUNS_PER_FLOW,
    draw_flow,
    draw_posterior,
    draw_quantiles,
)
from driftwalk.core.errors import InputError
from driftwalk.schema.kinds.fit import FIT

DRAG, FORCE = 0.39, 6e-4
STD, CORRELATION = (0.08, 0.12), -0.6
SHARE, LINEAR = 0.25, 2e-3


def fit(numbers: dict[str, float] | None = None, *, scale: float = 1.0) -> xr.Dataset:
    """Return a made-up fit: ln C_d and ln q known to `STD`, each number of its law to a tenth."""
    names = ["ln_drag_coefficient", "ln_noise_intensity", "ln_tracking_noise", *(numbers or {})]
    covariance = np.diag([STD[0] ** 2, STD[1] ** 2, 1.0, *(0.01 for _ in numbers or {})])
    covariance[0, 1] = covariance[1, 0] = CORRELATION * STD[0] * STD[1]
    axes = ("log_parameter", "other_log_parameter")
    found = made_up_fit().assign(covariance=(axes, scale * covariance))
    found = found.assign_coords(log_parameter=names, other_log_parameter=names)
    found.attrs["schema_version"] = FIT.version
    if not numbers:
        return found
    values, opened = list(numbers.values()), np.ones(len(numbers), bool)
    found = found.assign(number_value=("number", values), number_opened=("number", opened))
    found = found.assign_coords(number=list(numbers))
    if "linear_share" not in numbers:
        return found
    row = found.isel(parameter=[0]).assign_coords(parameter=["linear_drag"])
    return xr.concat(
        [found, row.assign(estimate=("parameter", [LINEAR]))], "parameter", data_vars="minimal"
    )


@pytest.mark.false_alarm(3e-5)
def test_draws_are_log_normal_with_the_covariance_of_the_fit(
    fresh_seed: Callable[[int], int],
) -> None:
    """False alarm 1e-5 per number; sigma_F goes with the root of the intensity q."""
    drawn = draw_parameters(fit(), runs=4000, seed=fresh_seed(1))
    logs = [np.log(drawn.drag_coefficient / DRAG), np.log(drawn.force_std / FORCE)]
    for one, std in zip(logs, (STD[0], 0.5 * STD[1]), strict=True):
        assert kstest(one / std, "norm").pvalue > 1e-5
    found = np.arctanh(np.corrcoef(*logs)[0, 1]) - np.arctanh(CORRELATION)
    assert abs(found) < -float(ndtri(0.5e-5)) / np.sqrt(4000 - 3)


@pytest.mark.slow
def test_the_intervals_of_a_real_fit_are_those_of_its_draws() -> None:
    """Its C_d holds at the stated mass: that of the filter, where an added mass is assumed."""
    known = dw.fit_motion(recording(120.0), coarse_study(), angle="none")
    drawn = draw_parameters(known, runs=20_000)
    prefix = "effective_" if "effective_force_std" in known["parameter"] else ""
    for name, values in zip(("drag_coefficient", "force_std"), drawn, strict=True):
        one = known.sel(parameter=f"{prefix}{name}")
        scale = float(known["estimate"].sel(parameter=name) / one["estimate"])
        ends = scale * one["interval"].values
        found = np.quantile(values, [0.05, 0.95])
        assert np.log(found / ends) == pytest.approx(
            [0.0, 0.0], abs=0.05 * np.log(ends[1] / ends[0])
        )


def test_a_draw_depends_on_its_address_alone() -> None:
    many, few = (draw_parameters(fit(), runs=runs, seed=5, trial=1) for runs in (300, 10))
    np.testing.assert_array_equal(many.drag_coefficient[:10], few.drag_coefficient)
    np.testing.assert_array_equal(many.force_std[:10], few.force_std)
    for other in ({"seed": 6, "trial": 1}, {"seed": 5, "trial": 2}):
        assert not np.isin(draw_parameters(fit(), runs=10, **other).force_std, few.force_std).any()


def test_numbers_of_the_law_are_drawn_with_the_drag() -> None:
    """C_d = c (1 - s), linear drag = k c s: c and s go up and down in both."""
    numbers = {"linear_share": SHARE, "force_memory": 0.2}
    drawn = draw_posterior(fit(numbers), runs=60, seed=1, trial=1)
    assert set(drawn) == {"drag_coefficient", "force_std_N", "linear_drag_kg_s", "force_memory_s"}
    for values in drawn.values():
        assert np.unique(values[:RUNS_PER_FLOW]).size == 1
        assert np.unique(values).size == 3
    both = drawn["linear_drag_kg_s"] / LINEAR, drawn["drag_coefficient"] / DRAG
    share = both[0] * SHARE / (both[0] * SHARE + both[1] * (1.0 - SHARE))
    overall = both[0] * SHARE / share
    assert 0.01 < share.std() < 0.3
    assert np.log(overall).std() == pytest.approx(STD[0], rel=1.5)
    assert (drawn["force_memory_s"] >= 0.0).all()


def test_a_fit_that_leaves_an_end_open_stays_within_what_a_study_takes() -> None:
    drawn = draw_parameters(fit(scale=1e6), runs=100)
    assert drawn.drag_coefficient.max() == 100.0
    assert drawn.force_std.max() == 10.0


def test_a_fit_without_covariance() -> None:
    assert has_uncertainty(fit())
    assert not has_uncertainty(made_up_fit())
    with pytest.raises(InputError, match="no covariance to draw parameters from"):
        draw_parameters(made_up_fit().assign_attrs(schema_version=FIT.version), runs=2)


def test_every_run_has_its_drawn_law() -> None:
    """Runs of a draw are those of `assemble` with its numbers in the study."""
    study = dw.apply_overrides(dw.Study(), {"assembly.blocks": 2, "assembly.duration_s": 1.0})
    still = dw.uniform_flow(0.02, 0.0)
    known = fit({"drag_power": 1.8})
    found = assemble_drawn(study, still, known, runs=30, trial=1)
    assert found.attrs["drawn"] == "drag_coefficient force_std drag_power"
    numbers = draw_posterior(known, runs=30, seed=study.assembly.seed, trial=1)
    np.testing.assert_array_equal(found["drag_power"], numbers["drag_power"])
    last = dw.apply_overrides(study, {"forces.drag_power": float(numbers["drag_power"][-1])})
    again = dw.assembly.assemble(
        last,
        still,
        runs=30,
        trial=1,
        drag_coefficient=numbers["drag_coefficient"],
        force_std=numbers["force_std_N"],
    )
    np.testing.assert_array_equal(found["x"][RUNS_PER_FLOW:], again["x"][RUNS_PER_FLOW:])
    assert (found["x"][:RUNS_PER_FLOW].values != again["x"][:RUNS_PER_FLOW].values).any()


def glued_fit(share: float, lengths: list[float]) -> xr.Dataset:
    """Return a made-up fit of glued blocks: its share is known to a tenth."""
    found = fit({"hidden_share": share})
    return found.assign(stirring_length_quantile=("stirring_quantile", lengths))


def test_quantiles_of_glued_blocks_are_those_of_their_posteriors() -> None:
    """Of a normal law at the middles of equal shares, cut where no share is: 0 to 1."""
    lengths = list(np.linspace(0.0, 0.1, 50))
    found = interaction_quantiles(glued_fit(0.5, lengths))
    middles = (np.arange(50) + 0.5) / 50
    expected = np.clip(0.5 + 0.1 * ndtri(middles), 0.0, 1.0)
    np.testing.assert_allclose(found["assembly.hidden_face_drag"], expected, atol=1e-12)
    assert found["forces.stirring_length_m"].tolist() == lengths
    beyond = interaction_quantiles(glued_fit(-0.05, lengths))["assembly.hidden_face_drag"]
    assert (beyond == 0.0).sum() == round(50 * ndtr(0.5))
    with pytest.raises(InputError, match="does not say what hidden faces and neighbours feel"):
        interaction_quantiles(fit())


@pytest.mark.false_alarm(1e-4)
def test_quantiles_are_drawn_alike(fresh_seed: Callable[[int], int]) -> None:
    """Each of four values as often: chi-squared of three degrees of freedom at 1e-4 is 21.1."""
    runs = 400 * RUNS_PER_FLOW
    drawn = draw_quantiles({"one": [1, 2, 3, 4]}, runs=runs, seed=fresh_seed(3), trial=1)["one"]
    assert drawn.size == runs
    assert all(np.unique(part).size == 1 for part in np.split(drawn, 400))
    counts = np.unique(drawn, return_counts=True)[1] / RUNS_PER_FLOW
    assert ((counts - 100.0) ** 2 / 100.0).sum() < 21.1


def test_every_run_has_its_drawn_share_and_length() -> None:
    """Runs of a draw are those of `assemble` with its numbers in the study."""
    study = dw.apply_overrides(dw.Study(), {"assembly.blocks": 3, "assembly.duration_s": 4.0})
    still = dw.uniform_flow(0.02, 0.0)
    quantiles = {
        "assembly.hidden_face_drag": [0.2, 0.4, 0.6, 0.8],
        "forces.stirring_length_m": [0.0, 0.02, 0.05, 0.1],
    }
    how = {"runs": 30, "trial": 1, "flow_draws": "none"}
    found = assemble_drawn(study, still, fit(), quantiles=quantiles, **how)
    drawn = "drag_coefficient force_std hidden_face_drag_share stirring_length"
    assert found.attrs["drawn"] == drawn
    last = dw.apply_overrides(
        study,
        {
            "assembly.hidden_face_drag": float(found["hidden_face_drag_share"][-1]),
            "forces.stirring_length_m": float(found["stirring_length"][-1]),
        },
    )
    given = {name: found[name].values for name in ("drag_coefficient", "force_std")}
    again = dw.assembly.assemble(last, still, runs=30, trial=1, **given)
    np.testing.assert_array_equal(found["x"][RUNS_PER_FLOW:], again["x"][RUNS_PER_FLOW:])
    assert (found["x"][:RUNS_PER_FLOW].values != again["x"][:RUNS_PER_FLOW].values).any()
    # The other draws are those of a prediction without a fit of glued blocks.
    plain = assemble_drawn(study, still, fit(), **how)
    np.testing.assert_array_equal(plain["force_std"], found["force_std"])


def test_a_simulation_depends_on_drag_and_force_over_the_mass() -> None:
    """Why what the mass leaves open is not drawn: twice of all three is the same motion."""
    water, common = dw.uniform_flow(0.05, 0.0), {"sample_time": [0.0, 1.0, 5.0], "seed": 1}
    base = {"block.mass_kg": 0.01, "block.depth_m": 0.01, "forces.drag_coefficient": 0.4}
    base["forces.force_std_N"] = 5e-4
    twice = {name: value if "depth" in name else 2.0 * value for name, value in base.items()}
    one, two = (
        dw.simulate(dw.apply_overrides(dw.Study(), chosen), water, backend="reference", **common)
        for chosen in (base, twice)
    )
    np.testing.assert_allclose(one["x"], two["x"], rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.false_alarm(2e-4)
def test_errors_of_a_fitted_flow_go_together_over_its_knots(
    fresh_seed: Callable[[int], int],
) -> None:
    """Standard errors stay; nodes within a fifth of a knot move alike, those far apart do not."""
    flow = dw.uniform_flow(0.0, 0.0)
    step, distance = float(np.diff(flow["x"])[0]), 0.05
    error = xr.full_like(flow["u"], 2e-3)
    flow = flow.assign(u_standard_error=error, v_standard_error=error)
    address = {"seed": fresh_seed(2), "trial": 1, "correlated_over": distance}
    fields = [draw_flow(flow, draw=draw, **address)["u"].values / 2e-3 for draw in range(600)]
    moves = np.stack(fields)
    # 600 numbers of variance 1: their mean square has a width of sqrt(2 / 600) = 0.058.
    row = moves.shape[1] // 2
    for column in (0, 7, moves.shape[2] - 1):
        assert (moves[:, row, column] ** 2).mean() == pytest.approx(1.0, abs=0.25)
    near = max(1, round(0.2 * distance / step))
    far = round(5.0 * distance / step)
    correlated = [np.corrcoef(moves[:, row, 0], moves[:, row, at])[0, 1] for at in (near, far)]
    assert correlated[0] > 0.9
    assert abs(correlated[1]) < 0.17
