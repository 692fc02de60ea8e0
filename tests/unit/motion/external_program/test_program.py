"""Programs as motion models: their worlds, and one message for everything that they do wrong."""

from __future__ import annotations

import gc
import json
import os
import pickle
import shlex
import shutil
import signal
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.conditions import Conditions
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import MotionModel, Parameter, ProgramModel, motion_model
from driftwalk.motion.external_program import process
from driftwalk.motion.external_program.program import program_words
from driftwalk.simulation import Start
from driftwalk.simulation.backend import STATUS, Camera
from driftwalk.testing import MotionModelContract, assert_same

SCRIPT = Path(__file__).resolve().parents[3] / "helpers" / "tumble_program.py"
# Without site-packages an interpreter starts in a fiftieth of a second.
PYTHON = f"{shlex.quote(sys.executable)} -I -S"
LIKE = Conditions(
    sample_time=np.arange(60) / 10.0,
    start=Start(0.02, -0.01, np.nan, 0.01, 0.02, 0.1),
    camera=Camera(position_noise=3e-4),
    tank=dw.Study().tank,
    view=None,
    flow=None,
    threads=1,
)
KEYS = world_keys(1, trial=[0, 0, 1, 2], replicate=[0, 1, 0, 0])
VALUES = {"speed": np.array([0.03, 0.03, 0.05, 0.07]), "tumble_rate": np.full(4, 2.0)}


def address(*words: object, script: Path = SCRIPT) -> str:
    return " ".join([f"command:{PYTHON}", *(shlex.quote(str(word)) for word in (script, *words))])


def simulate(*words: object, like: Conditions = LIKE, **options: float):
    return motion_model(address(*words), **options).simulate(VALUES, like, KEYS)


def written(folder: Path, source: str) -> Path:
    """Write a program that answers with the parameter `speed`, and to worlds with `source`."""
    head = (
        "import json, sys\n"
        "print(json.dumps({'parameters': [{'name': 'speed', 'low': 0, 'high': 1}]}), flush=True)\n"
        "sys.stdin.readline()\n"
    )
    path = folder / "written.py"
    path.write_text(head + source, encoding="utf-8")
    return path


@cache
def kept(*words: str) -> MotionModel:
    """Return a model whose programs run on from test to test."""
    return motion_model(address(*words))


class TestProgram(MotionModelContract):
    def model(self):
        return kept()


class TestProgramWithOrientation(MotionModelContract):
    def model(self):
        return kept("theta")


def test_the_program_names_its_parameters():
    model = motion_model(address())
    assert isinstance(model, ProgramModel)
    assert model.name == "tumble_program"
    assert not model.needs_flow
    assert model.parameters == (
        Parameter("speed", "m/s", 0.01, 0.1, meaning="speed of a run"),
        Parameter("tumble_rate", "1/s", 0.1, 10.0, scale="log"),
    )


def test_the_program_names_the_steps_of_the_search():
    (speed,) = motion_model(address("steps")).parameters
    assert speed.values == pytest.approx((0.01, 0.04, 0.07, 0.1))
    assert speed.refined_step == 0.01


def test_given_ranges_take_the_place_of_those_of_the_program():
    own = Parameter("tumble_rate", "1/s", 1.0, 2.0, step=0.25)
    speed, rate = motion_model(address(), own, speed=(0.02, 0.05)).parameters
    assert (speed.low, speed.high, speed.unit) == (0.02, 0.05, "m/s")
    assert speed.meaning == "speed of a run"
    assert rate == own


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sped": (0, 1)}, "no parameter 'sped', it has speed, tumble_rate; did you mean 'speed'"),
        ({"speed": (0, 1, "km/h")}, "speed is in m/s, and its range in km/h"),
        ({"speed": 0.1}, "speed: expected a range such as"),
        ({"timeout": 0}, "`timeout` is 0, expected a time above 0 s"),
        ({"settings": "many"}, "a program gets one setting at a time"),
        ({"clearance": 0.1}, "a program keeps its own distance from the wall"),
    ],
)
def test_a_wrong_choice_is_refused(options, message):
    with pytest.raises(ConfigurationError, match=message):
        motion_model(address(), **options)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("", "name the program"),
        ("./a 'b", "is no command: No closing quotation"),
        ("./no-such-program", r"cannot start the program \./no-such-program: No such file"),
        (str(SCRIPT), "Permission denied; a script needs its interpreter"),
    ],
)
def test_what_is_no_program_is_refused(command, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigurationError, match=message):
        motion_model(f"command:{command}")


