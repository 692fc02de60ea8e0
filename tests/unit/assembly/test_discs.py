"""Discs in runs of self-assembly: classes, datasets, what is refused, the live tank."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.assembly import (
    LiveTank,
    assemble,
    assembly_path,
    assembly_sizes,
    class_shapes,
    class_times,
    merge_chirality,
    outcome_distribution,
    sort_classes,
)
from driftwalk.assembly.outcomes.outcome_classes import BODY_CONTACT, disc_class
from driftwalk.core.errors import InputError
from driftwalk.plot.parts.outcome_classes import class_cells, disc_places
from driftwalk.schema.shapes import contacts_of

DIAMETER = 0.04


def study(**assembly: Any) -> dw.Study:
    tank = assembly.pop("tank", {"diameter_m": 0.3})
    return dw.Study(
        block={"shape": "disc", "side_m": DIAMETER, "mass_kg": 0.024}, tank=tank, assembly=assembly
    )


@pytest.mark.parametrize(("gap", "name"), [(0.9, "triangle"), (1.1, "chain3")])
def test_a_third_disc_within_the_gap_is_a_contact(gap: float, name: str) -> None:
    side = DIAMETER * (1 + gap * BODY_CONTACT.gap)
    height = np.sqrt(DIAMETER**2 - (side / 2) ** 2)
    places = np.array([(0.0, 0.0), (side, 0.0), (side / 2, height)])
    assert disc_class(places, [0, 0, 0], diameter=DIAMETER) == name
    # Of two assemblies nothing is a contact, however near they are.
    assert disc_class(places, [0, 0, 2], diameter=DIAMETER).endswith("+1")


def test_classes_of_discs_are_sorted_and_read_as_others_are() -> None:
    names = ["1+1+1+1", "paw", "chain3+1", "star4", "2+2", "chain4", "triangle+1"]
    ordered = ("chain4", "star4", "paw", "chain3+1", "triangle+1", "2+2", "1+1+1+1")
    assert sort_classes(names) == ordered
    assert class_shapes("triangle+1") == ("triangle", "1")
    assert merge_chirality("chain3+1") == "chain3+1"
    assert outcome_distribution({"chain4": 3, "2+2": 1}).attrs["complete"] == 0.75


@pytest.mark.slow
@pytest.mark.parametrize("latching", ["collision", "none"])
@pytest.mark.parametrize(
    "tank", [{"diameter_m": 0.3}, {"shape": "rectangle", "width_m": 0.2, "height_m": 0.18}]
)
def test_discs_stay_inside_and_apart(tank: dict[str, Any], latching: str) -> None:
    case = study(tank=tank, latching=latching, blocks=10)
    flow = dw.tank30_flow()
    path = assembly_path(case, flow, runs=range(6), duration=40.0, sample_interval=0.2)
    x, y, label = (path[name].values for name in ("x", "y", "assembly"))
    if "diameter_m" in tank:
        beyond = np.hypot(x, y) - (0.15 - DIAMETER / 2)
    else:
        beyond = np.maximum(np.abs(x) - 0.08, np.abs(y) - 0.07)
    assert beyond.max() < 2e-4
    first, second = np.triu_indices(10, 1)
    apart = np.hypot(x[..., first] - x[..., second], y[..., first] - y[..., second])
    together = label[..., first] == label[..., second]
    assert together.any() == (latching == "collision")
    assert (DIAMETER - apart[~together]).max() < 1.1e-4
    # Within an assembly two may have been hit in one step.
    assert (DIAMETER - apart[together]).max(initial=0.0) < 1e-3


def test_a_run_of_discs_has_no_faces_and_no_lattice() -> None:
    runs = assemble(study(blocks=3), dw.tank30_flow(), runs=20, duration=60.0)
    assert runs.attrs["block_shape"] == "disc"
    assert runs.attrs["hidden_face_drag"] == "full"
    assert not {"event_face", "cell", "quarter"} & set(runs.variables)
    names = runs["class"].values[runs["outcome"].values]
    last = [
        disc_class(np.stack(places, axis=1), labels, diameter=DIAMETER)
        for *places, labels in zip(*(runs[n].values for n in ("x", "y", "assembly")), strict=True)
    ]
    assert names.tolist() == last
    assert assembly_sizes(runs).attrs["compactness_runs"] == 0
    assert class_times(runs)["proportion"].sum("class").values == pytest.approx(1.0)
    hidden = assemble(
        study(blocks=3, hidden_face_drag="full"), dw.tank30_flow(), runs=20, duration=60.0
    )
    assert np.array_equal(hidden["x"].values, runs["x"].values)


def test_of_many_discs_the_class_has_two_counts() -> None:
    rows = DIAMETER * np.array([(k % 4, k // 4) for k in range(10)])
    assert disc_class(rows, [0] * 10, diameter=DIAMETER) == "10 discs, 13 contacts"


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"latching": "connector"}, "connectors latch face to face, and discs have no faces"),
        ({"blocks": 100}, "100 blocks of 0.04 m do not fit"),
    ],
)
def test_what_discs_cannot_do_is_refused(more: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        assemble(study(**more), dw.tank30_flow(), runs=1)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ([(0.0, 0.0, 0.0), (0.039, 0.0, 0.0)], "overlap by 0.001 m"),
        ([(0.0, 0.0, 0.0), (0.1301, 0.0, 0.0)], "0.0001 m beyond the wall"),
    ],
)
def test_discs_start_apart_and_inside(start: list[Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        assemble(study(blocks=2), dw.tank30_flow(), runs=1, start=start)
    poses = [(0.0, 0.0, 0.0), (0.0284, 0.0284, 0.0)]
    assemble(study(blocks=2), dw.tank30_flow(), runs=1, start=poses, duration=0.1)


def test_glued_blocks_do_not_assemble_as_one_body() -> None:
    with pytest.raises(InputError, match="squares, discs and rectangles assemble, and the body"):
        assemble(dw.Study(block={"shape": "xx"}), dw.tank30_flow(), runs=1)


def test_discs_of_a_live_tank_latch_part_and_lose_members() -> None:
    start = [(-0.0401, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0401, 0.0, 0.0), (0.1, 0.0, 0.0)]
    tank = LiveTank(study(blocks=4), dw.tank30_flow(), start=start)
    names = [tank.outcome]
    for _ in range(400):
        tank.advance(0.1)
        names += [event.outcome for event in tank.events()]
        if names[-1] in ("chain4", "star4", "ring4", "paw", "diamond"):
            break
    assert len(names) == 4
    assert tank.outcome == names[-1]
    tank.set(blocks=2)
    tank.advance(0.02)
    assert tank.outcome in ("2", "1+1")
    tank.set(latching="none", part=True)
    tank.advance(0.02)
    assert tank.outcome == "1+1"


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    "name", ["triangle", "star4", "ring4", "chain4", "paw", "diamond", "ab.ac.ad.be", "star5"]
)
def test_a_sketch_has_discs_that_touch_where_the_graph_says(name: str) -> None:
    places, contacts = disc_places(name), contacts_of(name)
    first, second = np.triu_indices(len(places), 1)
    apart = np.hypot(*(places[first] - places[second]).T)
    touch = np.array([pair in contacts for pair in zip(first, second, strict=True)])
    assert apart[touch] == pytest.approx(1.0, abs=0.05)
    assert apart[~touch].min(initial=2.0) > 1.1


def test_the_sketch_of_a_class_has_all_its_discs() -> None:
    assert class_cells("triangle+1").shape == (4, 2)
