"""How far a run is: one share over all of its stages, which never goes back."""

from __future__ import annotations

from itertools import pairwise

from driftwalk.core.progress import WHOLE, StagedProgress, share_of_search


def test_stages_that_begin_again_do_not_take_the_whole_back() -> None:
    told: list[tuple[int, int, str]] = []
    staged = StagedProgress(
        lambda *said: told.append(said), {"search": 6.0, "check": 3.0, "figures": 1.0}
    )
    search = staged.stage("search")
    for done in (0, 3, 6, 1, 2, 6):
        search(done, 6, "again" if done == 1 else "")
    staged.begin("check")
    staged.begin("figures")
    assert [one[0] for one in told] == [0, 300, 600, 600, 600, 600, 600, 900]
    assert {one[1] for one in told} == {WHOLE}
    assert [told[k][2] for k in (0, 3, 6, 7)] == ["search", "again", "check", "figures"]


def test_a_stage_inside_a_stage_fills_its_part_alone() -> None:
    told: list[int] = []
    outer = StagedProgress(lambda done, *_: told.append(done), {"fit": 1.0, "check": 1.0})
    inner = StagedProgress(outer.stage("fit"), {"likelihood": 3.0, "drag": 1.0})
    inner.begin("likelihood")
    inner.begin("drag")
    inner.stage("drag")(1, 1)
    assert told == [0, 375, 500]


def test_a_stage_of_no_known_work_is_done() -> None:
    told: list[int] = []
    StagedProgress(lambda done, *_: told.append(done), {"runs": 1.0}).stage("runs")(0, 0)
    assert told == [WHOLE]


def test_a_search_of_unknown_length_never_ends_before_it_ends() -> None:
    shares = [share_of_search(0.01 * k) for k in range(1000)]
    assert all(one <= after < 1.0 for one, after in pairwise(shares))
    assert share_of_search(0.5) == 0.5