@pytest.mark.parametrize("names", ["id", "id, flow_file"])
def test_a_program_gets_the_flow_as_a_file_where_there_is_one(names, tmp_path):
    source = (
        "asked = json.loads(sys.stdin.readline())\n"
        "shown = {key: asked.get('flow_file') for key in ('id', 'flow_file') if key in asked}\n"
        "print(json.dumps({'id': 1, 'error': ', '.join(shown) + ': ' + str(shown['id'])}))\n"
        "sys.stdout.flush()\n"
    )
    model = motion_model(address(script=written(tmp_path, source)))
    flow = dw.tank30_flow() if "flow" in names else None
    values = {"speed": np.full(4, 0.03)}
    with pytest.raises(InputError, match=f"it reported: {names}: ") as refused:
        model.simulate(values, replace(LIKE, flow=flow), KEYS)
    path = str(refused.value).rpartition(": ")[2]
    if flow is None:
        assert path == "None"
        return
    with np.load(path) as stored:
        np.testing.assert_array_equal(stored["x_m"], flow["x"])
        np.testing.assert_array_equal(stored["y_m"], flow["y"])
        np.testing.assert_array_equal(stored["u_m_s"], flow["u"])
        np.testing.assert_array_equal(stored["v_m_s"], flow["v"])
    folder = Path(path).parent
    del model, refused
    gc.collect()
    assert not folder.exists()


def test_a_program_lies_where_the_model_was_made(tmp_path, monkeypatch):
    shutil.copy(SCRIPT, tmp_path / "mine.py")
    monkeypatch.chdir(tmp_path)
    model = motion_model(f"command:{PYTHON} mine.py")
    monkeypatch.chdir("/")
    model.simulate(VALUES, replace(LIKE, threads=4), KEYS)
    assert model.name == "mine"


def test_worlds_are_the_positions_of_the_program():
    """The walk of the program, with the start, the times and the seed that it gets."""
    like = replace(LIKE, camera=Camera(), start=LIKE.start._replace(theta=0.3))
    worlds = motion_model(address(), tumble_rate=(1e-12, 1e-11)).simulate(
        {"speed": VALUES["speed"], "tumble_rate": np.full(4, 1e-12)}, like, KEYS
    )
    way = VALUES["speed"][:, None] * like.sample_time
    np.testing.assert_allclose(worlds.x, 0.02 + way * np.cos(0.3), rtol=1e-12)
    np.testing.assert_allclose(worlds.y, -0.01 + way * np.sin(0.3), rtol=1e-12)
    assert np.isnan(worlds.theta).all()
    assert (worlds.status == 0).all()


def test_the_request_is_as_the_page_says(tmp_path):
    """What a program reads, and in which shape."""
    log = tmp_path / "log"
    source = (
        f"for line in sys.stdin:\n"
        f"    open({str(log)!r}, 'a').write(line)\n"
        "    asked = json.loads(line)\n"
        "    rows = [[s * 1e-18 + t for t in asked['times_s']] for s in asked['seeds']]\n"
        "    print(json.dumps({'id': asked['id'], 'x_m': rows, 'y_m': rows}), flush=True)\n"
    )
    model = motion_model(address(script=written(tmp_path, source)))
    model.simulate({"speed": VALUES["speed"]}, LIKE, KEYS)
    both, alone, *asked = (json.loads(line) for line in log.read_text().splitlines())
    assert [one["parameters"] for one in asked] == [{"speed": v} for v in (0.03, 0.05, 0.07)]
    assert both["seeds"][1:] == alone["seeds"]
    first = asked[0]
    assert list(first) == ["id", "parameters", "times_s", "start", "seeds", "tank"]
    assert first["times_s"] == LIKE.sample_time.tolist()
    assert first["tank"] == LIKE.tank.to_arena()
    assert len(first["seeds"]) == 2
    assert all(isinstance(seed, int) and 0 <= seed < 2**53 for seed in first["seeds"])
    start = first["start"]
    assert list(start) == ["x_m", "y_m", "theta_rad", "vx_m_s", "vy_m_s", "omega_rad_s"]
    assert start["omega_rad_s"] == [0.1, 0.1]
    assert start["theta_rad"][0] != start["theta_rad"][1]
    assert len({one["id"] for one in (both, alone, *asked)}) == 5


