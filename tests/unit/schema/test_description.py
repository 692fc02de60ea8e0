"""The texts that describe kinds of datasets."""

from __future__ import annotations

import pytest

from driftwalk.schema.description import Attribute, Variable, attributes, kind, limited, variables

TEXT = """
kind: track
version: 2
read: x time
dimensions:
    time: samples
    body text: what floats
variables:
    x([body] time) [m]: position x; NaN where it \
        is unknown
    count [1] int: samples
    flag(time) flags: where it is from
    time [s]
variables (it was tracked):
    seen(time) bool: whether the camera saw it
attributes:
    source
    sample_rate_Hz number: usual rate
attributes (it was tracked):
    complete yes or no: whether it ended
"""


def test_a_text_says_all_of_a_kind() -> None:
    further = Attribute("more", "text", "something")
    found = kind(TEXT, further, flags={"flag": {"film": 0, "file": 1}})
    assert (found.name, found.version, found.read) == ("track", 2, "x time")
    assert found.dimensions == {"time": "samples", "body": "what floats"}
    assert found.variable("x") == Variable(
        "x", "[body] time", "m", "position x", note="NaN where it is unknown"
    )
    assert found.variable("count") == Variable("count", "", "1", "samples", "int")
    assert found.variable("flag").flags == {"film": 0, "file": 1}
    assert not found.variable("flag").bits
    assert found.variable("time") == Variable("time", "time", "s", "time")
    assert found.variable("body") == Variable("body", "body", None, "body", "text")
    assert found.variable("seen").when == "it was tracked"
    assert [one.name for one in found.attributes] == [
        *("source", "sample_rate_Hz", "complete", "more"),
    ]
    assert [one.when for one in found.attributes] == ["", "", "it was tracked", ""]


def test_a_row_with_choices_stands_for_one_row_of_each() -> None:
    found = variables("share_<low|high>(time) [1]: <lower|upper> limit\nseen(time) bool: seen")
    assert [(one.name, one.long_name) for one in found] == [
        ("share_low", "lower limit"),
        ("share_high", "upper limit"),
        ("seen", "seen"),
    ]
    [x, y] = attributes("<x|y>_m number: place")
    assert (x.name, y.name) == ("x_m", "y_m")
    [plain] = attributes("p number: p < 0.05, |r| > 2 and {1} <1>")
    assert plain.meaning == "p < 0.05, |r| > 2 and {1} <1>"
    with pytest.raises(ValueError, match="not as many words"):
        attributes("<x|y>_m number: <first|second|third> place")


def test_bits_may_be_set_together() -> None:
    text = "kind: a\nversion: 1\nvariables:\nstatus(run) bits: problems; 0 is sound"
    [one] = kind(text, flags={"status": {"escaped": 2}}).variables
    assert (one.bits, one.holds, one.note) == (True, "int", "0 is sound")


def test_attributes_are_limited_where_nothing_limits_them_yet() -> None:
    given = attributes("blocks number: blocks\nseed\nattributes (it moves):\n    speed number: v")
    found = list(limited(given, "made from runs", without="seed"))
    assert [(one.name, one.when) for one in found] == [
        ("blocks", "made from runs"),
        ("speed", "it moves"),
    ]


@pytest.mark.parametrize("row", ["x(time", "x (m): words", "an x [m]: words"])
def test_a_row_of_another_form_is_refused(row: str) -> None:
    with pytest.raises(ValueError, match="not a row of a variable"):
        variables(row)
    with pytest.raises(ValueError, match="not a row of an attribute"):
        attributes(row)
