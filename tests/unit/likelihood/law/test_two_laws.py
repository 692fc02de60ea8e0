"""Which of two laws is taken, and when the other one is looked at, with searches that are made up.

The mode of a law has a stated evidence here, and the score tests stated estimates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law import search
from driftwalk.likelihood.law.force_law import FLOATING
from driftwalk.likelihood.law.forward_selection import LawResult
from driftwalk.likelihood.law.score_tests import ScoreTests
from driftwalk.likelihood.law.search import LAW, LawSearch, evidence_of
from driftwalk.likelihood.newton import FROM_ANOTHER, FROM_NEAR, Mode
from driftwalk.likelihood.prior import Weights
from driftwalk.likelihood.start import Starts
from driftwalk.schema.answers.force_law import FORWARD_SELECTION

LEAST = FORWARD_SELECTION.least_evidence
WEIGHTS = Weights(1.0, 1.0)
PLAIN = Point(np.zeros((2, 1, 1)), -0.7, -9.0, -8.0, math.log(1e-5), math.log(0.01))
STARTS = Starts(PLAIN, (replace(PLAIN, fixed=dict(FLOATING)),))


def mode_at(point: Point, evidence: float, *, converged: bool = True, std: float = 0.1) -> Mode:
    """Return a mode whose evidence stands in place of its deviance."""
    covariance = np.diag(np.full(point.coefficients.size + 1 + len(point.extras), std**2))
    return Mode(point, WEIGHTS, covariance, 100, 5, converged, evidence)


def is_floating(point: Point) -> bool:
    return point.number("water_acceleration") == 1.0


class Laws:
    """A search over laws whose modes have these evidences; None where a law has no solution."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        paper: float | None,
        floating: float | None,
        *,
        sigmas: Mapping[str, float] | None = None,
        orientation: str = "state",
        whole: bool = True,
    ) -> None:
        self.evidence = {False: paper, True: floating}
        self.calls: list[tuple[str, Point, Any]] = []
        series = [SimpleNamespace(x=np.linspace(-0.1, 0.1, 50), y=np.zeros(50))]
        body = SimpleNamespace(orientation=orientation, side=0.03)
        passes = SimpleNamespace(series=series, flows=1, body=body)
        found: Any = SimpleNamespace(passes=passes, prior=None)
        found.find = lambda point, weights, *, held=None: self.mode("whole", point, held)
        found.find_from_afar = lambda point, weights: self.mode("from afar", point, None)
        begin = SimpleNamespace(
            find=lambda point, weights, *, held=None: self.mode("begin", point, held)
        )
        begin.shortened = lambda: begin
        found.of = lambda some: begin
        monkeypatch.setattr(search, "evidence_of", lambda mode, _: mode.deviance)
        first = series if whole else list(series)
        monkeypatch.setattr(search, "beginning", lambda _: first)
        tests = None if sigmas is None else trial_of(sigmas)
        monkeypatch.setattr(search, "score_tests", lambda *_: tests)
        self.search = object.__new__(LawSearch)
        self.search.search = found
        self.assume("auto")
        self.search.selection = SimpleNamespace(
            select=lambda found: replace(found, noted=("chosen",))
        )  # type: ignore[assignment]

    def assume(self, gradient: str, *, tried: Sequence[str] = ()) -> None:
        self.search.assumptions = SimpleNamespace(  # type: ignore[assignment]
            pressure_gradient=gradient, opened={}, fixed={}, tried=tuple(tried)
        )

    def mode(self, where: str, point: Point, held: Any) -> Mode | None:
        self.calls.append((where, point, held))
        evidence = self.evidence[is_floating(point)]
        return None if evidence is None else mode_at(point, evidence, std=0.05)


def trial_of(sigmas: Mapping[str, float]) -> ScoreTests:
    """Return independent score tests with standard deviations of 1."""
    values = np.array(list(sigmas.values()))
    return ScoreTests(tuple(sigmas), values, np.ones(values.size), np.eye(values.size), values)