@pytest.mark.slow
def test_threads_and_restarts_do_not_change_a_world(tmp_path):
    expected = simulate()
    assert_same(simulate(like=replace(LIKE, threads=4)), expected, "threads matter")
    assert_same(simulate("die-once", tmp_path / "seen"), expected, "a restart matters")
    assert (tmp_path / "seen").exists()


def test_several_threads_may_use_one_model():
    model = motion_model(address())
    expected = model.simulate(VALUES, LIKE, KEYS)
    with ThreadPoolExecutor(4) as executor:
        calls = [executor.submit(model.simulate, VALUES, LIKE, KEYS) for _ in range(8)]
        for call in calls:
            assert_same(call.result(), expected, "another thread got other worlds")


def test_a_model_goes_to_another_process():
    model = motion_model(address(), speed=(0.02, 0.08))
    expected = model.simulate(VALUES, LIKE, KEYS)
    copy = pickle.loads(pickle.dumps(model))
    assert copy.describe() == model.describe()
    assert_same(copy.simulate(VALUES, LIKE, KEYS), expected, "the copy is another model")


def test_a_failed_world_is_data():
    failed = STATUS["non_finite"]
    assert simulate("null").status.tolist() == [failed] * 4
    assert simulate("nan").status.tolist() == [failed, 0, failed, failed]


def test_an_orientation_is_taken():
    worlds = simulate("theta", like=replace(LIKE, camera=Camera()))
    assert (worlds.theta == 0.5).all()


def test_much_on_standard_error_blocks_nothing():
    assert_same(simulate("errors"), simulate(), "standard error matters")


@pytest.mark.slow
def test_answers_of_some_megabytes_are_read():
    """A request and an answer that no pipe holds, read whole."""
    like = replace(LIKE, sample_time=np.arange(4000) / 10.0, threads=2)
    keys = world_keys(1, trial=0, replicate=np.arange(40))
    values = {"speed": np.full(40, 0.03), "tumble_rate": np.full(40, 2.0)}
    worlds = motion_model(address()).simulate(values, like, keys)
    assert worlds.x.shape == (40, 4000)
    assert (worlds.status == 0).all()
    last = motion_model(address()).simulate({k: v[-1:] for k, v in values.items()}, like, keys[-1:])
    np.testing.assert_array_equal(worlds.x[-1:], last.x)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("die", r", twice: it ended with exit code 3; its last messages: line 15 .*\| line 19 of"),
        ("signal", r", twice: it was ended by SIGSEGV$"),
        ("close-output", r", twice: it closed its standard output$"),
        ("garbage", r"expected JSON: .*; the answer begins 'starting the engine'"),
        ("list", r"its answer is no object of JSON; the answer begins '\[1, 2\]'"),
        ("id", r"it answered with the id \d+, expected \d+; the answer begins '{\"id\": "),
        ("no-y", r"its answer has no list y_m; .* begins '.{80}…'$"),
        (
            "shape",
            r"x_m has the shape \(9, 60\), expected \(2, 60\): \(worlds, times\); the answer",
        ),
        ("ragged", r"the rows of x_m differ in length; expected \(2, 60\)"),
        ("text", r"y_m holds something that is no number"),
        ("true", r"y_m holds something that is no number"),
        ("wrong-theta", r"its answer has no list theta_rad"),
        ("error", r"it reported: the speed is too high$"),
        ("endless", r"its answer is longer than 1\.02 MiB"),
    ],
)
def test_a_fault_is_one_message_with_the_parameters(fault, message, monkeypatch):
    monkeypatch.setattr(process, "GRACE_S", 0.1)
    with pytest.raises(InputError, match=message) as found:
        simulate(fault)
    text = str(found.value)
    assert "\n" not in text
    assert text.startswith("the program ")
    assert f"{SCRIPT} {fault}' failed at speed=0.03, tumble_rate=2" in text


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("own-chance", "it is not reproducible"),
        ("of-the-batch", "it is not reproducible"),
        ("all-null", "none of its positions is a number"),
    ],
)
def test_a_world_that_does_not_come_again_is_found_at_first_use(fault, message):
    with pytest.raises(InputError, match=rf"failed at speed=0.055, tumble_rate=1: {message}"):
        simulate(fault)


