"""`driftwalk yield` from the command line: a run, what it holds, its continuation, bad inputs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, here
from every_kind import every_kind

import driftwalk as dw
from driftwalk.cli.assembly.yields import _again
from driftwalk.core.files.shards import ShardStore
from driftwalk.page import dataset_page
from driftwalk.schema.answers.yields import more_runs
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf
from driftwalk.viewer.watch.run_page import RunSource

pytestmark = pytest.mark.slow

SHORT = ("--flow", FLOW, "--blocks", "3", "--duration", "20s", "--fresh-runs", "40")
LISTED = ("--vary", "flow-scale=0.5,1.5", "--vary", "force-std=0.2mN,1mN")


def test_a_run_holds_its_answer_and_its_figures(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("yield", *SHORT, *LISTED, "--target", "2+1", "--by", "10s", "--runs", "300")
    done = here(*words, "-o", out, "--json")
    assert done.code == 0, done.err
    facts = json.loads(done.out)
    found = xr.load_dataset(out / "yields.nc")
    assert facts["best"]["fresh_yield"] == found["fresh_yield"].values[found.attrs["best"]]
    assert len(facts["settings"]) == 4
    assert facts["front"][-1]["time_s"] == 20.0
    assert sorted(path.stem for path in out.glob("figures/*.png")) == ["front", "settings"]
    again = dw.maximise_yield(
        dw.Study(), dw.load_flow(FLOW),
        target="1+2", by="10s", selection_runs=300, fresh_runs=40, blocks=3, duration="20s",
        axes={"flow_scale": [0.5, 1.5], "force_std": [2e-4, 1e-3]},
    )  # fmt: skip
    assert again["reached"].equals(found["reached"])
    assert "best setting" in repr(again)
    assert here("report", out, "-o", tmp_path / "page.html").code == 0


def test_a_setting_in_words_of_a_file_has_no_chart_along_it(tmp_path: Path) -> None:
    file = tmp_path / "yields.nc"
    file.write_bytes(netcdf_bytes(every_kind("yield")))
    page = dataset_page(open_netcdf(file))
    ids = [section["id"] for section in page["sections"]]
    assert "along-force_std" in ids
    assert not {"along", "along-latching"} & {*ids}


def test_the_next_command_has_the_runs_that_distinguish() -> None:
    found = every_kind("yield").assign_attrs(indifference=0.02, selection_runs=1200)
    for within, runs in ((0.02, None), (0.021, 2000), (0.036, 4000), (0.2, 200_000)):
        assert more_runs(found.assign_attrs(within=within)) == runs
    words = ["fit", "--runs=9", "--runs", "1200", "--by", "2min", "--out", "a"]
    assert _again(words, 4000, Path("a")) == [
        *("fit", "--by", "2min", "--runs", "4000", "-o"), Path("a"),
    ]  # fmt: skip


def test_a_range_is_searched(tmp_path: Path) -> None:
    words = ("--vary", "force-std=0.2:1mN", "--target", "2+1", "--runs", "1600")
    done = here("yield", *SHORT, *words, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert re.search(r"best setting +σ_F = \S+ mN", done.out)
    found = xr.load_dataset(tmp_path / "out" / "yields.nc")
    assert found.attrs["searched"] == "force_std"
    assert np.all((found["force_std"] >= 2e-4) & (found["force_std"] <= 1e-3))
    assert (found["rounds"] == 0).any()


def test_a_stopped_run_is_continued(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("yield", *SHORT, *LISTED, "--target", "2+1", "--runs", "300")
    assert here(*words, "-o", tmp_path / "whole").code == 0
    write, left = ShardStore.write, [3]

    def stopped(self: ShardStore, *given: object) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        write(self, *given)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(ShardStore, "write", stopped)
        assert here(*words, "-o", tmp_path / "parts").code == 130
    # Its page shows the settings that have runs.
    (shown,) = RunSource(tmp_path / "parts").greeting()
    assert "Settings so far" in json.dumps(shown)
    assert "strength of the flow 0.5" in json.dumps(shown)
    assert here(*words, "-o", tmp_path / "parts").code == 0
    one, two = (xr.load_dataset(tmp_path / name / "yields.nc") for name in ("whole", "parts"))
    assert one.identical(two)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--target", "T"], "target T has 4 blocks, and the runs have 3"),
        (["--target", "Q"], "target Q: "),
        (["--target", "L3", "--by", "1min"], "by: 60 s does not lie within the runs"),
        (["--target", "L3", "--vary", "colour=1,2"], "--vary colour=1,2: expected NAME=VALUES"),
        (["--target", "L3", "--vary", "blocks=2:4"], "blocks has no range"),
        (["--target", "L3", "--vary", "drag-coefficient=0.2:0.6m"], "drag-coefficient=0.2:0.6m: "),
        (["--target", "L3", "--vary", "flow-scale=1:2"], "flow-scale is varied twice"),
        (["--target", "L3", "--vary", "drag-coefficient=1:1.0001"], "is too narrow"),
        (["--target", "L3", "--runs", "10"], "4 settings need at least 160 runs"),
    ],
)
def test_bad_inputs_are_one_line(tmp_path: Path, words: list[str], said: str) -> None:
    done = here("yield", *SHORT, *LISTED, *words, "-o", tmp_path / "out")
    assert done.code == 2
    assert said in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
