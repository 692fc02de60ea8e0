"""Every short name of a key of a study makes an option, and what is typed reaches the key."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given as examples, settings, strategies as st

from driftwalk.cli import main as cli_main
from driftwalk.cli.main import Command, main
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import Json
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.argument_names import option_of
from driftwalk.core import study_keys
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import FIT_KEYS, RECOVER_KEYS, STUDY_KEYS
from driftwalk.model import Study, declared
from driftwalk.model.section import SMALLEST

TABLES = {name: getattr(study_keys, name) for name in dir(study_keys) if name.endswith("_KEYS")}
Run = Callable[..., StudyOptions]


@pytest.fixture(scope="module")
def probe() -> Any:
    """Return a function that runs a command with all options of a table and returns what it got."""
    patch = pytest.MonkeyPatch()

    def run(keys: Mapping[str, str], *words: str) -> StudyOptions:
        seen: list[StudyOptions] = []

        @with_study_options(keys, *keys)
        def command(given: StudyOptions, json: Json = False) -> None:
            given.study()
            seen.append(given)

        module = ModuleType("driftwalk.cli.probe")
        module.probe = command  # type: ignore[attr-defined]
        patch.setitem(sys.modules, "driftwalk.cli.probe", module)
        patch.setitem(cli_main.COMMANDS, "probe", Command("Fit", "Probe.", "probe"))
        assert main(["probe", *words]) == (0 if seen else 2)
        return seen[0] if seen else StudyOptions(None, {}, keys)

    yield run
    patch.undo()


NAMES = {key: (table, name) for table, keys in TABLES.items() for name, key in keys.items()}
"""One name of each key; the tables have most keys in common."""


@pytest.mark.fast_cases(9)
@pytest.mark.parametrize(("table", "name"), NAMES.values(), ids=NAMES)
@settings(max_examples=3)
@examples(data=st.data())
def test_what_is_typed_reaches_the_key(
    table: str, name: str, probe: Run, data: st.DataObject
) -> None:
    keys = TABLES[table]
    typed, expected = data.draw(values_of(keys[name]))
    given = probe(keys, option_of(name), typed, *with_it(keys, name))
    section, _, key = keys[name].partition(".")
    if key == "depth" and not isinstance(expected, str):
        key = "depth_m"
    found = getattr(getattr(given.study(), section), key)
    assert found == (pytest.approx(expected) if isinstance(expected, float) else expected)


def with_it(keys: Mapping[str, str], name: str) -> list[str]:
    """Return what else a study needs for a value not to contradict the rest of it."""
    if name == "flow_labels" and keys is FIT_KEYS:
        return ["--switching-times", "1,2"]
    if name == "side":
        return ["--tank", "900"]
    return ["--force-interval", "10"] if name == "time_step" else []


def values_of(key: str) -> st.SearchStrategy[tuple[str, Any]]:
    """Return texts that a user may type for a key, each with the value that it means."""
    by_hand: dict[str, list[tuple[str, Any]]] = {
        "assembly.faces": [("any", "any"), ("N,S,N,S", "N,S,N,S")],
        "assembly.glued": [("x", "x"), ("xx", "xx"), ("x./xx", "x./xx")],
        "interaction.magnets": [("none", "none"), ("5x5x2mm,1.3T", "5x5x2mm,1.3T")],
        "interaction.attraction": [("a/table.csv", "a/table.csv")],
        "fit.interaction": [("true", True)],
        "fit.switching_times_s": [("1, 2.5", (1.0, 2.5)), ("16ms", (0.016,))],
        "block.shape": [("disc", "disc"), ("xx", "xx"), ("x./xx", "x./xx")],
        "fit.flow_labels": [("A,B,A", ("A", "B", "A"))],
        "recover.durations_s": [("10min,1h", (600.0, 3600.0)), ("20", (20.0,))],
        "recover.flow": [("a/flow.nc", "a/flow.nc")],
        "simulation.time_step_s": [("auto", "auto"), ("10ms", 0.01), ("0.1", 0.1)],
        "tank.diameter_m": [("30cm", 0.3), ("0.5", 0.5)],
    }
    if key in by_hand:
        return st.sampled_from(by_hand[key])
    of_key = declared(key)
    words = [st.just((word, word)) for word in of_key.words]
    quantity = of_key.quantity
    if quantity is None:
        return st.one_of(words)
    least = SMALLEST if quantity.gt == 0 else 0.0
    low, high = (quantity.ge or quantity.gt or least), (quantity.le or quantity.lt or 1e9)
    if quantity.whole:
        whole = st.integers(int(low), int(high))
        return whole.map(lambda number: (str(number), number))
    inside = st.floats(low, high, exclude_min=quantity.ge is None, exclude_max=quantity.le is None)
    return st.one_of(*words, inside.map(lambda number: (repr(number), number)))


@pytest.mark.parametrize(
    ("keys", "words", "message"),
    [
        (STUDY_KEYS, ["--force-std", "5s"], "Invalid value for '--force-std': "),
        (STUDY_KEYS, ["--seed", "-1"], "Invalid value for '--seed': "),
        (STUDY_KEYS, ["--depth", "deep"], "Invalid value for '--depth': "),
        (STUDY_KEYS, ["--mass", "-1"], "--mass over the default study: [block] mass_kg: must be"),
        (FIT_KEYS, ["--angle", "stat"], "--angle over the default study: [fit] angle must be"),
        (FIT_KEYS, ["--switching-times", "2,1"], "--switching-times over the default study: "),
        (FIT_KEYS, ["--switching-times", "2,x"], "--switching-times over the default study: "),
        (RECOVER_KEYS, ["--duration", ""], "--duration over the default study: "),
    ],
)
def test_a_wrong_value_is_one_line_with_the_option(
    keys: Mapping[str, str],
    words: list[str],
    message: str,
    probe: Run,
    capsys: pytest.CaptureFixture[str],
) -> None:
    probe(keys, *words)
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1
    assert message in printed


def test_the_study_file_is_read_and_named(
    probe: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "study.toml"
    path.write_text("[tank]\ndiameter_m = 0.4\n", encoding="utf-8")
    given = probe(STUDY_KEYS, "--study", str(path), "--mass", "12g")
    assert given.states_tank
    assert (given.study().tank.diameter_m, given.study().block.mass_kg) == (0.4, 0.012)
    assert not probe(STUDY_KEYS, "--mass", "12g").states_tank
    assert probe(STUDY_KEYS, "--tank", "50cm").states_tank
    probe(STUDY_KEYS, "--study", str(path), "--tank", "1cm")
    assert f"--tank over {path}: " in capsys.readouterr().err


def test_an_option_may_be_repeated_for_a_list(probe: Run) -> None:
    given = probe(RECOVER_KEYS, "--duration", "10min", "--duration", "1h")
    assert given.study().recover.durations_s == (600.0, 3600.0)


def test_two_objects_of_a_command_are_spread() -> None:
    @with_recording_options
    @with_study_options(STUDY_KEYS, "side", file="none")
    def command(name: str, given: StudyOptions, how: RecordingOptions) -> tuple[Any, ...]:
        return name, given.overrides, how.body

    values = {"name": "a", "side": 0.02, "body": "b"}
    missing = dict.fromkeys(command.__annotations__.keys() - values.keys())
    assert command(**values, **missing) == ("a", {"block.side_m": 0.02}, "b")
    assert "study" not in command.__annotations__


def test_a_key_that_does_not_exist_has_no_option() -> None:
    with pytest.raises(ConfigurationError, match=r"no key 'tank.color'"):
        declared("tank.color")
    with pytest.raises(KeyError):
        with_study_options(STUDY_KEYS, "colour")


def test_a_study_is_as_it_was_without_options(probe: Run) -> None:
    assert probe(STUDY_KEYS).study() == Study()