def test_the_evidence_is_the_integral_over_all_that_is_estimated() -> None:
    """Of a normal law of one coefficient and an opened number, against a sum over a grid.

    The opened number has a normal prior, the coefficient one whose precision is 3. What is known of
    both has the precision of their squares. The constant of the normal law of each cancels.
    """
    name, std = "linear_share", 1.0
    assert search.NUMBERS[name].prior_std == std
    centre, known = np.array([0.4, 0.2]), np.array([[5.0, 1.5], [1.5, 4.0]])
    own = np.diag([3.0, 1.0 / std**2])

    def deviance(at: np.ndarray) -> np.ndarray:
        """Return minus the logarithm of the density at points, shape (2, ...)."""
        off = at - centre.reshape(2, *np.ones(at.ndim - 1, dtype=int))
        return 0.5 * sum(
            np.einsum("a...,ab,b...", one, form, one) for one, form in ((off, known), (at, own))
        )

    best = np.linalg.solve(known + own, known @ centre)
    point = replace(PLAIN, coefficients=np.array([[[best[0]]]]), opened={name: best[1]})
    prior: Any = SimpleNamespace(
        roughness=np.eye(1),
        log_scale=lambda *_: 0.0,
        log_determinant=lambda _, components: components * math.log(3.0),
    )
    mode = Mode(point, WEIGHTS, np.linalg.inv(known + own), 1, 1, True, float(deviance(best)))
    axis = np.linspace(-3.0, 3.0, 301)
    grid = deviance(np.stack(np.meshgrid(axis, axis)))
    cell = (axis[1] - axis[0]) ** 2
    constant = 2.0 * math.pi / (math.sqrt(3.0) / std)
    wanted = math.log(float(np.exp(-grid).sum()) * cell / constant)
    assert evidence_of(mode, prior) == pytest.approx(wanted, abs=1e-6)
    prior.log_scale = lambda *_: 2.5
    assert evidence_of(mode, prior) == pytest.approx(wanted + 2.5, abs=1e-6)


@pytest.mark.parametrize(
    ("paper", "floating", "taken"),
    [
        (10.0, 10.0 + LEAST, True),
        (10.0, 9.9 + LEAST, False),
        (10.0, 4.0, False),
        (None, 4.0, True),
        (10.0, None, False),
    ],
)
def test_another_law_takes_more_evidence(
    monkeypatch: pytest.MonkeyPatch, paper: float | None, floating: float | None, taken: bool
) -> None:
    laws = Laws(monkeypatch, paper, floating)
    known = None if paper is None else mode_at(PLAIN, paper)
    found = laws.search._compared(STARTS, WEIGHTS, known)
    assert found.floating is taken
    assert is_floating(found.mode.point) is taken
    ahead = (-math.inf if floating is None else floating) - (-math.inf if paper is None else paper)
    assert found.settled_by == (ahead if taken else -ahead)
    wanted = {"paper": paper, "floating": floating}
    assert found.evidence == {name: one for name, one in wanted.items() if one is not None}
    assert found.base is found.mode
    if not taken:
        assert found.mode is known
    # The whole recording was searched already.
    assert {where for where, *_ in laws.calls} == {"begin"}


def test_without_a_solution_under_any_law_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(np.linalg.LinAlgError, match="no law has a solution"):
        Laws(monkeypatch, None, None).search._compared(STARTS, WEIGHTS, None)


@pytest.mark.parametrize(("whole", "held"), [(True, FROM_NEAR), (False, FROM_ANOTHER)])
def test_a_law_of_the_beginning_is_searched_on_all_samples(
    monkeypatch: pytest.MonkeyPatch, whole: bool, held: Any
) -> None:
    laws = Laws(monkeypatch, 10.0, 40.0, whole=whole)
    found = laws.search._compared(STARTS, WEIGHTS, mode_at(PLAIN, 10.0))
    assert found.floating
    again = [(is_floating(point), how) for where, point, how in laws.calls if where == "whole"]
    assert again == ([] if whole else [(True, held)])
    # Where the search of all under the paper's law broke down, it begins again from the beginning.
    laws = Laws(monkeypatch, 10.0, 4.0, whole=whole)
    found = laws.search._compared(STARTS, WEIGHTS, None)
    again = [(is_floating(point), how) for where, point, how in laws.calls if where == "whole"]
    assert again == [(False, held)]
    assert not found.floating


