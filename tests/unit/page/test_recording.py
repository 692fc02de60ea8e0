"""The recording and the flow of a page hold the numbers of their datasets."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
import xarray as xr
from page_reading import numbers_of, part_of, values
from synthetic_calibration import ARENA, bundled_flow, bundled_recording

from driftwalk.core.errors import InputError
from driftwalk.page import recording_page
from driftwalk.page.sections.flow import MOST_FRAMES, flow_section, flow_sections
from driftwalk.page.sections.recording import (
    Noise,
    noise_of,
    recording_sections,
    trajectory_section,
)
from driftwalk.record import describe
from driftwalk.schema import FLAGS, build_trajectory


@pytest.fixture(scope="module")
def recording() -> xr.Dataset:
    return bundled_recording(rows=3000)


def test_positions_are_those_of_the_recording(recording: xr.Dataset) -> None:
    part = trajectory_section(recording)
    step = part["x"]["step"]
    assert step <= 1e-5
    for name in "xy":
        np.testing.assert_allclose(
            values(part[name]), recording[name].values[:, 0], rtol=0, atol=0.5001 * step
        )
    np.testing.assert_allclose(values(part["time"]), recording["time"].values, atol=5.1e-5)
    turned = values(part["theta"]) - recording["theta"].values[:, 0]
    assert np.abs(np.angle(np.exp(1j * turned))).max() < 5.1e-4
    assert part["arena"] == json.loads(ARENA)
    assert part["gaps"] == []


def test_facts_and_speeds_are_those_of_the_recording(recording: xr.Dataset) -> None:
    part = trajectory_section(recording)
    x, y = (recording[name].values[:, 0] for name in "xy")
    speed = np.hypot(np.diff(x), np.diff(y)) / np.diff(recording["time"].values)
    facts = numbers_of(part, "facts")
    assert facts["positions"]["value"] == 3000
    assert facts["duration"]["value"] == pytest.approx(299.9)
    assert facts["rate"]["value"] == pytest.approx(10.0)
    assert facts["mean speed"]["value"] == pytest.approx(speed.mean())
    assert facts["99 % of speeds are below"]["value"] == pytest.approx(np.percentile(speed, 99))
    edges, density = (values(part["speed"][key]) for key in ("edges", "density"))
    share = [((speed >= a) & (speed < b)).mean() for a, b in itertools.pairwise(edges)]
    share[-1] += (speed == edges[-1]).mean()
    np.testing.assert_allclose(density * np.diff(edges), share, atol=1e-12)


def test_a_jump_does_not_squeeze_the_speeds_into_one_bin() -> None:
    speed = np.random.default_rng(4).uniform(0.05, 0.1, 1000)
    speed[500] = 8.0
    x = np.concatenate([[0.0], np.cumsum(0.1 * speed)])
    part = trajectory_section(build_trajectory(0.1 * np.arange(1001), x, 0.0 * x))
    edges, density = (values(part["speed"][key]) for key in ("edges", "density"))
    assert 0.1 < edges[-1] < 0.21
    # All that is beyond is missing from the integral, and is told.
    assert (density * np.diff(edges)).sum() == pytest.approx(0.999)
    assert "0.1 % of the speeds are beyond the histogram, up to 8 m/s." in part["note"]


def test_gaps_break_the_path() -> None:
    time = np.array([0.0, 0.1, 0.2, 5.0, 5.1, 5.2, 9.0])
    moving = build_trajectory(time, np.arange(7.0) / 100, np.zeros(7))
    part = trajectory_section(moving)
    assert part["gaps"] == [[0.2, 5.0], [5.2, 9.0]]
    shown = values(part["x"])
    np.testing.assert_allclose(values(part["time"])[np.isnan(shown)], [2.6, 7.1], atol=1e-4)
    np.testing.assert_allclose(shown[~np.isnan(shown)], np.arange(7.0) / 100, atol=1e-5)
    facts = numbers_of(part, "facts")
    assert facts["gaps"]["value"] == 2
    assert facts["time in gaps"]["value"] == pytest.approx(100 * (4.8 + 3.8 - 0.2) / 9.0)
    assert facts["time in gaps"]["unit"] == "%"


def test_a_long_recording_is_thinned_but_keeps_its_gaps_and_ends() -> None:
    time = np.arange(100_000.0)
    time[60_000:] += 50.0
    moving = build_trajectory(time, np.sin(time / 100), np.cos(time / 100))
    part = trajectory_section(moving)
    shown, at = values(part["x"]), values(part["time"])
    assert 10_000 < shown.size <= 20_000
    assert "One position in 6 is shown." in part["note"]
    assert part["gaps"] == [[59_999.0, 60_050.0]]
    gap = int(np.flatnonzero(np.isnan(shown))[0])
    assert (at[gap - 1], at[gap + 1]) == (59_999.0, 60_050.0)
    assert (at[0], at[-1]) == (0.0, time[-1])
    known = ~np.isnan(shown)
    np.testing.assert_allclose(shown[known], np.sin(at[known] / 100), atol=1e-3)
    # What is said of it counts every position.
    assert numbers_of(part, "facts")["positions"]["value"] == 100_000


def test_a_recording_without_a_motion_is_an_empty_section() -> None:
    single = build_trajectory([0.0], [0.0], [0.0])
    with pytest.raises(InputError, match="1 position: nothing to show"):
        trajectory_section(single)
    part = part_of(recording_sections(single), "recording-1")
    assert part["kind"] == "empty"
    assert "1 position" in part["reason"]


def test_every_body_has_a_section_and_the_many_are_counted() -> None:
    x = np.arange(30.0).reshape(3, 10) / 100
    several = build_trajectory([0.0, 0.1, 0.2], x, x)
    made = recording_sections(several)
    assert [part["id"] for part in made] == [f"recording-{k}" for k in range(1, 9)]
    assert "2 more bodies" in made[-1]["note"]
    one = recording_sections(several, body="4")
    np.testing.assert_allclose(values(one[0]["x"]), x[:, 4], atol=1e-5)
    assert one[0]["title"] == "The recording, body 4"
    assert recording_sections(several, body="no such")[0]["kind"] == "empty"


def test_the_noise_stands_with_its_source(recording: xr.Dataset) -> None:
    part = recording_sections(recording, noise=Noise(3e-4, 2e-4, 4e-4, "estimated by the fit"))[0]
    noise = numbers_of(part, "facts")["tracking noise"]
    assert (noise["value"], noise["low"], noise["high"]) == (3e-4, 2e-4, 4e-4)
    assert noise["note"] == "estimated by the fit"


def test_a_page_of_a_recording_says_what_its_description_says(recording: xr.Dataset) -> None:
    bodies = {"0": {"position_noise_m": 3e-4, "position_noise_standard_error_m": 1e-5}}
    described = {"warnings": ["<b>look</b>"], "bodies": bodies}
    page = recording_page(recording.assign_attrs(source="r.csv", simulated="yes"), described)
    assert (page["title"], page["subtitle"]) == ("Recording", "r.csv")
    assert part_of(page, "warnings")["items"] == [
        "The recording was simulated: it is not a measurement.",
        "<b>look</b>",
    ]
    noise = numbers_of(part_of(page, "recording-1"), "facts")["tracking noise"]
    assert noise["low"] == pytest.approx(2.9e-4)


def tracked() -> xr.Dataset:
    """Return two blocks as tracking leaves them: one could be another for 2 of 4 frames."""
    x = np.array([[0.0, 0.1], [0.01, 0.12], [0.02, 0.14], [0.03, 0.16]])
    counts = {"frames": 4, "dropped": 1, "duplicates": 0, "stale": 0, "taken_back": 2}
    moving = build_trajectory(
        0.1 * np.arange(4),
        x,
        -x,
        attrs={
            "tracked_from": "film.mp4",
            "complete": "no",
            "interrupted": "the disk is full",
            "tracking_counts": json.dumps({**counts, "rejected": {"too small": 987}}),
        },
    )
    ambiguous = np.array([[0.0, 0.0], [0.0, 0.3], [0.0, 0.2], [0.0, 0.0]])
    return moving.assign(ambiguous=(("time", "body"), ambiguous))


def test_a_page_of_a_tracked_recording_says_how_it_was_tracked() -> None:
    page = recording_page(tracked(), describe(tracked()))
    part = part_of(page, "tracking")
    text = " ".join(part["paragraphs"])
    assert "film.mp4" in text
    assert "too small 987" in text
    told = {label: one["value"] for label, one in numbers_of(part, "numbers").items()}
    assert told["frames tracked"] == 4
    assert told["frames dropped"] == 1
    assert told["positions taken back"] == 2
    assert part_of(page, "warnings")["items"] == ["the tracking broke off: the disk is full"]


def test_each_body_has_its_own_noise_and_ambiguity() -> None:
    bodies = {"0": {"position_noise_m": 1e-4}, "1": {"position_noise_m": 2e-4}}
    page = recording_page(tracked(), {"bodies": bodies})
    for number, noise, share in ((1, 1e-4, 0.0), (2, 2e-4, 50.0)):
        facts = numbers_of(part_of(page, f"recording-{number}"), "facts")
        assert facts["tracking noise"]["value"] == noise
        assert facts["identity ambiguous"]["value"] == pytest.approx(share)
        assert facts["identity ambiguous"]["unit"] == "%"


@pytest.mark.parametrize(
    ("value", "error", "told"),
    [
        (3e-4, 1e-4, (3e-4, 2e-4, 4e-4)),
        (3e-5, 4e-5, (3e-5, 0.0, 7e-5)),
        (0.0, 2e-5, (2e-5, None, None)),
        (3e-4, None, (3e-4, None, None)),
    ],
)
def test_a_noise_is_never_negative(
    value: float, error: float | None, told: tuple[float | None, ...]
) -> None:
    facts = {"position_noise_m": value, "position_noise_standard_error_m": error}
    noise = noise_of({"bodies": {"a": facts}}, "a")
    assert noise is not None
    assert noise[:3] == pytest.approx(told)
    assert ("too small" in noise.source) == (value == 0.0)


def test_a_recording_that_was_not_tracked_here_says_nothing_of_it(recording: xr.Dataset) -> None:
    page = recording_page(recording, describe(recording))
    assert [part["id"] for part in page["sections"]] == ["warnings", "recording-1"]
    assert "identity ambiguous" not in numbers_of(part_of(page, "recording-1"), "facts")


def test_an_arena_that_is_no_json_is_said() -> None:
    moving = build_trajectory([0.0, 0.1], [0.0, 1.0], [0.0, 0.0], attrs={"arena": "<script>"})
    part = part_of(recording_sections(moving), "recording-1")
    assert part["kind"] == "empty"
    assert "arena is not JSON" in part["reason"]


def test_the_flow_holds_the_numbers_of_the_field() -> None:
    flow = bundled_flow()
    error = np.full(flow["u"].shape, 0.003)
    flow = flow.assign(
        u_standard_error=(("y", "x"), error), v_standard_error=(("y", "x"), 2 * error)
    )
    part = flow_section(flow)
    for name in "uv":
        np.testing.assert_allclose(values(part[name]), flow[name].values, rtol=1e-6)
    for name in "xy":
        assert values(part[name]).tolist() == flow[name].values.tolist()
    told = values(part["standard_error"])
    measured = flow["flag"].values == FLAGS["measured"]
    np.testing.assert_allclose(told[measured], 0.003 * np.sqrt(2.5), rtol=1e-6)
    # What a fit says of nodes that the block never reached is its smoothness, no measurement.
    assert np.isnan(told[~measured]).all()
    np.testing.assert_allclose(values(part["count"]), flow["count"].values)
    origin, flag = values(part["origin"]), flow["flag"].values
    for code, word in ((0, "measured"), (1, "filled"), (2, "outside")):
        np.testing.assert_array_equal(origin == code, flag == FLAGS[word])
    inside = flag != FLAGS["outside"]
    share = 100 * (flag == FLAGS["measured"])[inside].mean()
    assert part["note"].startswith(f"{share:.3g} % of the nodes")


def test_a_flow_that_changes_has_a_section_for_each_frame() -> None:
    flow = bundled_flow()[["u", "v", "flag"]]
    frames = xr.concat([flow * (k + 1) for k in range(MOST_FRAMES + 2)], "time")
    frames = frames.assign_coords(time=np.arange(10.0)).assign(flag=flow["flag"])
    made = flow_sections(frames)
    assert [part["title"] for part in made[:2]] == ["The flow at 0.0 s", "The flow at 1.0 s"]
    assert len(made) == MOST_FRAMES
    assert "2 more are in the file" in made[-1]["note"]
    np.testing.assert_allclose(values(made[2]["u"]), 3 * flow["u"].values, rtol=1e-6)


def test_a_flow_without_velocities_is_an_empty_section() -> None:
    part = flow_sections(bundled_flow().drop_vars("u"))[0]
    assert (part["kind"], part["reason"]) == ("empty", "the flow_field holds no u")
