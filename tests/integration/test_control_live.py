"""`driftwalk control run` on streams: a tracker that stops, and the pump program of the page."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from page_server import received, served
from ports import held_port

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.track import LiveServer
from driftwalk.viewer import pilot

pytestmark = pytest.mark.slow

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "control.md"


@pytest.fixture(scope="module")
def policy() -> xr.Dataset:
    """A mode while the blocks are apart that is neither the first knob's value nor the safe one."""
    one = dw.ModeSource(dw.Study(assembly={"blocks": 3}), dw.tank30_flow())
    modes = dw.make_modes([one], flow_scales=[0.0, 0.5], force_stds=[1e-4, 3e-4])
    found = dw.plan_control(modes, "I3", 8.0, every=1.0, rounds=1, worlds=20)
    action = found["action"].values * 0 + 2
    safe = str(found["mode"].values[0])
    return found.assign(action=(found["action"].dims, action)).assign_attrs(safe_mode=safe)


def hello(policy: xr.Dataset) -> dict[str, Any]:
    return {
        "type": "hello", "format": "driftwalk live", "version": 1, "body_count": None,
        "tank": json.loads(policy.attrs["arena"]), "block_side_m": 0.03,
    }  # fmt: skip


def frame(at: float) -> dict[str, Any]:
    return {"type": "frame", "time_s": at, "outcome": "1+1+1", "bodies": [{}] * 3}


def test_the_safe_mode_is_chosen_when_frames_stop_and_the_policy_goes_on(
    policy: xr.Dataset,
) -> None:
    with LiveServer(0, hello=hello(policy)) as server:
        lines: Iterator[dict[str, Any]] = pilot(policy, server.host, server.port, patience_s=0.3)

        def publish() -> None:
            server.wait_for_clients(1)
            server.publish(frame(0.0))
            time.sleep(1.0)
            server.publish(frame(2.0))
            server.publish(frame(9.0))

        threading.Thread(target=publish, daemon=True).start()
        said = list(lines)
    assert [one["type"] for one in said] == ["decision", "safe", "decision", "end"]
    assert [one["force_std_N"] for one in said[:3]] == [1e-4, 1e-4, 1e-4]
    assert [one["flow_scale"] for one in said[:3]] == [0.5, 0.0, 0.5]


def test_a_tracker_that_is_gone_leaves_the_safe_mode(policy: xr.Dataset) -> None:
    short = policy.assign_attrs(by_s=1.0)
    with held_port() as port:
        server = LiveServer(port, hello=hello(policy))

        def publish() -> None:
            server.wait_for_clients(1)
            server.publish(frame(0.0))
            server.close()

        threading.Thread(target=publish, daemon=True).start()
        said = list(pilot(short, server.host, port, patience_s=0.5))
    assert [one["type"] for one in said[:2]] == ["decision", "safe"]
    assert {one["type"] for one in said[1:-1]} == {"safe"}
    end = said[-1]
    assert (end["type"], end["time_s"], end["class"]) == ("end", 0.0, "1+1+1")
    assert (end["reached"], end["flow_scale"]) == (False, 0.0)


def test_other_programs_and_other_tanks_are_refused(policy: xr.Dataset) -> None:
    with held_port() as port, pytest.raises(InputError, match=f"no tracker on 127.0.0.1:{port}"):
        next(pilot(policy, "127.0.0.1", port))
    for greeting, said in (
        ({"type": "hello"}, "is not a tracker of driftwalk"),
        (hello(policy) | {"version": 2}, "speaks version 2"),
        (hello(policy) | {"tank": {"shape": "circle", "diameter_m": 1.0}}, "another tank"),
    ):
        with LiveServer(0, hello=greeting) as server, pytest.raises(InputError, match=said):
            next(pilot(policy, server.host, server.port))


def test_the_pump_program_of_the_page_turns_the_knobs_of_play(
    policy: xr.Dataset, tmp_path: Path
) -> None:
    [program] = re.findall(r"```text\n(# pumps\.py.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    (tmp_path / "pumps.py").write_text(program, encoding="utf-8")
    policy.to_netcdf(tmp_path / "policy.nc")
    with held_port() as live, served("play", "--blocks", "3", "--live", live) as play:
        follow = [sys.executable, "-m", "driftwalk", "control", "run", "policy.nc"]
        follow += ["--live", f"127.0.0.1:{live}"]
        turn = [sys.executable, "pumps.py", f"ws://127.0.0.1:{play.port}/ws"]
        with subprocess.Popen(follow, cwd=tmp_path, stdout=subprocess.PIPE) as control:
            pumps = subprocess.run(
                turn, cwd=tmp_path, stdin=control.stdout, capture_output=True, text=True,
                timeout=120.0, check=False,
            )  # fmt: skip
            assert control.wait(timeout=30.0) == 0
        assert pumps.returncode == 0, pumps.stderr
        with play.socket() as browser:
            page = received(browser, "page")["page"]
    said = [line.split(" ", 2) for line in pumps.stdout.splitlines()]
    assert said[-1][0] == "end"
    assert 5 <= len([one for one in said if one[0] == "decision"]) <= 8
    [controls] = [part for part in page["sections"] if part["kind"] == "controls"]
    knobs = {item["name"]: item["value"] for item in controls["items"]}
    # The end leaves the safe mode: still water, and the weaker force.
    assert (knobs["flow_scale"], knobs["force_std"]) == (0.0, pytest.approx(1e-4))