def test_a_first_law_that_is_beyond_doubt_is_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """How far its score tests are from the other law's numbers says by how much it is settled.

    Half of the chi squared of two independent numbers, 1 of each law apart.
    """
    laws = Laws(monkeypatch, 10.0, 4.0)
    for place, settled in ((0.0, 1.0), (0.4, 0.2), (0.7, 0.0), (-1.0, math.inf)):
        tests = trial_of(dict.fromkeys(FLOATING, place))
        found = laws.search._undoubted(mode_at(PLAIN, 10.0), tests)
        assert found.settled_by == pytest.approx(settled)
        assert found.tests is tests
        assert not found.floating
        assert found.evidence == {"paper": 10.0}


@pytest.mark.parametrize(
    ("sigmas", "doubted"),
    [
        ({"water_acceleration": 4.0, "water_spin": 3.7}, False),
        ({"water_acceleration": 4.0, "water_spin": 3.8}, True),  # 16 + 14.4 > 30
        ({"linear_share": 2.9}, False),
        ({"linear_share": 3.1}, True),
        ({"linear_share": -5.9}, False),
        ({"drag_power": -3.1}, True),
        ({"drag_power": 5.9}, False),
        ({"marker_x": -6.1}, True),
        ({"marker_x": 5.9}, False),
    ],
)
def test_score_tests_cast_doubt_on_the_first_law(
    monkeypatch: pytest.MonkeyPatch, sigmas: dict[str, float], doubted: bool
) -> None:
    laws = Laws(monkeypatch, 10.0, 4.0)
    tests = trial_of({**dict.fromkeys(FLOATING, 0.0), **sigmas})
    assert laws.search._is_doubted(tests, mode_at(PLAIN, 10.0)) is doubted


def test_a_body_without_orientation_is_tested_for_one_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    laws = Laws(monkeypatch, 10.0, 4.0, orientation="none")
    tests = trial_of({"water_acceleration": 0.0, "water_spin": 99.0, "marker_x": 0.0})
    assert not laws.search._is_doubted(tests, mode_at(PLAIN, 10.0))
    assert laws.search._is_doubted(trial_of({"water_acceleration": 5.5}), mode_at(PLAIN, 10.0))


@pytest.mark.parametrize(("sides", "notable"), [(0.0058, False), (0.0060, True)])
def test_a_force_that_turns_the_body_casts_doubt(
    monkeypatch: pytest.MonkeyPatch, sides: float, notable: bool
) -> None:
    """A lever above a two-hundredth of a side by 1.64 standard deviations of 0.1."""
    laws = Laws(monkeypatch, 10.0, 4.0)
    mode = mode_at(replace(PLAIN, log_lever=math.log(0.03 * sides)), 10.0)
    assert math.exp(-0.164) * 0.0058 < 0.005 < math.exp(-0.164) * 0.0060
    assert laws.search._turns_by_itself(mode) is notable
    none = mode_at(replace(PLAIN, log_lever=None, log_angle_noise=None), 10.0)
    assert not laws.search._turns_by_itself(none)


@pytest.mark.parametrize(
    ("gradient", "sigmas", "floating", "compared"),
    [
        ("on", None, True, False),
        ("off", None, False, False),
        ("auto", {"water_acceleration": 0.1, "water_spin": 0.0}, False, False),
        ("auto", {"water_acceleration": 9.0, "water_spin": 0.0}, True, True),
        ("auto", None, True, True),
    ],
)
def test_a_law_that_is_stated_is_not_looked_for(
    monkeypatch: pytest.MonkeyPatch,
    gradient: str,
    sigmas: dict[str, float] | None,
    floating: bool,
    compared: bool,
) -> None:
    laws = Laws(monkeypatch, 10.0, 40.0, sigmas=sigmas)
    laws.assume(gradient)
    found = laws.search._base(STARTS, WEIGHTS)
    assert found.floating is floating
    assert any(where == "begin" for where, *_ in laws.calls) is compared
    stated = gradient != "auto"
    assert found.settled_by == (math.inf if stated else 30.0 if compared else pytest.approx(0.9))


def opened(value: float = 0.2, **more: float) -> Point:
    return replace(PLAIN, opened={"marker_x": value, **more})


def turning(evidence: float) -> LawResult:
    """Return a law without departures, of which something turns the block."""
    mode = mode_at(replace(PLAIN, log_lever=math.log(3e-4)), evidence)
    return LawResult(mode, mode, False, {}, 5.0, None)


