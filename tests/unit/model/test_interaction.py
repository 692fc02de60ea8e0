"""The section [interaction]: magnets as typed, and what contradicts."""

from __future__ import annotations

import pytest

import driftwalk as dw
from driftwalk.model.interaction import Interaction, Magnet, parse_magnet


@pytest.mark.parametrize(
    ("text", "magnet"),
    [
        ("5x5x2mm,1.3T", Magnet(5e-3, 5e-3, 2e-3, 1.3)),
        ("3 x 3 x 1 mm, 1200mT", Magnet(3e-3, 3e-3, 1e-3, 1.2)),
        ("none", None),
    ],
)
def test_magnets_are_read_as_they_are_typed(text: str, magnet: Magnet | None) -> None:
    found = parse_magnet(text)
    assert found == (None if magnet is None else pytest.approx(magnet))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("5x5mm,1.3T", "such as 5x5x2mm,1.3T"),
        ("5x5x2mm", "such as 5x5x2mm,1.3T"),
        ("5x5x2kg,1.3T", "kg"),
        ("5x5x0mm,1.3T", "above 0"),
        ("5x5x2,1.3T", "write 5x5x2mm"),
    ],
)
def test_what_is_no_magnet_is_refused(text: str, words: str) -> None:
    with pytest.raises(dw.ConfigurationError, match=words):
        Interaction(magnets=text)


def test_magnets_and_a_table_contradict_each_other() -> None:
    with pytest.raises(dw.ConfigurationError, match="not both"):
        Interaction(magnets="5x5x2mm,1.3T", attraction="table.csv")


def test_nothing_is_on_unless_it_is_said() -> None:
    assert not Interaction().is_on
    assert Interaction(capillary="on").is_on
