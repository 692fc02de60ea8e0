"""`driftwalk demo`: two runs of the bundled recording, which another engine simulated.

In every run `.ci/wheel_run.py` holds the answers of a whole demo against the truth.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import Done, apart, contents, here, refusal, start
from page_reading import page_in

from driftwalk.cli.demo import print_page

TRUTH = {
    "drag_coefficient": 0.3948,
    "force_std_N": 0.0006123,
    "force_interval_s": 0.016,
    "tracking_noise_m": 0.0003,
}


@dataclass(frozen=True)
class Killed:
    """What a demo had told and stored when it was killed, before its map."""

    told: list[str]
    page: str
    files: dict[str, bytes | None]


# A quarter of an hour of the recording. All of it is fitted by tests/integration/test_fit_bars.py
# and by .ci/wheel_run.py.
SHORT = """
from driftwalk import datasets
whole = datasets.tank30_recording
datasets.tank30_recording = lambda: whole().sel(time=slice(0.0, 900.0))
"""
# No warning of a library reaches a user.
STRICT = os.environ | {"PYTHONWARNINGS": "error"}


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Killed]:
    """Return the folder of a demo with the short search, killed as soon as its fit was told.

    It is read through a pipe: what is printed does not wait in a buffer for the end.
    """
    folder = tmp_path_factory.mktemp("demo") / "demo"
    told: list[str] = []
    with start("demo", "--quick", "--out", folder, before=SHORT, env=STRICT) as process:
        assert process.stdout is not None
        for line in process.stdout:
            told.append(line)
            if line.startswith("Its page: "):
                break
        process.kill()
    page = Path(told[-1].removeprefix("Its page: ").strip()).read_text(encoding="utf-8")
    return folder, Killed(told, page, contents(folder))


@pytest.fixture(scope="module")
def finished(killed: tuple[Path, Killed]) -> tuple[Path, Done]:
    """Return the demo that was killed, and continued to its end."""
    return killed[0], apart("demo", "--quick", "--out", killed[0], before=SHORT, env=STRICT)


@pytest.mark.study
def test_both_answers_stand_beside_the_truth(finished: tuple[Path, Done]) -> None:
    folder, done = finished
    assert done.code == 0, done.err
    assert "simulated by another engine (ODE)" in done.out
    lines = done.out.splitlines()
    for method in ("likelihood fit", "KS map in the fitted flow"):
        first = next(k for k, line in enumerate(lines) if line.split()[:1] == ["truth"])
        assert lines[first].endswith(method)
        lines = lines[first + 1 :]
        rows = {line[:27].strip(): line[27:].split() for line in reversed(lines)}
        assert rows["drag coefficient C_d"][0] == "0.3948"
        assert rows["stochastic force σ_F (mN)"][0] == "0.6123"
        assert rows["tracking noise (mm)"][0] == "0.3"
        assert rows["verdict"] == ["explains"]
    assert lines[-1] == f"open in a browser: {folder / 'report.html'}"
    page = page_in((folder / "report.html").read_text(encoding="utf-8"))
    assert page["title"] == "Demo"
    names = [part["id"].split("-")[0] for part in page["sections"]]
    assert names == sorted(names, key=["fit", "calibrate"].index)
    assert {"fit", "calibrate"} == set(names)
    for figure in ("fit/figures/check_steps.png", "calibrate/figures/ks_map.png"):
        assert (folder / figure).stat().st_size > 1000


@pytest.mark.study
def test_the_fit_is_told_before_the_map_is_begun(killed: tuple[Path, Killed]) -> None:
    # The map takes far longer than the reading of the line with the page of the fit.
    assert not any(name.startswith("calibrate/manifest") for name in killed[1].files)
    assert page_in(killed[1].page)["subtitle"] == "fit"


@pytest.mark.study
def test_a_finished_demo_is_read(finished: tuple[Path, Done]) -> None:
    folder = finished[0]
    before = contents(folder)
    again = apart("demo", "--quick", "--out", folder, "--json", before=SHORT)
    assert again.code == 0
    assert again.err.count("holds a finished run") == 2
    assert contents(folder) == before
    found = json.loads(again.out)
    assert found["truth"] == TRUTH
    # With the orientation as a state: C_d within 5 %, sigma_F 3 %, flow 2 %.
    assert found["fit"]["drag_coefficient"] == pytest.approx(TRUTH["drag_coefficient"], rel=0.05)
    low, high = found["fit"]["drag_coefficient_interval"]
    assert low < TRUTH["drag_coefficient"] < high
    assert found["fit"]["force_std_N"] == pytest.approx(TRUTH["force_std_N"], rel=0.03)
    assert found["fit"]["tracking_noise_m"] == pytest.approx(TRUTH["tracking_noise_m"], rel=0.03)
    assert 0.0 < found["fit"]["flow_error"] < 0.02
    assert found["fit"]["verdict"] == "explains"
    for name, error in (("drag_coefficient", 0.04), ("force_std_N", 0.1e-3)):
        assert found["calibration"][name] == pytest.approx(TRUTH[name], abs=error)
    assert found["calibration"]["ks_distance"] < 2 * found["calibration"]["noise_floor"]


@pytest.mark.study
def test_a_demo_goes_on_after_its_fit(
    killed: tuple[Path, Killed], finished: tuple[Path, Done]
) -> None:
    folder, before = killed
    fit = {name: data for name, data in before.files.items() if name.startswith("fit/")}
    assert "fit/manifest.json" in fit
    after = contents(folder)
    assert {name: after[name] for name in fit} == fit
    assert finished[1].out.startswith("".join(before.told))


def test_a_folder_with_other_files_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("done", encoding="utf-8")
    line = refusal(here("demo", "--out", tmp_path))
    assert "thesis.txt" in line
    assert set(contents(tmp_path)) == {"thesis.txt"}


def test_how_long_the_map_takes_stands_at_its_bar_alone(capsys: pytest.CaptureFixture[str]) -> None:
    print_page(Path("report.html"))
    said = capsys.readouterr().out
    assert "Next, the paper's method" in said
    assert not re.search(r"\d", said)
