"""Principal components of class proportions, against the eigenvectors of the covariance matrix."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.linalg import eigh

from driftwalk.assembly.outcomes.components import disconnected_alignment, principal_components
from driftwalk.assembly.outcomes.outcome_classes import outcome_classes
from driftwalk.core.errors import InputError

CLASSES = list(outcome_classes(4))
APART = np.array(["+" in name for name in CLASSES])
NEVER = CLASSES.index("T")


def sensitivity(*, seed: int = 1, runs: int = 1000) -> xr.Dataset:
    """A made-up map of 6 by 5 settings; class T never occurs, one setting is missing."""
    rng = np.random.default_rng(seed)
    p = rng.dirichlet(np.linspace(0.3, 2.0, 10), size=(6, 5))
    p[..., NEVER] = 0.0
    p /= p.sum(axis=-1, keepdims=True)
    p = rng.multinomial(runs, p) / runs
    p[2, 3] = np.nan
    axes = ("drag_coefficient", "force_std")
    return xr.Dataset(
        {"proportion": ((*axes, "class"), p), "runs": (axes, np.full((6, 5), runs))},
        coords={
            "drag_coefficient": np.linspace(0.1, 1.5, 6),
            "force_std": ("force_std", np.linspace(0, 1e-3, 5), {"units": "N"}),
            "class": ("class", np.array(CLASSES, dtype=object)),
        },
        attrs={"kind": "sensitivity", "schema_version": 3, "reference_runs": 10_000},
    )


def test_components_are_eigenvectors_of_the_covariance() -> None:
    data = sensitivity()
    found = principal_components(data)
    table = data["proportion"].values.reshape(-1, 10)
    table = table[np.isfinite(table).all(axis=1)]
    values, vectors = eigh(np.cov(table.T))
    values, vectors = values[::-1], vectors[:, ::-1]
    # Nine classes that occur and sum to one.
    assert found.sizes["component"] == 8
    np.testing.assert_allclose(
        found["explained_variance_ratio"], values[:8] / values.sum(), rtol=1e-9
    )
    assert found.attrs["total_variance"] == pytest.approx(values.sum())
    cosine = np.abs((found["loading"].values * vectors[:, :8]).sum(axis=0))
    np.testing.assert_allclose(cosine, 1.0, rtol=1e-9)
    np.testing.assert_allclose(found["mean"], table.mean(axis=0))


def test_scores_and_loadings_give_the_proportions_back() -> None:
    data = sensitivity()
    found = principal_components(data)
    back = found["mean"] + (found["score"] * found["loading"]).sum("component", skipna=False)
    np.testing.assert_allclose(back.transpose(..., "class"), data["proportion"], atol=1e-12)


def test_the_form_of_the_dataset() -> None:
    found = principal_components(sensitivity(), components=2)
    assert found["score"].dims == ("drag_coefficient", "force_std", "component")
    assert found["loading"].dims == ("class", "component")
    assert found["component"].values.tolist() == [1, 2]
    assert np.isnan(found["score"].values[2, 3]).all()
    assert np.isfinite(found["score"].values).sum() == 2 * 29
    assert (found.attrs["settings"], found.attrs["left_out"]) == (29, 1)
    assert (found.attrs["kind"], found.attrs["schema_version"]) == ("components", 1)
    assert found.attrs["reference_runs"] == 10_000
    assert found["force_std"].attrs["units"] == "N"
    whole = principal_components(sensitivity())
    xr.testing.assert_allclose(found["score"], whole["score"][..., :2])


def test_signs_and_the_class_that_never_occurs() -> None:
    loading = principal_components(sensitivity())["loading"].values
    assert (loading[np.abs(loading).argmax(axis=0), np.arange(8)] > 0).all()
    assert (loading[NEVER] == 0.0).all()
    np.testing.assert_allclose((loading**2).sum(axis=0), 1.0)


def test_the_order_of_dimensions_and_settings_does_not_matter() -> None:
    data = sensitivity()
    turned = data["proportion"].transpose("class", "force_std", "drag_coefficient")
    found = principal_components(turned)
    expected = principal_components(data)
    assert found["score"].dims == ("force_std", "drag_coefficient", "component")
    xr.testing.assert_allclose(found["score"].transpose(*expected["score"].dims), expected["score"])
    assert np.isnan(found.attrs["noise_share"])


def test_an_array_is_taken_as_settings_by_classes() -> None:
    data = sensitivity()["proportion"].values
    by_name = principal_components(data, classes=CLASSES)
    plain = principal_components(data)
    assert by_name["score"].dims == ("axis_0", "axis_1", "component")
    np.testing.assert_array_equal(by_name["loading"], plain["loading"])
    assert plain["class"].values.tolist() == [str(i) for i in range(10)]
    # Of numbered classes it is not known which are complete.
    assert np.isnan(plain["complete_correlation"]).all()


@pytest.mark.false_alarm(1e-5)
def test_settings_that_differ_by_chance_only_are_all_noise(
    fresh_seed: Callable[[int], int],
) -> None:
    """2000 samples of one distribution: the share is 1, with a scatter of about 2 %."""
    p = np.array([0.4, 0.3, 0.2, 0.1])
    drawn = np.random.default_rng(fresh_seed(2)).multinomial(200, p, size=2000) / 200
    data = xr.Dataset(
        {"proportion": (("setting", "class"), drawn), "runs": ("setting", np.full(2000, 200))},
        coords={"class": ["O", "I", "2+2", "1+1+1+1"]},
    )
    assert principal_components(data).attrs["noise_share"] == pytest.approx(1.0, abs=0.1)


def test_the_share_of_noise_by_hand() -> None:
    """Two settings of 101 and 11 runs: 2 * 0.25 / 100 and 2 * 0.09 / 10, on the mean."""
    data = xr.Dataset(
        {
            "proportion": (("setting", "class"), [[0.5, 0.5], [0.9, 0.1]]),
            "runs": ("setting", [101, 11]),
        },
        coords={"class": ["O", "2+2"]},
    )
    attrs = principal_components(data).attrs
    assert attrs["total_variance"] == pytest.approx(2 * 0.4**2 / 2)
    assert attrs["noise_share"] == pytest.approx((0.005 + 0.018) / 2 / 0.16)


def mixture(share: np.ndarray) -> np.ndarray:
    """Settings that differ only in how many runs stay disconnected, T never occurring."""
    apart = APART / APART.sum()
    whole = ~APART & (np.arange(10) != NEVER)
    return share[:, None] * apart + (1 - share)[:, None] * whole / whole.sum()


def test_one_direction_from_complete_to_disconnected() -> None:
    found = principal_components(mixture(np.array([0.0, 0.1, 0.2, 0.9])), classes=CLASSES)
    assert found.sizes["component"] == 1
    alignment = disconnected_alignment(found)
    sign = np.sign(found["loading"].sel({"class": "2+2"}).item())
    assert alignment.cosine == pytest.approx(sign)
    assert alignment.complete_correlation == pytest.approx(-sign)
    # Five disconnected classes gain 1/5 each, four complete ones lose 1/4.
    assert alignment.loading_share == pytest.approx((1 / 5) / (1 / 5 + 1 / 4))
    assert alignment.class_share == pytest.approx(5 / 9)


def test_a_component_among_complete_classes_is_not_aligned() -> None:
    """The first component trades I for O; the second trades both for pairs."""
    p = [[0.8, 0.2, 0.0], [0.2, 0.8, 0.0], [0.4, 0.4, 0.2], [0.4, 0.4, 0.2]]
    found = principal_components(p, classes=["I", "O", "2+2"])
    first, second = (disconnected_alignment(found, component=i) for i in (1, 2))
    assert first.loading_share == pytest.approx(0.0, abs=1e-20)
    assert first.cosine == pytest.approx(0.0, abs=1e-12)
    assert first.complete_correlation == pytest.approx(0.0, abs=1e-12)
    assert second.loading_share == pytest.approx(2 / 3)
    assert second.cosine == pytest.approx(1.0)
    assert second.complete_correlation == pytest.approx(-1.0)


def test_the_correlation_with_complete_is_that_of_numpy() -> None:
    data = sensitivity()
    found = principal_components(data)
    used = np.isfinite(data["proportion"].values).all(axis=-1)
    complete = data["proportion"].values[used][:, ~APART].sum(axis=1)
    for i in range(8):
        expected = np.corrcoef(found["score"].values[used][:, i], complete)[0, 1]
        assert float(found["complete_correlation"][i]) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        ([[0.5, 0.5]], {}, "at least two settings, got 1"),
        ([[0.5, 0.5], [np.nan, 0.5]], {}, "at least two settings, got 1"),
        ([[0.5, 0.5]] * 3, {}, "the same in all settings"),
        ([0.5, 0.5], {}, "expected shape \\(..., class\\)"),
        ([[3, 4], [5, 2]], {}, "between 0 and 1: divide counts"),
        ([[-0.5, 1.5], [0.5, 0.5]], {}, "between 0 and 1"),
        ([[0.5, 0.5], [0.4, 0.6]], {"components": 0}, "components must be at least 1"),
        ([[0.5, 0.5], [0.4, 0.6]], {"components": 2}, "asked for 2, .* vary along 1 only"),
        ([[0.5, 0.5], [0.4, 0.6]], {"classes": ["O"]}, "1 names for 2 classes"),
        (sensitivity(), {"classes": CLASSES}, "only for an array"),
        (xr.Dataset(), {}, "'proportion' is missing"),
        (sensitivity()["proportion"].rename({"class": "kind"}), {}, "a dimension 'class'"),
        (sensitivity()["proportion"][0, 0], {}, "at least one other"),
    ],
)
def test_what_cannot_be_decomposed_is_said(
    given: Any, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        principal_components(given, **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("classes", "component", "message"),
    [
        (["O", "2+2"], 2, "there is no component 2: there are 1, from 1"),
        (["O", "I"], 1, "there must be both"),
        (["2+2", "2+1+1"], 1, "there must be both"),
    ],
)
def test_what_has_no_alignment_is_said(classes: list[str], component: int, message: str) -> None:
    found = principal_components([[0.5, 0.5], [0.4, 0.6]], classes=classes)
    with pytest.raises(InputError, match=message):
        disconnected_alignment(found, component=component)


def test_alignment_wants_components() -> None:
    with pytest.raises(InputError, match="got sensitivity"):
        disconnected_alignment(sensitivity())