@pytest.mark.parametrize(
    ("settled_by", "sigmas", "other", "turned"),
    [
        (10.0, None, 10.1 + LEAST, True),
        (10.0, None, 9.9 + LEAST, False),
        (10.0, None, None, False),
        (LAW.decisive_evidence + 1.0, None, 60.0, False),
        (LAW.decisive_evidence + 1.0, 1.0, 60.0, False),
        (LAW.decisive_evidence + 1.0, 4.0, 60.0, True),
        (LAW.decisive_evidence, 1.0, 60.0, True),
        (LAW.decisive_evidence - 1.0, 1.0, 60.0, True),
    ],
)
@pytest.mark.parametrize("floating", [True, False])
def test_with_departures_the_laws_are_compared_once_more(
    monkeypatch: pytest.MonkeyPatch,
    settled_by: float,
    sigmas: float | None,
    other: float | None,
    turned: bool,
    floating: bool,
) -> None:
    """Where it was decisive, the score tests have to object."""
    tests = None if sigmas is None else dict.fromkeys(FLOATING, sigmas)
    pair = (other, 10.0) if floating else (10.0, other)
    laws = Laws(monkeypatch, *pair, sigmas=tests)
    own = replace(opened(), fixed=dict(FLOATING) if floating else {"hidden_share": 0.5})
    before = LawResult(mode_at(own, 10.0), mode_at(own, 10.0), floating, {}, settled_by, None)
    found = laws.search._reconsidered(before, STARTS)
    if not turned:
        assert found is before
        return
    assert other is not None
    assert found.floating is not floating
    assert found.settled_by == pytest.approx(other - 10.0)
    names = ("paper", "floating") if floating else ("floating", "paper")
    assert found.evidence == {names[0]: other, names[1]: 10.0}
    # The other law has the same numbers opened, and departures are looked for again.
    assert found.mode.point.opened == own.opened
    assert is_floating(found.mode.point) is not floating
    assert found.mode.point.number("hidden_share") == own.number("hidden_share")
    assert found.noted == ("chosen",)


@pytest.mark.parametrize(("gradient", "numbers"), [("auto", {}), ("on", {"marker_x": 0.1})])
def test_what_is_unchanged_or_stated_is_not_compared_again(
    monkeypatch: pytest.MonkeyPatch, gradient: str, numbers: dict[str, float]
) -> None:
    laws = Laws(monkeypatch, 10.0, 99.0)
    laws.assume(gradient)
    mode = mode_at(replace(PLAIN, opened=numbers), 10.0)
    before = LawResult(mode, mode, False, {}, 1.0, None)
    assert laws.search._reconsidered(before, STARTS) is before
    assert laws.calls == []


@pytest.mark.parametrize(
    ("base", "found", "power", "taken"),
    [
        (10.0, 10.0, 10.1 + LEAST, True),
        (10.0, 10.0, 10.0 + LEAST, False),
        (10.0, 20.0, 22.9, False),
        (10.0, 20.0, 23.1, True),
        (20.0, 10.0, 22.9, False),
        (20.0, 10.0, 23.1, True),
    ],
)
def test_a_power_of_the_drag_is_taken_where_it_is_ahead_of_both(
    monkeypatch: pytest.MonkeyPatch, base: float, found: float, power: float, taken: bool
) -> None:
    """Of the plain law, and of the law with the departures that were found."""
    laws = Laws(monkeypatch, power, power)
    laws.assume("auto", tried=["drag_power"])
    laws.search.selection.least = {}
    first, mode = turning(base), mode_at(opened(), found)
    second = LawResult(mode, mode, False, {}, 5.0, None)
    result = laws.search._powered(second, first, STARTS, WEIGHTS)
    assert (result is not second) is taken
    (call,) = laws.calls
    assert call[1].opened == {"drag_power": 1.7}
    if taken:
        assert result.mode.deviance == power
        assert result.noted == ("chosen",)


@pytest.mark.parametrize(("tried", "turns"), [(["marker_x"], True), (["drag_power"], False)])
def test_no_power_of_the_drag_is_looked_for_where_it_is_stated_or_nothing_turns(
    monkeypatch: pytest.MonkeyPatch, tried: list[str], turns: bool
) -> None:
    laws = Laws(monkeypatch, 99.0, 99.0)
    laws.assume("auto", tried=tried)
    mode = mode_at(PLAIN, 10.0)
    base = turning(10.0) if turns else LawResult(mode, mode, False, {}, 5.0, None)
    found = replace(base, mode=mode_at(opened(), 10.0))
    assert laws.search._powered(found, base, STARTS, WEIGHTS) is found
    assert laws.calls == []


