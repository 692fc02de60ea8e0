"""`driftwalk models`: the family on the command line."""

from __future__ import annotations

import json

import pytest
from command_line import here

from driftwalk.motion import MEMBERS, PARTS, motion_model


def test_the_list_names_every_member_and_part() -> None:
    done = here("models")
    assert done.code == 0
    for one in (*MEMBERS.values(), *PARTS.values()):
        assert one.name in done.out
        assert one.sentence in done.out


def test_the_list_is_json_too() -> None:
    found = json.loads(here("models", "--json").out)
    assert [one["name"] for one in found["models"]] == list(MEMBERS)
    assert [one["name"] for one in found["parts"]] == list(PARTS)
    assert all(one["source"] for one in found["models"])


def test_a_model_shows_its_parameters() -> None:
    done = here("models", "run-rest+wall")
    assert done.code == 0
    for parameter in motion_model("run_rest+wall").parameters:
        assert parameter.name in done.out
        assert parameter.meaning in done.out
    assert MEMBERS["run_rest"].source in done.out


def test_a_model_is_json_too() -> None:
    found = json.loads(here("models", "active+slow", "--json").out)
    names = [one["name"] for one in found["parameters"]]
    assert names == [one.name for one in motion_model("active+slow").parameters]
    assert found["name"] == "active+slow"


@pytest.mark.parametrize(
    ("name", "words"),
    [("fish", "there is no motion model 'fish'"), ("active+gills", "has no part 'gills'")],
)
def test_a_wrong_name_is_one_line(name: str, words: str) -> None:
    done = here("models", name)
    assert done.code == 2
    assert words in done.err
    assert len(done.err.strip().splitlines()) == 1
