"""Restitution and friction of the wall from contacts, on simulated walls that are known."""

from __future__ import annotations

import pytest
from fit_worlds import coarse_study, driven, fitted, recording

import driftwalk as dw
from driftwalk.conditions import estimated_study
from driftwalk.likelihood import estimate_wall
from driftwalk.model import apply_overrides


@pytest.mark.slow
def test_the_wall_of_a_simulation_is_found() -> None:
    """Intervals of 99.9 %: each misses once in a thousand; the seeds are fixed."""
    restitution, friction = 0.8, 0.3
    wall = {"tank.wall_restitution": restitution, "tank.wall_friction": friction}
    track = driven(3, 500.0, wall)
    study = apply_overrides(coarse_study(), {"fit.confidence": 0.999})
    found = estimate_wall(dw.fit_motion(track, study), [track])
    assert int(found["wall_contacts"]) > 50
    for name, true, width in (
        ("wall_restitution", restitution, 0.4),
        ("wall_friction", friction, 0.15),
    ):
        low, high = found[f"{name}_interval"].values
        assert low <= true <= high
        assert high - low < width
    tank = estimated_study(found).tank
    assert tank.wall_friction == float(found["wall_friction"])
    assert tank.wall_restitution == float(found["wall_restitution"])


@pytest.mark.slow
def test_a_recording_with_few_contacts_says_nothing_of_the_wall() -> None:
    earlier = fitted(60.0).assign(wall_friction=0.3, wall_restitution=0.2)
    found = estimate_wall(earlier, [recording(60.0)])
    assert int(found["wall_contacts"]) < 8
    assert "needs 8 contacts" in found.attrs["wall_left_out"]
    assert "wall_friction" not in found
    assert estimated_study(found).tank.wall_friction == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angle", "words"), [("none", "this fit used none"), ("given", "it was an input")]
)
def test_a_fit_without_the_orientation_says_what_is_missing(angle: str, words: str) -> None:
    track = recording(60.0)
    study = apply_overrides(coarse_study(), {"fit.angle": angle})
    found = estimate_wall(dw.fit_motion(track, study), [track])
    assert "wall_contacts" not in found
    assert words in found.attrs["wall_left_out"]
    assert '`angle="state"`' in found.attrs["wall_left_out"]
