"""`driftwalk assemble --bond-rate`: what it prints, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import xarray as xr
from command_line import FLOW, here, refusal

from driftwalk.page import report_page

SIZE = ["--flow", FLOW, "--blocks", "3", "--runs", "20", "--duration", "60s", "--film", "none"]

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("undrawn")]


def test_the_answer_tells_the_steady_state(tmp_path: Path) -> None:
    folder = tmp_path / "breaking"
    done = here("assemble", *SIZE, "--bond-rate", "0.05/s,2mN", "-o", folder)
    assert done.code == 0, done.err
    assert "bonds break at 0.05 /s, e times as fast for 2 mN of tension" in done.out
    assert "latch again from 1.25 sides on" in done.out
    assert "steady state" in done.out
    again = here("assemble", *SIZE, "--bond-rate", "0.05/s,2mN", "--json", "-o", tmp_path / "again")
    found = json.loads(again.out)["steady_state"]
    assert (found["bond_rate_per_s"], found["bond_force_N"]) == (0.05, 0.002)
    assert sum(found["time_share"].values()) == pytest.approx(1.0)
    low, high = found["parting_rate_interval_per_s"]["2+1"]
    assert low <= found["parting_rate_per_s"]["2+1"] <= high
    with xr.open_dataset(folder / "assembly.nc", engine="h5netcdf") as stored:
        assert {0, 1} <= set(stored["event_kind"].values.ravel().tolist())
        assert (stored["end_time"] == 60.0).all()
    sections = {one["id"]: one for one in report_page(folder)["sections"]}
    assert "1/s" in " ".join(sections["steady-state"]["columns"])
    assert sections["lifetimes"]["x"]["unit"] == "s"
    seen = json.loads(here("classify", folder / "path.nc", "--replicate", "1", "--json").out)
    for kind, word in (("joining", "join"), ("parting", "split")):
        told = [event["kind"] for event in seen["events"]].count(word)
        assert sum(one[kind]["count"] for one in seen["rates"].values()) == told


def test_permanent_bonds_leave_no_steady_state(tmp_path: Path) -> None:
    folder = tmp_path / "permanent"
    done = here("assemble", *SIZE, "--json", "-o", folder)
    assert "steady_state" not in json.loads(done.out)
    assert not (folder / "steady_state.nc").exists()


def test_a_strength_under_a_white_force_is_refused(tmp_path: Path) -> None:
    done = here("assemble", *SIZE, "--bond-strength", "8mN", "-o", tmp_path / "strong")
    words = refusal(done)
    assert "a threshold on a white force depends on the time step" in words
    assert "--bond-strength" in words


def test_rates_are_compared(tmp_path: Path) -> None:
    few = ["--flow", FLOW, "--blocks", "2", "--runs", "10", "--duration", "20s"]
    more = ["--realisations", "2", "--vary", "bond-rate=0,0.1"]
    done = here("sensitivity", *few, *more, "--json", "-o", tmp_path / "map")
    assert done.code == 0, done.err
    with xr.open_dataset(tmp_path / "map" / "sensitivity.nc", engine="h5netcdf") as stored:
        assert stored["bond_rate"].values.tolist() == [0.0, 0.1]
        assert stored["bond_rate"].attrs["units"] == "s-1"
