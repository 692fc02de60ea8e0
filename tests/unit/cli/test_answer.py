"""Rows of an answer on the terminal: labels, units for people, intervals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from driftwalk.cli.terminal.output import print_parts, print_places, print_row
from driftwalk.page.parts import card
from driftwalk.schema.answers.parts import Row, Table, estimates, origin


def answer() -> xr.Dataset:
    values = {
        "estimate": ("parameter", [0.4, 6e-4, 2e-8, 0.05]),
        "interval": (
            ("parameter", "bound"),
            [[0.35, 0.45], [0.0, np.inf], [1e-8, 4e-8], [np.nan, np.nan]],
        ),
        "confidence": 0.95,
        "force_interval": 0.016,
    }
    names = {
        "parameter": ["drag_coefficient", "force_std", "tracking_noise", "swim_speed"],
        "unit": ("parameter", ["1", "N", "m", "m/s"]),
    }
    return xr.Dataset(values, names)


def test_an_estimate_is_a_row_in_the_units_of_a_reader(capsys: pytest.CaptureFixture[str]) -> None:
    found = answer()
    print_parts(estimates(found))
    assert capsys.readouterr().out.splitlines() == [
        "drag coefficient C_d   0.4000   95 % interval 0.3500 to 0.4500",
        "stochastic force σ_F   not determined by this recording",
        "tracking noise         2.000e-05 mm   95 % interval 1.000e-05 to 4.000e-05",
        "swim speed             0.05000 m/s   no interval without a bootstrap",
    ]


def test_a_share_of_hidden_drag_known_too_loosely_is_not_printed_as_a_number() -> None:
    interval = ("parameter", "bound"), [[0.14, 0.57]]
    names = {"parameter": ["hidden_face_drag_share"], "unit": ("parameter", ["1"])}
    loose = xr.Dataset({"estimate": ("parameter", [0.35]), "interval": interval}, names)
    narrow = loose.assign(interval=(interval[0], [[0.25, 0.57]]))
    assert [one.text for found in (loose, narrow) for one in estimates(found)] == [
        "not determined (0.1400 to 0.5700)",
        "0.3500   interval 0.2500 to 0.5700",
    ]
    assert [card(one)["value"] for found in (loose, narrow) for one in estimates(found)] == [
        None,
        0.35,
    ]


def test_without_intervals_that_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    print_parts(estimates(answer().drop_vars(["interval", "confidence"]))[:1])
    (line,) = capsys.readouterr().out.splitlines()
    assert line == "drag coefficient C_d   0.4000   no interval without a bootstrap"


def test_values_of_all_rows_begin_in_one_column(capsys: pytest.CaptureFixture[str]) -> None:
    print_parts(estimates(answer())[:2])
    print_row("figures", Path("run") / "figures")
    lines = capsys.readouterr().out.splitlines()
    assert [line[:22].rstrip() == line[:23].rstrip() for line in lines] == [True] * 3
    assert [line[23] for line in lines] == ["0", "n", "r"]


@pytest.mark.parametrize(("simulated", "lines"), [("yes", 1), ("no", 0)])
def test_a_simulated_recording_is_called_so(
    simulated: str, lines: int, capsys: pytest.CaptureFixture[str]
) -> None:
    print_parts(origin(answer().assign_attrs(simulated_recording=simulated)))
    assert len(capsys.readouterr().out.splitlines()) == lines


def test_what_a_terminal_obeys_is_spelled_out(capsys: pytest.CaptureFixture[str]) -> None:
    print_parts([Table([["a\x1b[2J"]]), Row("\x1b[1m", "\u202eflow.nc"), "\x9bA"])
    assert capsys.readouterr().out.splitlines() == [
        r"a\x1b[2J",
        r"\x1b[1m                   \u202eflow.nc".replace("                   ", " " * 19),
        r"\x9bA",
    ]


@pytest.mark.parametrize(
    ("verdict", "following"), [("explains", "assemble fit"), ("does not explain", "report fit")]
)
def test_numbers_that_are_not_to_be_used_lead_to_their_report(
    verdict: str, following: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = answer().isel(parameter=slice(0, 2)).assign_attrs(kind="fit").assign(verdict=verdict)
    found["interval"][1] = [5e-4, 7e-4]
    print_places(found, Path("fit"), [])
    assert f"next: driftwalk {following}" in "".join(capsys.readouterr())
