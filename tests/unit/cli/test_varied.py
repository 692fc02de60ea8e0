"""Values of ``--vary``: lists and ranges, and the unit that numbers share."""

from __future__ import annotations

import pytest

from driftwalk.cli.assembly import infer_outcomes, yields
from driftwalk.cli.assembly.control import vary_strengths
from driftwalk.cli.assembly.sensitivity import AXES, listed_values
from driftwalk.cli.inputs.varied import read_varied
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import Uncertain, split_uncertain

FORCES = [0.2e-3, 0.55e-3, 1.2e-3]
KEY = AXES["force-std"]


@pytest.mark.parametrize("text", ["0.2,0.55,1.2mN", "0.2mN,0.55,1.2 mN", "200uN,0.55mN,1.2e-3N"])
def test_every_command_reads_the_same_list(text: str) -> None:
    given = [f"force-std={text}"]
    assert vary_strengths(given) == {"force-std": FORCES}
    assert read_varied(given, AXES, listed_values) == {KEY: FORCES}
    assert read_varied(given, AXES, yields._varied) == {KEY: FORCES}


def test_every_command_reads_the_same_range() -> None:
    ends = (0.2e-3, 1.2e-3)
    for name, text in (("force_std", "0.2:1.2mN"), ("force-std", "0.2mN:1.2mN")):
        assert read_varied([f"{name}={text}"], AXES, yields._varied) == {KEY: ends}
    for name in ("sigma_F", "force-std"):
        found = read_varied([f"{name}=0.2:1.2mN"], infer_outcomes.VARIED, infer_outcomes._range)
        assert found == {"force_std": ends}
    steps = ["force-std=0.4:0.6:0.1mN"]
    assert vary_strengths(steps)["force-std"] == [0.4e-3, 0.5e-3, 0.6e-3]
    assert read_varied(steps, AXES, yields._varied) == {KEY: [0.4e-3, 0.5e-3, 0.6e-3]}


def test_words_keep_their_own_form() -> None:
    assert read_varied(
        ["hidden-face-drag=none,0.5,full", "magnets=none;3x3x1mm,1.2T", "flow=a.nc,b.nc"],
        AXES, listed_values,
    ) == {
        AXES["hidden-face-drag"]: ["none", 0.5, "full"],
        AXES["magnets"]: ["none", "3x3x1mm,1.2T"],
        AXES["flow"]: ["a.nc", "b.nc"],
    }  # fmt: skip


@pytest.mark.parametrize(
    "values", ["none,3x3x1mm,1.2T,5x5x2mm,1300mT", "none;3x3x1mm,1.2T; 5x5x2mm,1300mT"]
)
def test_magnets_are_parted_by_commas_or_semicolons(values: str) -> None:
    found = read_varied([f"magnets={values}"], AXES, listed_values)
    assert found == {AXES["magnets"]: ["none", "3x3x1mm,1.2T", "5x5x2mm,1300mT"]}


def test_a_number_without_a_unit_after_one_with_a_unit_is_refused() -> None:
    with pytest.raises(InputError, match=r"force-std=1mN,0\.5: '0\.5' has no unit"):
        vary_strengths(["force-std=1mN,0.5"])
    assert vary_strengths(["force-std=1mN,0"]) == {"force-std": [1e-3, 0.0]}
    with pytest.raises(ConfigurationError, match=r"'0\.2' has no unit"):
        split_uncertain("11.6 g ± 0.2")
    assert split_uncertain("1.6e-2±2e-4 kg") == Uncertain("1.6e-2 kg", "2e-4 kg")
