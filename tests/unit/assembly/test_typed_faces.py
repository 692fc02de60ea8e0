"""Typed faces: who latches, what poles refuse, what blocks become, and the errors of the rules."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.assembly import assemble, kind_classes
from driftwalk.assembly.lattice.events import replay_events
from driftwalk.assembly.lattice.joined_faces import FaceTable, face_table
from driftwalk.assembly.outcomes.outcome_classes import _coloured
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.model import Assembly, Study, apply_overrides, parse_study, read_binding

SIDE = 0.03
HOOKS: dict[str, Any] = {
    "kinds": [
        {"name": "A", "count": 2, "faces": ["hook", "none", "none", "none"]},
        {"name": "B", "count": 2, "faces": ["eye", "none", "eye", "none"]},
    ],
    "latches": [["hook", "eye"]],
}
RULES = """\
latches = [["hook", "eye"], ["N", "S"]]
[[kinds]]
name = "A"
count = 2
faces = ["hook", "none", "N", "none"]
[[kinds]]
name = "B"
count = 2
faces = ["eye", "none", "S", "none"]
[[after]]
kind = "A"
face = "+x"
meets = "eye"
becomes = "B"
"""


def shaken(
    *, blocks: int = 4, start: Any = None, duration: float = 20.0, **rules: Any
) -> xr.Dataset:
    """Runs in still water, shaken hard in a narrow tank: all blocks meet."""
    study = Study(
        tank={"diameter_m": 0.15},
        assembly={"blocks": blocks, **rules},
        forces={"force_std_N": 4e-3 if start is None else 0.0},
    )
    still = dw.uniform_flow(0.0, 0.0)
    return assemble(study, still, runs=60, duration=duration, start=start)


def test_four_north_poles_never_assemble() -> None:
    found = shaken(faces="N,N,N,N")
    assert (found["event_count"] == 0).all()
    assert (found["first_contact_time"] >= 0).all()
    assert {str(found["class"].values[k]) for k in found["outcome"].values} == {"1+1+1+1"}


@pytest.mark.parametrize("faces", ["N,S,N,S", "N,N,S,S", "N,S,none,none"])
def test_every_latch_is_of_unlike_poles(faces: str) -> None:
    found = shaken(faces=faces)
    types = np.array(faces.split(","))[found["event_face"].values[found["event_time"].notnull()]]
    assert len(types) > 60
    assert (np.sort(types, axis=1) == ["N", "S"]).all()


@pytest.mark.parametrize(
    ("turns", "latches"),
    # Which faces meet: the first block's +x turned by -turn, the second's -x likewise.
    [((0, 0), False), ((0, 1), True), ((1, 0), True), ((0, 2), False), ((3, 3), False)],
)
def test_a_quarter_turn_decides(turns: tuple[int, int], latches: bool) -> None:
    rules: dict[str, Any] = {"latching": "connector", "faces": "N,S,N,S"}
    start = [[k * (SIDE + 1e-4), 0.0, turn * np.pi / 2] for k, turn in enumerate(turns)]
    found = shaken(blocks=2, start=start, duration=0.01, **rules)
    assert (found["event_count"] == int(latches)).all()


def test_squares_of_magnets_alternate() -> None:
    """With N S N S every pair of neighbours is unlike: blocks alternate by a quarter turn."""
    found = shaken(faces="N,S,N,S")
    whole = np.flatnonzero(found["event_count"] == 3)
    assert len(whole) > 20
    for run in whole:
        quarter, cell = found["quarter"].values[run], found["cell"].values[run]
        assert len(set(((quarter + cell.sum(axis=1)) % 2).tolist())) == 1


@pytest.mark.parametrize(("pole", "events"), [("N", 2), ("S", 3), ("none", 3)])
def test_as_many_like_poles_as_bonds_refuse_a_merge(pole: str, events: int) -> None:
    """Two pairs meet by hook and eye, and N meets a pole next to it."""
    faces = [["hook", "v", "none", "none"], ["N", "none", "none", "w"]]
    faces += [["none", "v", "eye", "none"], ["none", "none", pole, "w"]]
    kinds = [{"name": f"K{k}", "count": 1, "faces": row} for k, row in enumerate(faces)]
    latches = [["hook", "eye"], ["v", "w"], *([["N", "S"]] if pole == "S" else [])]
    x, y = SIDE + 3e-3, SIDE + 1e-4
    found = shaken(
        start=[[0, 0, 0], [0, y, 0], [x, 0, 0], [x, y, 0]],
        duration=0.01,
        latching="connector",
        binding={"kinds": kinds, "latches": latches},
    )
    assert (found["event_count"] == events).all()


def test_kinds_are_counted_and_latch_by_the_matrix() -> None:
    found = shaken(binding=HOOKS)
    own = found["event_time"].notnull().values
    blocks, faces = found["event_block"].values[own], found["event_face"].values[own]
    assert ((blocks < 2).sum(axis=1) == 1).all()
    assert (faces[blocks < 2] == 0).all()
    assert np.isin(faces[blocks >= 2], [0, 2]).all()
    assert found.attrs["faces"].startswith(
        "2 A (hook,none,none,none), 2 B (eye,none,eye,none); hook"
    )
    assert {str(found["class"].values[k]) for k in found["outcome"].values} <= {
        *("I3+1", "2+2", "2+1+1", "1+1+1+1")
    }


def test_a_grammar_stops_the_growth() -> None:
    """Every face latches until a block has latched once: pairs, and nothing larger."""
    kinds = [
        {"name": "free", "count": 4, "faces": ["x"] * 4},
        {"name": "bound", "faces": ["none"] * 4},
    ]
    after = [
        {"kind": "free", "face": face, "becomes": "bound"} for face in ("+x", "+y", "-x", "-y")
    ]
    found = shaken(binding={"kinds": kinds, "latches": [["x", "x"]], "after": after})
    names = [str(found["class"].values[k]) for k in found["outcome"].values]
    assert set(names) <= {"2+2", "2+1+1", "1+1+1+1"}
    assert names.count("2+2") > 40


def test_a_rule_for_one_type_wins_over_one_for_any() -> None:
    rules = {
        "kinds": [{"name": name, "count": 1, "faces": ["x", "y", "x", "y"]} for name in "ABC"],
        "latches": [["x", "y"]],
        "after": [
            {"kind": "A", "face": "+y", "meets": "x", "becomes": "B"},
            {"kind": "A", "face": "+y", "becomes": "C"},
        ],
    }
    table = face_table(Assembly(blocks=3, binding=rules))
    assert table is not None
    assert table.becomes[0].tolist() == [[0, 0], [1, 2], [0, 0], [0, 0]]
    assert table.first_kinds(5).tolist() == [0, 1, 2, 0, 1]


def replay(table: FaceTable | None, faces: list[int]) -> Any:
    turn = (faces[0] + 2 - faces[1]) % 4
    cell = [(0, 0), [(1, 0), (0, 1), (-1, 0), (0, -1)][faces[0]]]
    return replay_events(
        [1], [[[0, 1]]], [[faces]], cell=[cell], quarter=[[0, turn]], assembly=[[0, 0]], faces=table
    )


def test_the_replay_refuses_faces_that_do_not_latch() -> None:
    table = face_table(Assembly(faces="N,S,N,S", blocks=2))
    assert replay(table, [0, 1]).outcome.tolist() == replay(None, [0, 1]).outcome.tolist()
    with pytest.raises(
        InputError, match="run 0, event 0: joins two faces whose types do not latch"
    ):
        replay(table, [0, 2])


def test_a_live_tank_has_the_same_rules() -> None:
    study = Study(
        tank={"diameter_m": 0.15}, forces={"force_std_N": 4e-3}, assembly={"faces": "NNNN"}
    )
    tank = dw.LiveTank(study, dw.uniform_flow(0.0, 0.0))
    tank.advance(5.0)
    assert tank.outcome == "1+1+1+1"
    tank.set(faces="N,S,N,S")
    tank.advance(10.0)
    assert tank.events()
    tank.set(faces="any")
    tank.advance(0.1)
    assert tank.study.assembly.faces == "any"


def test_rules_survive_the_study_file(tmp_path: Path) -> None:
    (tmp_path / "rules.toml").write_text(RULES)
    rules = read_binding(tmp_path / "rules.toml")
    study = apply_overrides(Study(), {"assembly.binding": rules})
    assert parse_study(study.to_toml()) == study
    assert study.assembly.typed_faces == rules
    assert parse_study('[assembly]\nfaces = ["N", "S", "-", "none"]').assembly.faces == (
        "N,S,none,none"
    )
    assert apply_overrides(study, {"assembly.faces": "NSNS"}).assembly.binding is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"eye", "none", "S"', '"eye"', ", line 7, column 9: [kinds] 'B' has 2 faces"),
        ('becomes = "B"', 'becomes = "D"', ", line 14, column 12: [binding] there is no kind 'D'"),
        (
            '["hook", "eye"]',
            '["hok", "eye"]',
            ", line 1, column 14: [binding] no face has the type",
        ),
        ("count = 2", "coutn = 2", ", line 4, column 1: [kinds] unknown key 'coutn'; did you mean"),
        (
            'meets = "eye"',
            'meets = "x"',
            ", line 13, column 10: [binding] no face has the type 'x'",
        ),
        ('["hook", "eye"], ', "", ", line 5, column 11: [binding] faces of the type 'hook' latch"),
        ('["hook", "eye"]', '["hook"]', ": [binding] latches: expected pairs of types"),
        ('name = "B"', 'name = "A"', "the kind 'A' stands twice"),
        (
            "[[after]]",
            '[[after]]\nkind="A"\nface="+x"\nmeets="eye"\nbecomes="B"\n[[after]]',
            "two r",
        ),
        ("count = 2", "", "[binding] kinds: no block at the start"),
        ('"+x"', '"+z"', ", line 12, column 9: [after] face must be"),
        ("[[after]]", "[after", "not a TOML file"),
    ],
)
def test_what_is_wrong_in_a_file_of_rules(old: str, new: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "rules.toml"
    changed = RULES.replace(old, new, 1 if old != "count = 2" or new else 2)
    path.write_text(changed)
    with pytest.raises(ConfigurationError) as caught:
        read_binding(path)
    assert str(caught.value).startswith(str(path))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"faces": "N,S,N"}, "such as N,S,N,S; got 'N,S,N'"),
        ({"faces": "N,S,N,x"}, "a face is N, S or none, got 'x'"),
        ({"faces": "N,S,N,S", "binding": HOOKS}, "both say which faces latch"),
    ],
)
def test_what_is_wrong_in_a_study(values: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        Study(assembly=values)
    assert words in str(caught.value)


def test_kinds_count_the_blocks_of_runs_and_repeat_in_a_live_tank() -> None:
    study, still = Study(assembly={"binding": HOOKS}), dw.uniform_flow(0.0, 0.0)
    with pytest.raises(InputError, match="the kinds count 4 blocks, and there are 5"):
        assemble(study, still, blocks=5, runs=1, duration=0.1)
    tank = dw.LiveTank(study, still)
    tank.set(blocks=7)
    tank.advance(1.0)
    tank.set(blocks=3)
    tank.restart()
    assert tank.blocks == 3
    tank.set(blocks=6)
    tank.advance(1.0)
    kinds = tank._world.state()["kind"].tolist()
    assert kinds == [0, 0, 1, 1, 0, 0]


def test_discs_have_no_faces() -> None:
    study = Study(block={"shape": "disc"}, assembly={"faces": "NSNS"})
    with pytest.raises(InputError, match="discs have no faces"):
        assemble(study, dw.uniform_flow(0.0, 0.0), runs=1, duration=0.1)


def test_classes_with_kinds() -> None:
    """Two A latch to nobody but one B each: which of the drawn cells are of which kind."""
    found = shaken(binding=HOOKS)
    counted = kind_classes(found)
    assert sum(counted.values()) == 60
    assert set(counted) <= {
        *("I3:ABA+1:B", "2:AB+2:AB", "2:AB+1:A+1:B", "1:A+1:A+1:B+1:B"),
    }
    assert counted["2:AB+2:AB"] > 5
    assert list(counted.values()) == sorted(counted.values(), reverse=True)
    plain = Counter(str(found["class"].values[k]) for k in found["outcome"].values)
    shapes = Counter[str]()
    for name, runs in counted.items():
        shapes["+".join(part.partition(":")[0] for part in name.split("+"))] += runs
    assert shapes == plain
    with pytest.raises(InputError, match="all of one kind"):
        kind_classes(shaken(faces="NSNS"))


@pytest.mark.parametrize(
    ("cells", "kinds", "name"),
    [
        ([(0, 0), (1, 0), (2, 0), (1, -1)], "ABAC", "T:ABAC"),
        ([(0, 0), (0, 1), (0, 2), (1, 1)], "ABCD", "T:ABCD"),
        ([(0, 0), (1, 0), (1, 1), (0, 1)], "ABBA", "O:AABB"),
        ([(5, 5), (5, 6)], "BA", "2:AB"),
    ],
)
def test_kinds_are_read_as_the_shape_is_drawn(
    cells: list[tuple[int, int]], kinds: str, name: str
) -> None:
    assert _coloured(tuple(cells), tuple(kinds), "merged") == name


@pytest.mark.slow
def test_many_blocks_have_types_and_start_glued() -> None:
    """Forty blocks: those of one world lie side by side in the lanes of the kernel."""
    flow = dw.jets_flow(diameter=0.6, jet_speed=0.15, inclination=0.4, swirl_speed=0.03)
    study = Study(tank={"diameter_m": 0.6}, forces={"force_std_N": 2e-3}, assembly={"blocks": 40})

    def run(**rules: Any) -> xr.Dataset:
        changed = apply_overrides(study, {f"assembly.{key}": value for key, value in rules.items()})
        return assemble(changed, flow, runs=2, duration=3.0)

    assert (run(faces="NNNN")["event_count"] == 0).all()
    found = run(faces="NSNS")
    types = np.array([0, 1, 0, 1])[found["event_face"].values[found["event_time"].notnull()]]
    assert len(types) > 20
    assert (types.sum(axis=1) == 1).all()
    glued = run(glued="xx")
    assert ((glued["event_time"] == 0.0).sum("event") == 20).all()
    assert (glued["event_count"] > 20).all()


def test_only_faces_that_latch_are_bonded() -> None:
    # Faces without a magnet lie next to others in an assembly, and no bond holds them.
    found = shaken(faces="N,S,none,none", bond_rate_per_s=0.3)
    kind, face = found["event_kind"].values, found["event_face"].values
    bonded = face[np.isin(kind, [0, 1, 2, 3])]
    assert {int(k) for k in kind[kind >= 0]} >= {0, 1}
    poles = np.array([1, -1, 0, 0])[bonded]
    assert (np.sort(poles, axis=1) == [-1, 1]).all()
