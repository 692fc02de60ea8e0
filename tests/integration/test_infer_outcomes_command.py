"""`driftwalk infer-outcomes` from the command line: a run, what it holds, and what it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, here

import driftwalk as dw

pytestmark = pytest.mark.slow

QUICK = ("--blocks", "2", "--runs", "20", "--truths", "20")


def table(tmp_path: Path, text: str = "class,count\n2,12\n1+1,8\n") -> Path:
    place = tmp_path / "counts.csv"
    place.write_text(text, encoding="utf-8")
    return place


def test_a_run_holds_its_answer_and_its_figures(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("infer-outcomes", table(tmp_path), "--flow", FLOW, *QUICK, "--after", "4s")
    done = here(*words, "-o", out, "--json")
    assert done.code == 0, done.err
    facts = json.loads(done.out)
    found = xr.load_dataset(out / "posterior.nc")
    assert facts["verdict"] == found.attrs["verdict"]
    assert facts["parameters"]["force_std_N"]["range"] == [0.2e-3, 1.2e-3]
    assert {one["data"] for one in facts["data"] if one["observed"]} == {"final classes"}
    assert sorted(path.stem for path in out.glob("figures/*.png")) == ["data", "posterior"]
    again = dw.infer_outcomes(
        table(tmp_path), dw.Study(), dw.load_flow(FLOW), blocks=2, after=4.0, runs=20, truths=20
    )
    assert again["weight"].equals(found["weight"])
    assert repr(again).startswith("20 runs of 2 blocks")
    assert here("report", out, "-o", tmp_path / "page.html").code == 0


def test_all_join_in_the_centre_so_the_force_is_not_determined(tmp_path: Path) -> None:
    """At C_d 1 in the bundled flow 30 s are enough for all runs, whatever sigma_F is."""
    runs = dw.assemble(
        dw.Study(), dw.load_flow(FLOW), runs=40, duration="60s", drag_coefficient=1.0, seed=9
    )
    runs.to_netcdf(tmp_path / "runs.nc")
    found = dw.infer_outcomes(
        runs, dw.Study(), dw.load_flow(FLOW), after=60.0, runs=40, truths=40,
        vary={"drag_coefficient": (0.8, 1.2), "force_std": (0.2e-3, 1.2e-3)},
    )  # fmt: skip
    determined = dict(zip(found["parameter"].values, found["determined"].values, strict=True))
    assert not determined["force_std"]
    assert "cannot tell" in repr(found)
    assert np.isclose(found["weight"].sum(), 1.0)


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("", (), "counts.csv: is empty"),
        ("class,count\n2,-1\n", (), "line 2: count: expected a whole number"),
        ("class,count\nQ9,3\n", (), "line 2: class Q9: no shape"),
        ("class,count\n2+1,3\n", (), "have 3 blocks, and the study has 2"),
        (None, ("--vary", "C_d=0.3"), "expected NAME=FROM:TO"),
        (None, ("--vary", "C_d=0.3:0.6"), "two to four parameters, got 1"),
        (None, ("--vary", "C_d=0.3:x", "--vary", "force-std=1:2mN"), "--vary C_d=0.3:x"),
        (None, ("--vary", "C_d=0.6:0.3", "--vary", "force-std=1:2mN"), "lowest and the highest"),
    ],
)
def test_bad_inputs_are_one_line(
    tmp_path: Path, text: str | None, words: tuple[str, ...], said: str
) -> None:
    given = table(tmp_path) if text is None else table(tmp_path, text)
    out = tmp_path / "out"
    done = here("infer-outcomes", given, "--flow", FLOW, *QUICK, *words, "-o", out)
    assert done.code == 2
    assert re.search(said, done.err), done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not out.exists()