def test_a_copy_that_makes_other_worlds_is_found():
    """A generator that starts with the number of the process repeats itself within one copy."""
    model = motion_model(address("of-the-process"))
    model.simulate(VALUES, LIKE, KEYS)
    kill(model)
    with pytest.raises(InputError, match="it is not reproducible"):
        model.simulate(VALUES, LIKE, KEYS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "hint"),
    [
        ("hang", "an answer has to be flushed; `timeout` .*; its last messages: still at it"),
        ("no-line-break", "a line break ends an answer"),
    ],
)
def test_a_program_that_hangs_is_ended_with_all_that_it_started(fault, hint, tmp_path):
    beats = tmp_path / "beats"
    beats.touch()
    begun = time.monotonic()
    with pytest.raises(InputError, match=rf"speed=0.03, .* no answer within 2 s \({hint}"):
        simulate(fault, beats, timeout=2.0)
    assert time.monotonic() - begun < 10.0
    counted = beats.stat().st_size
    time.sleep(0.2)
    assert beats.stat().st_size == counted
    assert (counted > 0) == (fault == "hang")


@pytest.mark.slow
def test_a_program_that_reads_nothing_hangs_too(tmp_path):
    """The request does not fit into the pipe, and nobody reads it."""
    script = written(tmp_path, "import time\ntime.sleep(600)\n")
    like = replace(LIKE, sample_time=np.arange(100_000) / 10.0)
    model = motion_model(address(script=script), timeout=0.5)
    model._probed_like = like
    with pytest.raises(InputError, match=r"no answer within 0\.5 s"):
        model.simulate({"speed": np.full(4, 0.3)}, like, KEYS)


def test_an_error_ends_the_requests_of_the_other_threads():
    """The last setting is refused at once; for the others one would wait a minute."""
    model, begun = motion_model(address("hang-or-error")), time.monotonic()
    with pytest.raises(InputError, match=r"speed=0.07, tumble_rate=2: it reported: too fast"):
        model.simulate(VALUES, replace(LIKE, threads=3), KEYS)
    assert time.monotonic() - begun < 10.0
    assert pids(model) == []


@pytest.mark.slow
def test_ctrl_c_ends_the_requests():
    # A process that was started in the background ignores the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    model, begun = motion_model(address("hang")), time.monotonic()
    timer = threading.Timer(0.5, os.kill, [os.getpid(), signal.SIGINT])
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            model.simulate(VALUES, replace(LIKE, threads=3), KEYS)
    finally:
        timer.cancel()
        timer.join()
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begun < 10.0
    assert pids(model) == []


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("no-start", r", twice: it ended with exit code 1; its last messages: the license has ex"),
        ("no-list", r": its answer has no list of parameters; the answer begins '{}'"),
        ("no-name", r": expected a parameter with a name, got {'low': 0, 'high': 1}"),
        ("no-high", r": its parameter speed has no number high: None"),
        ("no-step", r": its parameter speed has no step above 0: 0"),
        ("text-step", r": its parameter speed has no refined_step above 0: 'fine'"),
        ("unknown-key", r": its parameter speed has an unknown key 'units'; did you mean 'unit'"),
        ("twice", r": it has two parameters speed"),
        ("empty-range", r": .* ends at 0, below its beginning"),
        ("no-parameters", r": it reported: no license"),
    ],
)
def test_a_program_without_parameters_is_refused(fault, message):
    with pytest.raises(InputError, match=f"failed when it was asked for its parameters{message}"):
        motion_model(address(fault))


