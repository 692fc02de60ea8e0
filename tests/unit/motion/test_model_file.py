"""Motion models in Python files of a user: what is taken, and one line about what is not."""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from walkers import tumble

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import MotionModel, Parameter, ScoresItself, motion_model
from driftwalk.testing import MotionModelContract

FUNCTION = """\
import numpy as np
from driftwalk.motion import Parameter

STEP = 0.5


def tumbler(
    scene,
    *,
    speed=(0.01, 0.1, "m/s"),
    tumble_rate=Parameter("tumble_rate", "1/s", 0.1, 10.0, scale="log"),
    centre=(0.0, 0.0),
):
    interval = np.diff(scene.times, prepend=0.0)
    turns = scene.random.uniform(interval.size) < -np.expm1(-tumble_rate * interval)
    angle = np.cumsum(turns * 2 * np.pi * scene.random.uniform(interval.size), axis=1)
    x = centre[0] + np.cumsum(speed * interval * np.cos(angle), axis=1)
    y = centre[1] + np.cumsum(speed * interval * np.sin(angle), axis=1)
    return x, y
"""
CLASS = (
    FUNCTION
    + """

import driftwalk as dw
from dataclasses import dataclass


@dataclass
class Tumbler:
    made: int = 0

    def __post_init__(self):
        self.inner = dw.motion_model(tumbler)
        self.name, self.parameters, self.needs_flow = "mine", self.inner.parameters, False

    def simulate(self, values, like, keys):
        return self.inner.simulate(values, like, keys)

    def describe(self):
        return {"name": self.name, "own": 1}

    def facts(self, estimate):
        return {"model": self.name}


MODEL = Tumbler()
BLOCK = dw.motion.BlockModel(dw.Study())
"""
)


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    """Work in a folder that holds `mine.py`."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(CLASS, encoding="utf-8")


class TestFunctionInAFile(MotionModelContract):
    def model(self):
        return motion_model("mine.py:tumbler")


class TestClassInAFile(MotionModelContract):
    def model(self):
        return motion_model("mine.py:Tumbler")


class TestBlockInAFile(MotionModelContract):
    """A model that scores itself does so from a file."""

    def model(self):
        return motion_model("mine.py:BLOCK")

    def flow(self):
        return dw.tank30_flow()


def test_a_function_is_made_a_model_by_the_ranges_of_its_keywords():
    model = motion_model("mine.py:tumbler")
    assert model.name == "tumbler"
    assert model.parameters == (
        Parameter("speed", "m/s", 0.01, 0.1),
        Parameter("tumble_rate", "1/s", 0.1, 10.0, scale="log"),
    )


def test_a_function_without_a_file_may_hold_its_ranges_too():
    def walk(scene, *, speed=(0.01, 0.1, "m/s"), turn):
        return scene

    model = motion_model(walk, turn=(0, 1, "rad"))
    assert [one.key for one in model.parameters] == ["speed_m_s", "turn_rad"]


def test_given_ranges_replace_those_of_the_function():
    own = Parameter("tumble_rate", "1/s", 1.0, 2.0, step=0.25)
    model = motion_model("mine.py:tumbler", own, speed=(0.02, 0.05))
    assert model.parameters == (Parameter("speed", "m/s", 0.02, 0.05), own)


def test_worlds_are_those_of_the_function():
    Path("tumble.py").write_text(
        Path(tumble.__code__.co_filename).read_text(encoding="utf-8"), encoding="utf-8"
    )
    ranges = {"speed": (0, 0.1, "m/s"), "tumble_rate": (0, 5, "1/s")}
    contract = MotionModelContract()
    contract.model = lambda: motion_model(tumble, **ranges)
    values = {"speed": np.full(2, 0.03), "tumble_rate": np.full(2, 1.0)}
    keys = world_keys(1, trial=0, replicate=[0, 1])
    worlds = [
        model.simulate(values, contract.conditions(), keys)
        for model in (
            contract.model(),
            motion_model("tumble.py:tumble", **ranges),
            motion_model("tumble.py:tumble", settings="many", **ranges),
        )
    ]
    np.testing.assert_array_equal(worlds[1].x, worlds[0].x)
    np.testing.assert_array_equal(worlds[2].x, worlds[0].x)


def test_a_class_and_an_instance_are_models():
    for name in ("Tumbler", "MODEL"):
        model = motion_model(f"mine.py:{name}")
        assert isinstance(model, MotionModel)
        assert model.name == "mine"
        assert not isinstance(model, ScoresItself)


def test_the_hash_of_the_file_is_part_of_the_description():
    sha256 = hashlib.sha256(CLASS.encode()).hexdigest()
    for name in ("tumbler", "Tumbler", "MODEL"):
        model = motion_model(f"mine.py:{name}")
        assert model.describe()["source_sha256"] == sha256
        assert model.facts({})["model_source_sha256"] == sha256
    assert motion_model("mine.py:MODEL").describe()["own"] == 1


def test_a_changed_file_is_loaded_again():
    """Within the same second, at the same size: a compiled copy would pass for it."""
    first = motion_model("mine.py:tumbler")
    there = Path("mine.py").stat()
    Path("mine.py").write_text(CLASS.replace("(0.01, 0.1,", "(0.02, 0.1,"), encoding="utf-8")
    os.utime("mine.py", (there.st_atime, there.st_mtime))
    second = motion_model("mine.py:tumbler")
    assert (first.parameters[0].low, second.parameters[0].low) == (0.01, 0.02)
    assert first.describe() != second.describe()
    assert first.describe()["source_sha256"] == hashlib.sha256(CLASS.encode()).hexdigest()


def test_a_file_imports_the_ones_next_to_it(tmp_path, monkeypatch):
    folder = tmp_path / "models"
    folder.mkdir()
    name = "neighbour_of_a_model_file"
    (folder / f"{name}.py").write_text("LOW = 0.25\n", encoding="utf-8")
    text = f"from {name} import LOW\n" + FUNCTION.replace("0.01,", "LOW,").replace("0.1,", "0.5,")
    (folder / "its.py").write_text(text, encoding="utf-8")
    before = list(sys.path)
    assert motion_model("models/its.py:tumbler").parameters[0].low == 0.25
    assert sys.path == before
    monkeypatch.delitem(sys.modules, name)


def test_a_file_that_fails_leaves_nothing_behind():
    Path("bad.py").write_text("x = 1 / 0\n", encoding="utf-8")
    modules, path = set(sys.modules), list(sys.path)
    with pytest.raises(ConfigurationError, match="division by zero"):
        motion_model("bad.py:walk")
    assert (set(sys.modules), sys.path) == (modules, path)
    assert not Path("__pycache__").exists()


@pytest.mark.parametrize("name", ["tumbler", "Tumbler", "MODEL"])
def test_a_model_goes_to_another_process(name, monkeypatch):
    model = motion_model(f"mine.py:{name}")
    stored = pickle.dumps(model)
    monkeypatch.chdir("/")
    copy = pickle.loads(stored)
    assert copy.describe() == model.describe()


def test_a_model_of_a_file_that_changed_does_not_go_on_as_another_one():
    stored = pickle.dumps(motion_model("mine.py:tumbler", speed=(0.02, 0.05)))
    Path("mine.py").write_text(CLASS + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="has changed since the model was made"):
        pickle.loads(stored)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("min.py:tumbler", "there is no file min.py; did you mean 'mine.py'?"),
        ("no/such.py:tumbler", "there is no file no/such.py"),
        ("folder.py:tumbler", "cannot read folder.py: Is a directory"),
        ("mine.py:tumbla", "has no 'tumbla', it has tumbler, Tumbler, MODEL, BLOCK; did you mean"),
        ("mine.py:", "say what in mine.py is the model (mine.py:NAME): it has tumbler, Tumbler"),
        ("mine.py:STEP", "mine.py:STEP is float; expected a motion model, a class that makes one"),
        ("mine.py:np", "mine.py:np is module; expected a motion model"),
    ],
)
def test_what_is_not_there_is_one_line(address, message):
    Path("folder.py").mkdir()
    with pytest.raises(ConfigurationError) as found:
        motion_model(address)
    assert message in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        ("x = 1\ndef walk(scene:\n", "walk", "bad.py, line 2: '(' was never closed"),
        ("x = '\0'\n", "walk", "source code string cannot contain null bytes"),
        (b"x = '\xff'\n", "walk", "bad.py"),
        ("x = 1\ny = 1 / 0\n", "walk", "bad.py, line 2: ZeroDivisionError: division by zero"),
        ("import sys\nsys.exit('stop')\n", "walk", "bad.py, line 2: SystemExit: stop"),
        ("import no_such_module\n", "walk", "bad.py, line 1: ModuleNotFoundError: No module"),
        ("x = 1\n", "walk", "bad.py has no 'walk', it defines no function and no class"),
        ("import numpy as np\n", "arange", "it defines no function and no class"),
        ("def walk(scene): pass\n", "walk", "bad.py:walk: a motion model needs a parameter"),
        ("def walk(scene, *, a): pass\n", "walk", "bad.py:walk: a motion model needs a parameter"),
        (
            "def walk(scene, *, a=(1, 0, 'm')): pass\n",
            "walk",
            "bad.py:walk: parameter a: its range ends at 0, below its beginning 1",
        ),
        (
            "def walk(*, a=(0, 1, 'm')): pass\n",
            "walk",
            "cannot be called with a scene and a",
        ),
        ("class Walk: pass\n", "Walk", "bad.py:Walk is an object without name, parameters, needs"),
        (
            "class Walk:\n    def __init__(self):\n        self.x = missing\n",
            "Walk",
            "Walk() failed: bad.py, line 3: NameError: name 'missing' is not defined",
        ),
        (
            "class Walk:\n    def __init__(self, a): pass\n",
            "Walk",
            "Walk() failed: bad.py: TypeE",
        ),
        (
            CLASS.replace("self.inner.parameters, False", "[], False"),
            "Tumbler",
            "bad.py:Tumbler: its parameters are [], expected a tuple of driftwalk.motion.Parameter",
        ),
    ],
)
def test_a_file_that_is_no_model_is_one_line(text, name, message):
    content = text if isinstance(text, bytes) else text.encode()
    Path("bad.py").write_bytes(content)
    with pytest.raises(ConfigurationError) as found:
        motion_model(f"bad.py:{name}")
    assert message in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("address", "options", "message"),
    [
        (
            "mine.py:MODEL",
            {"speed": (0, 1)},
            "mine.py:MODEL is a model that declares its ranges",
        ),
        ("mine.py:Tumbler", {"settings": "many"}, "change them in the file"),
        ("mine.py:tumbler", {"speed": (0, 1, "km/h")}, "speed is in m/s, and its range in km/h"),
        (
            "mine.py:tumbler",
            {"sped": (0, 1)},
            "cannot be called with a scene and speed, tum",
        ),
        ("mine.py:tumbler", {"settings": "few"}, "one of one, many, got 'few'"),
        ("mine.py:tumbler", {"clearance": 0.1}, "a model in a file keeps its own distance"),
        ("mine.py:tumbler", {"timeout": 1.0}, "only a program has a time limit"),
        ("active", {"timeout": 1.0}, "only a program has a time limit"),
    ],
)
def test_a_wrong_choice_is_refused(address, options, message):
    with pytest.raises(ConfigurationError, match=message):
        motion_model(address, **options)