def test_a_power_that_is_near_two_is_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Retained is what is three standard deviations of 0.1 from 2."""
    laws = Laws(monkeypatch, 50.0, 50.0)
    laws.assume("auto", tried=["drag_power"])
    laws.search.selection.least = {}
    base = turning(10.0)
    for value, there in ((1.69, True), (1.71, False), (2.29, False), (2.31, True)):
        near = replace(PLAIN, opened={"drag_power": value})
        laws.search.search.find_from_afar = lambda point, _, near=near: mode_at(near, 50.0)  # type: ignore[method-assign]
        assert (laws.search._powered(base, base, STARTS, WEIGHTS) is not base) is there
    laws.search.search.find_from_afar = lambda *_: mode_at(opened(), 50.0, converged=False)  # type: ignore[method-assign]
    assert laws.search._powered(base, base, STARTS, WEIGHTS) is base


@pytest.mark.parametrize(
    ("sigmas", "change", "said"),
    [
        (3.9, 0.0, ""),
        (4.1, 0.09, "noted"),
        (-4.1, -0.09, "noted"),
        (4.1, 0.11, "larger"),
        (4.1, -0.11, "smaller"),
    ],
)
def test_a_slight_power_of_the_drag_widens_the_intervals(
    monkeypatch: pytest.MonkeyPatch, sigmas: float, change: float, said: str
) -> None:
    """The verdict is left open where C_d is a tenth off with it."""
    laws = Laws(monkeypatch, 10.0, 10.0)
    laws.assume("auto", tried=["drag_power"])
    asked: list[float] = []

    def with_number(mode: Mode, name: str, value: float) -> Mode:
        asked.append(value)
        near = replace(mode.point, log_drag=mode.point.log_drag + change, opened={name: value})
        return mode_at(near, 12.0)

    laws.search.selection.opened = with_number  # type: ignore[method-assign]
    mode = mode_at(PLAIN, 10.0)
    tests = ScoreTests(
        ("drag_power",), np.array([0.1]), np.array([0.1 / sigmas]), np.eye(1), np.ones(1)
    )
    before = LawResult(mode, mode, False, {}, 5.0, tests)
    found = laws.search._with_slight_power(before)
    if not said:
        assert found is before
        return
    assert asked == [pytest.approx(2.1)]
    assert len(found.alternatives) == 1
    assert found.mode is mode
    if said == "noted":
        assert len(found.noted) == 1
        assert not found.unsettled
        return
    (why,) = found.unsettled
    size = 100.0 * abs(math.expm1(change))
    assert f"with it C_d is {size:.0f} % {said}" in why


def test_a_power_is_not_slight_where_another_shape_was_opened(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    laws = Laws(monkeypatch, 10.0, 10.0, sigmas={"drag_power": 5.0})
    laws.assume("auto", tried=["drag_power"])
    shaped = mode_at(replace(PLAIN, opened={"linear_share": 0.3}), 10.0)
    before = LawResult(shaped, shaped, False, {}, 5.0, trial_of({"drag_power": 9.0}))
    assert laws.search._with_slight_power(before) is before
    plain = mode_at(PLAIN, 10.0)
    unsettled = LawResult(
        plain, plain, False, {}, 5.0, trial_of({"drag_power": 9.0}), unsettled=("why",)
    )
    assert laws.search._with_slight_power(unsettled) is unsettled
    # Closed again after it was opened, it is tested anew.
    slight = mode_at(replace(PLAIN, opened={"drag_power": 2.1}), 10.0)
    laws.search.selection.opened = lambda *_: slight  # type: ignore[method-assign]
    again = LawResult(plain, plain, False, {}, 5.0, trial_of({"marker_x": 0.0}))
    assert laws.search._with_slight_power(again).alternatives == (slight,)


@pytest.mark.parametrize(("left", "closed"), [({}, False), ({"marker_x": "why"}, True)])
def test_numbers_that_something_else_explains_are_closed(
    monkeypatch: pytest.MonkeyPatch, left: dict[str, str], closed: bool
) -> None:
    laws = Laws(monkeypatch, 10.0, 10.0)
    plain, mode = mode_at(PLAIN, 3.0), mode_at(opened(0.2, drag_power=2.4), 10.0)
    laws.search.undisturbed = lambda: []
    asked: list[Any] = []

    def objections(*known: Any) -> dict[str, str]:
        asked.append(known)
        return left

    monkeypatch.setattr(search, "objections_to", objections)
    laws.search.selection.without = lambda *_: None  # type: ignore[method-assign]
    before = LawResult(mode, plain, False, {}, 5.0, None, unsettled=("first",))
    found = laws.search._supported(before)
    # Of the numbers of the law alone.
    assert asked == [(mode, ["drag_power"], laws.search.selection, laws.search.undisturbed)]
    if not closed:
        assert found is before
        return
    # Where the search without them breaks down the law alone is left.
    assert found.mode is plain
    assert found.unsettled == ("first", "why")
    assert found.alternatives == (mode,)


@pytest.mark.parametrize(
    ("ends", "wanted"),
    [
        ([True], 0),
        ([False, True], 1),
        ([None, True], 1),
        ([None, False], 1),
        ([False, None], 0),
        ([None, None], None),
        ([True, True], 0),
    ],
)
def test_the_first_mode_that_has_converged_is_taken(
    ends: list[bool | None], wanted: int | None
) -> None:
    modes = [None if end is None else mode_at(PLAIN, 1.0, converged=end) for end in ends]
    found = search._first_converged(modes)
    assert found is (None if wanted is None else modes[wanted])


Asked = list[tuple[str, float, Any]]


def stub(ends: Callable[[str, Point, Any], bool | None], asked: Asked) -> Any:
    """Return a search that comes to its end, or does not, or breaks down."""

    def find_in(name: str) -> Callable[..., Mode | None]:
        def find(point: Point, weights: Weights, *, held: Any = None) -> Mode | None:
            asked.append((name, point.log_drag, held))
            end = ends(name, point, held)
            return None if end is None else mode_at(point, 1.0, converged=end)

        return find

    short = SimpleNamespace(find=find_in("short"))
    return SimpleNamespace(find=find_in("long"), shortened=lambda: short)


def test_a_law_is_tried_from_other_points_where_the_first_one_fails() -> None:
    points = [replace(PLAIN, log_drag=value) for value in (1.0, 2.0)]
    near = mode_at(replace(PLAIN, log_drag=3.0), 1.0)

    def run(ends: Callable[[str, Point, Any], bool | None]) -> tuple[Mode | None, Asked]:
        asked: Asked = []
        return search._mode_in(stub(ends, asked), points, WEIGHTS, near=near), asked

    found, asked = run(lambda *_: True)
    assert asked == [("short", 1.0, None)]
    assert found is not None
    # All of the points in turn, and then on from where the last one came to.
    found, asked = run(lambda name, point, held: held == FROM_NEAR)
    assert asked == [
        ("short", 1.0, None), ("long", 1.0, None), ("long", 2.0, None), ("long", 3.0, None),
        ("long", 3.0, FROM_NEAR),
    ]  # fmt: skip
    assert found is not None
    assert found.converged
    found, asked = run(lambda name, point, held: name == "long" and point.log_drag == 2.0)
    assert [one[1] for one in asked] == [1.0, 1.0, 2.0]
    assert found is not None
    assert found.point.log_drag == 2.0
    # Where none is reached the first steps have to do.
    found, _ = run(lambda *_: False)
    assert found is not None
    assert found.point.log_drag == 1.0
    assert not found.converged


def test_a_search_that_breaks_down_leaves_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    laws = Laws(monkeypatch, 10.0, 10.0)
    mode = mode_at(PLAIN, 10.0)
    before = LawResult(mode, mode, False, {}, 5.0, None, left_out=("one",))

    def breaks(law: LawResult) -> LawResult:
        assert law is before
        raise np.linalg.LinAlgError

    assert laws.search._try_search(before, "two", breaks).left_out == ("one", "two")
    further = replace(before, floating=True, left_out=())
    found = laws.search._try_search(before, "two", lambda _: further)
    assert found.floating
    assert found.left_out == ("one",)
