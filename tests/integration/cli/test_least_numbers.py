"""Numbers as small as nothing is, work without end, and files that would take all memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import FLOW, RECORDING, here, refusal

import driftwalk as dw
from driftwalk.cli.terminal.errors import one_line
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text_files import parse_toml
from driftwalk.model.section import SMALLEST
from driftwalk.simulation import run as simulation

MODEL = ("--flow", FLOW)
BLOCKS = (*MODEL, "--blocks", "2", "--runs", "2", "--film", "none")
COMMANDS = {
    "simulate": ("simulate", *MODEL),
    "assemble": ("assemble", *BLOCKS),
    "calibrate": ("calibrate", RECORDING, "--to", "60s", "--flow", FLOW),
    "fit": ("fit", RECORDING, "--to", "60s"),
}


@pytest.mark.parametrize("option", ["--side", "--mass", "--time-step", "--force-interval"])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_number_below_all_that_is_measured(command: str, option: str, tmp_path: Path) -> None:
    if (command, option) in (("fit", "--time-step"), ("calibrate", "--force-interval")):
        pytest.skip("the command has no such option")
    line = refusal(here(*COMMANDS[command], option, "1e-320", "-o", tmp_path / "run"))
    assert option in line
    assert "must be at least 1e-25" in line
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize("option", ["--side", "--mass", "--time-step"])
def test_the_least_that_is_taken_is_no_traceback(option: str, tmp_path: Path) -> None:
    for command in ("simulate", "assemble"):
        least = ("--duration", "1s", option, f"{SMALLEST:g}", "-o", tmp_path / command)
        done = here(*COMMANDS[command], *least)
        assert done.code in (0, 2), done.err


@pytest.mark.parametrize("command", ["info", "fit", "calibrate", "compare-models"])
def test_positions_that_are_as_good_as_zero(command: str, tmp_path: Path) -> None:
    steps = np.random.default_rng(2).normal(size=(600, 2))
    rows = np.column_stack([0.1 * np.arange(600), 1e-313 * np.cumsum(steps, axis=0)])
    np.savetxt(tmp_path / "tiny.csv", rows, delimiter=",", header="t,x,y", comments="")
    out = () if command == "info" else ("-o", tmp_path / "run", "--tank", "30cm")
    line = refusal(here(command, tmp_path / "tiny.csv", *out))
    assert "e-312 from the origin" in line.replace("e-311", "e-312")
    assert "--length-unit" in line


@pytest.mark.parametrize("command", ["simulate", "assemble"])
def test_steps_that_nobody_waits_for(command: str, tmp_path: Path) -> None:
    options = ("--force-interval", "1ns", "--duration", "5s", "-o", tmp_path / "run")
    line = refusal(here(*COMMANDS[command], *options))
    assert "5e+09 steps of every simulated world, some 1.2 hours each" in line
    assert "--force-interval" in line


def test_a_key_of_fifty_thousand_parts() -> None:
    for text in ("a." * 50_000 + "a = 1", "[" + '"b" . ' * 50_000 + "a]", "x = {" + "a." * 101):
        with pytest.raises(FormatError, match="a key of more than 100 parts"):
            parse_toml(text)
    many = ", ".join(["0.25"] * 2000)
    assert parse_toml(f"values = [{many}]\n[a.b]\n'c.d' = 1")["a"] == {"b": {"c.d": 1}}


def test_no_memory_for_a_simulation_names_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*given: object, **options: object) -> None:
        raise MemoryError("std::bad_alloc")

    monkeypatch.setattr(simulation._core, "simulate", full)
    still = dw.uniform_flow(0.0, 0.0)
    with pytest.raises(MemoryError) as error:
        dw.simulate(dw.Study(), still, sample_time=0.1 * np.arange(1000), replicates=500)
    assert one_line(error.value) == (
        "there is not enough memory for this: 500 replicates of 1000 samples take 0.006 GB; take "
        "fewer (--replicates, --sample-rate) or a shorter time (--duration)"
    )
    assert one_line(MemoryError("std::bad_alloc")) == "there is not enough memory for this"


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_connector_without_effect_is_said(tmp_path: Path) -> None:
    options = ("--duration", "1s", "--connector-distance", "1cm", "--connector-axis", "0.1")
    done = here("assemble", *BLOCKS, *options, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    said = "--connector-distance and --connector-axis have no effect with --latching collision"
    assert said in done.err
    done = here("assemble", *BLOCKS, *options, "--latching", "connector", "-o", tmp_path / "two")
    assert "no effect" not in done.err


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_the_resistance_of_the_water_is_stated_alone(tmp_path: Path) -> None:
    options = ("--duration", "1s", "--approach-resistance", "1e-4", "-o", tmp_path / "run")
    done = here("assemble", *BLOCKS, *options)
    assert "the water between two blocks resists: 0.0001 N s times speed / gap" in done.out, (
        done.err
    )


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_table_that_changes_during_a_run_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import driftwalk.assembly

    table, simulate = tmp_path / "table.csv", driftwalk.assembly.assembly_path
    table.write_text("gap_mm,force_mN\n0,20\n20,0", encoding="utf-8")

    def changed(*given: Any, **options: Any) -> Any:
        table.write_text("gap_mm,force_mN\n0,10\n20,0", encoding="utf-8")
        return simulate(*given, **options)

    monkeypatch.setattr(driftwalk.assembly, "assembly_path", changed)
    options = ("--duration", "1s", "--attraction", table, "-o", tmp_path / "run")
    done = here("assemble", *BLOCKS, *options)
    assert done.code == 2
    assert "table.csv has changed during the run: start it again" in done.err


def test_the_force_of_a_study_is_bounded_in_python() -> None:
    study = dw.Study(forces={"force_interval_s": 1e-9})
    with pytest.raises(
        InputError, match=r"take a longer interval of the force \(`forces.force_interval_s`"
    ):
        dw.simulate(study, dw.uniform_flow(0.0, 0.0), sample_time=[0.0, 10.0])
