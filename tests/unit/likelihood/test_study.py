"""The study of the likelihood fit: its worlds, what is lost of a recording, its tables."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

STUDY = Path(__file__).resolve().parents[3] / "studies" / "likelihood"


@pytest.fixture(scope="module", autouse=True)
def _study_on_the_path() -> Iterator[None]:
    sys.path.insert(0, str(STUDY))
    yield
    sys.path.remove(str(STUDY))


@pytest.fixture(scope="module")
def worlds() -> ModuleType:
    return import_module("worlds")


@pytest.fixture(scope="module")
def sets() -> ModuleType:
    return import_module("study_sets")


@pytest.mark.parametrize("family", ["regular", "irregular"])
def test_flows_have_the_speed_of_a_stirred_tank(worlds: ModuleType, family: str) -> None:
    x, y = np.meshgrid(worlds.AXIS, worlds.AXIS)
    inside = np.hypot(x, y) < worlds.RADIUS_M
    for seed in range(10):
        u, v = worlds.draw_flow(np.random.default_rng(seed), family)
        assert 0.03 < np.sqrt(np.mean((u**2 + v**2)[inside])) < 0.08


def test_an_irregular_flow_is_a_stream_function_and_an_even_sink(worlds: ModuleType) -> None:
    """Central differences of a stream function have no divergence at all."""
    u, v = worlds.draw_flow(np.random.default_rng(3), "irregular")
    divergence = np.gradient(u, worlds.AXIS, axis=1) + np.gradient(v, worlds.AXIS, axis=0)
    inner = divergence[2:-2, 2:-2]
    assert np.ptp(inner) < 1e-9
    assert -0.6 <= inner.mean() <= -0.2


def test_cases_do_not_share_seeds_or_files(sets: ModuleType) -> None:
    worlds = {
        (one.set_name, one.number): one for name in sets.WORLDS for one in sets.cases_of(name)
    }
    assert len({one.seed for one in worlds.values()}) == len(worlds)
    assert len({one.file for one in worlds.values()}) == len(worlds)


def test_what_is_lost_of_a_recording(sets: ModuleType) -> None:
    """20 % of 18,001 at random: the sd of the share is 0.3 %; three minutes are 1800 samples."""
    still = sets.Poses(*np.zeros((3, 72_001)))
    found = {
        one.condition.name: sets.record(one, still)
        for one in sets.cases_of("lengths", 1)
        if one.condition.minutes == 30.0
    }
    assert found["30 min"].sizes["time"] == 18_001
    assert 1 - found["20 % of the samples lost"].sizes["time"] / 18_001 == pytest.approx(
        0.2, abs=0.012
    )
    hole = found["3 minutes lost"]
    assert hole.sizes["time"] == 18_001 - 1800
    assert np.diff(hole["time"].values).max() == pytest.approx(180.1)
    noise = {name: float(one["x"].values.std()) for name, one in found.items()}
    assert noise["30 min"] == pytest.approx(0.3e-3, rel=0.03)
    assert noise["0.1 mm, 0.2°"] == pytest.approx(0.1e-3, rel=0.03)
    assert noise["1 mm, 1.5°"] == pytest.approx(1e-3, rel=0.03)


def test_figures_of_results() -> None:
    """Against numbers worked out by hand; a recording at the wall and a failure are left out."""
    summary = import_module("summary")

    def line(error: float, *, wall: float = 0.1) -> dict[str, object]:
        parameter = {
            f"{name}_{key}": value
            for name in summary.WITH_INTERVAL
            for key, value in {"error": error, "z": 10 * error, "covered": error < 0.1}.items()
        }
        more = {"flow_error": 0.05, "flow_point_error": "nan", "wall_share": wall, "seconds": 1.0}
        return {**parameter, **more}

    lines = [line(-0.02), line(0.04), line(0.12), line(0.5, wall=0.4), {"error": "no"}]
    found = summary.figures_of(lines)
    assert (found["recordings"], found["failed"], found["at_the_wall"]) == (3, 1, 1)
    drag = found["drag_coefficient"]
    assert drag["median"] == pytest.approx(0.04)
    assert drag["largest"] == pytest.approx(0.12)
    assert drag["mean"] == pytest.approx(0.14 / 3)
    assert drag["within"] == {"0.1": pytest.approx(2 / 3), "0.15": 1.0}
    assert drag["covered"] == pytest.approx(2 / 3)
    assert drag["rms_z"] == pytest.approx(np.sqrt((0.04 + 0.16 + 1.44) / 3))
    assert "| 67% in 10%" in summary.markdown("ode-given", {"all": found})