def pids(model: ProgramModel) -> list[int]:
    return [program._process.pid for program in model._idle]


def kill(model: ProgramModel) -> None:
    for pid in pids(model):
        with suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)


def test_a_copy_that_was_killed_while_it_waited_is_started_again():
    model = motion_model(address())
    expected = model.simulate(VALUES, LIKE, KEYS)
    kill(model)
    assert_same(model.simulate(VALUES, LIKE, KEYS), expected, "a restart matters")


def test_a_copy_of_this_process_starts_programs_of_its_own():
    """After a fork both have the pipes of the same program: it is its parent's."""
    model = motion_model(address())
    expected = model.simulate(VALUES, LIKE, KEYS)
    (theirs,) = model._idle
    theirs._owner -= 1
    assert_same(model.simulate(VALUES, LIKE, KEYS), expected, "another program, another world")
    assert theirs not in model._idle
    theirs.close()
    # It is not killed. Here, though, nobody else holds its input open, and so it comes to its end.
    assert theirs._process.wait(10.0) == 0


def test_programs_end_with_the_model(tmp_path):
    """They get the end of their input first, and leave no process, thread or pipe."""
    gc.collect()
    threads, files = threading.active_count(), len(list(Path("/dev/fd").iterdir()))
    model = motion_model(address("last-words", tmp_path / "words"))
    model.simulate(VALUES, LIKE, KEYS)
    (pid,) = pids(model)
    del model
    gc.collect()
    assert (tmp_path / "words").read_text() == "ended by itself"
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    assert threading.active_count() == threads
    assert len(list(Path("/dev/fd").iterdir())) == files


def test_a_model_is_described_by_its_command_and_the_files_in_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(SCRIPT, "mine.py")
    Path("data.txt").write_text("1", encoding="utf-8")
    one = motion_model(f"command:{PYTHON} mine.py sound data.txt")
    Path("data.txt").write_text("2", encoding="utf-8")
    other = motion_model(f"command:{PYTHON} mine.py sound data.txt")
    first, second = one.describe(), other.describe()
    assert first["command"] == f"{PYTHON} mine.py sound data.txt"
    assert {"mine.py", "data.txt"} <= set(first["files_sha256"])
    assert first["files_sha256"]["mine.py"] == second["files_sha256"]["mine.py"]
    assert first["files_sha256"]["data.txt"] != second["files_sha256"]["data.txt"]
    assert first["files_sha256"]["data.txt"] == one.describe()["files_sha256"]["data.txt"]
    monkeypatch.chdir("/")
    facts = one.facts({})
    assert facts == {"model": "mine", "model_source_sha256": first["files_sha256"]["mine.py"]}


@pytest.mark.slow
def test_a_program_is_calibrated():
    """From the first to the last: the answer stands under the names that the program has."""
    small = {"replicates": 1, "refined_replicates": 1, "bootstrap": 4}
    study = dw.apply_overrides(dw.Study(), {f"calibration.{k}": small[k] for k in small})
    recording = dw.tank30_recording().isel(time=slice(120))
    ranges = [
        Parameter("speed", "m/s", 0.02, 0.08, step=0.02, refined_step=0.01),
        Parameter("tumble_rate", "1/s", 1.0, 3.0, step=0.5, refined_step=0.25),
    ]
    found = dw.calibrate(recording, motion_model(address(), *ranges), study=study)
    assert found["parameter"].values.tolist() == ["speed", "tumble_rate"]
    assert found.attrs["model"] == "tumble_program"
    assert len(found.attrs["model_source_sha256"]) == 64


def test_words_of_a_command():
    assert program_words(r"'my python' a\ b") == ("my python", "a b")
    # On Windows, where a backslash is of a path.
    windows = program_words(r'"C:\My Programs\tank.exe" --side 3', separator="\\")
    assert windows == (r"C:\My Programs\tank.exe", "--side", "3")
