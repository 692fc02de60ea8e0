"""`driftwalk kinetics` from the command line: a run, what it holds, and what it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from chain_runs import chain_runs
from command_line import RECORDING, here

import driftwalk as dw
from driftwalk.page.sections.kinetics import kinetics_sections
from driftwalk.plot.kinetics import plot_class_graph, plot_predicted_shares
from driftwalk.plot.parts.outcome_classes import class_colors

pytestmark = pytest.mark.slow


def test_a_run_holds_its_answer_and_its_figures(tmp_path: Path) -> None:
    chain_runs(60, 1).to_netcdf(tmp_path / "runs.nc")
    out = tmp_path / "out"
    done = here("kinetics", tmp_path / "runs.nc", "-o", out, "--target", "T", "--json")
    assert done.code == 0, done.err
    facts = json.loads(done.out)
    found = xr.load_dataset(out / "kinetics.nc")
    assert facts["verdict"] == found.attrs["verdict"]
    assert facts["transitions"][0]["rate_per_s"] == found["rate"].values[0, 0]
    assert sorted(path.stem for path in out.glob("figures/*.png")) == ["class_graph", "shares"]
    again = dw.kinetics(chain_runs(60, 1), target="T")
    assert again["share"].equals(found["share"])
    assert repr(again).startswith("T is reached in ")
    assert here("report", out, "-o", tmp_path / "page.html").code == 0
    assert "method    correction for several tests: Holm, " in here("cite", out).out
    made = {part["id"]: part for part in kinetics_sections(kinetics=found)}
    assert made["summary"]["paragraphs"][0].startswith("T is reached in ")
    shown = {one["label"]: one["value"] for one in made["summary"]["numbers"]}
    started = found.sel({"class": "1+1+1+1"})
    assert shown["share of runs that reach T"] == float(started["committor"])
    assert shown["mean time until T"] == float(started["passage_time"])
    # The same classes in the same order have the same colours.
    named = [[one["class"] for one in made[id]["classes"]] for id in ("shares", "seen-1")]
    assert named == [found["class"].values.tolist()] * 2
    assert made["seen-1"]["title"] == "Shares seen"
    # Every arrow begins at a class and ends at another, with its rate per 1000 s.
    places = {(one["x"], one["y"]) for one in made["graph"]["classes"]}
    ends = [list(zip(one["x"], one["y"], strict=True)) for one in made["graph"]["arrows"]]
    assert len(ends) == found.sizes["transition"]
    assert {place for pair in ends for place in pair} == places
    rates = 1e3 * found["rate"].values[0]
    labels = np.array([float(one["label"]) for one in made["graph"]["arrows"]])
    assert np.sort(labels) == pytest.approx(np.sort(rates), rel=0.06)


def test_a_class_has_one_colour_in_all_figures_of_a_run() -> None:
    """Also where the graph shows other classes than the curves, and in another order."""
    found = dw.kinetics(chain_runs(60, 1))
    colors = class_colors(found["class"].values.tolist())
    curves = {line.get_label(): line.get_color() for line in plot_predicted_shares(found).lines}
    graph = plot_class_graph(found)
    for text in graph.texts:
        name = text.get_text()
        if name not in colors:
            continue
        [circle] = [one for one in graph.lines if tuple(one.get_xydata()[0]) == tuple(text.xy)]
        assert circle.get_markeredgecolor() == colors[name] == curves.get(name, colors[name])
    # Every arrow runs from the middle of a class to the middle of another one, up to its circle.
    middles = {tuple(line.get_xydata()[0]) for line in graph.lines}
    arrows = [one for one in graph.texts if getattr(one, "arrow_patch", None)]
    assert len(arrows) == found.sizes["transition"]
    assert {one.xy for one in arrows} | {one.xyann for one in arrows} == middles


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["FEW"], "cannot tell: 5 runs"),
        (["RUNS", "--target", "q"], "target q: no shape"),
        (["RUNS", "--target", "2+1"], "target 2.1 has 3 blocks, and the runs have 4"),
        (["RUNS", "THREE"], "the data sets have 4 and 2 blocks"),
        (["EMPTY"], "holds no assembly"),
        (["NOWHERE"], "does not exist"),
        ([str(RECORDING)], "NetCDF"),
        (["RUNS", "RUNS", "RUNS"], "two sources can be compared, got 3"),
    ],
)
def test_bad_inputs_are_one_line(tmp_path: Path, words: list[str], said: str) -> None:
    chain_runs(60, 1).to_netcdf(tmp_path / "RUNS")
    chain_runs(5, 1).to_netcdf(tmp_path / "FEW")
    two = chain_runs(30, 1).assign_coords({"class": ["2"] * 6 + ["1+1"]})
    two.assign_attrs(blocks=2).to_netcdf(tmp_path / "THREE")
    (tmp_path / "EMPTY").mkdir()
    given = [tmp_path / word if word.isupper() else word for word in words]
    done = here("kinetics", *given, "-o", tmp_path / "out")
    assert done.code == 2
    assert re.search(said, done.err), done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
