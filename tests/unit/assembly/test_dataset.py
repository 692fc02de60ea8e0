"""The `assembly` dataset, from hand-made arrays of the native core."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.assembly.runs.dataset import build_assembly, build_path, times_of
from driftwalk.assembly.runs.plan import Plan, make_plan
from driftwalk.model import Study


def plan(**settings: Any) -> Plan:
    chosen = {"blocks": 3, "runs": 3, "duration_s": 10.0, **settings}
    return make_plan(Study(), dw.uniform_flow(0.0, 0.0), settings=chosen, drag_coefficient=0.4)


def arrays() -> dict[str, np.ndarray]:
    """Return three runs of three blocks: a complete one, one with a pair, one that broke down.

    Run 0: at step 50 face 0 of block 0 meets face 2 of block 2, at step 700 face 1 of block 0 meets
    face 3 of block 1: an L. Run 1: at step 30 face 0 of block 1 meets face 2 of block 2.
    """
    none = -1
    return {
        "status": np.array([0, 0, 1], np.uint32),
        "event_count": np.array([2, 1, 0], np.int32),
        "event_step": np.array([[50, 700], [30, none], [none, none]], np.int32),
        "event_block": np.array(
            [[[0, 2], [0, 1]], [[1, 2], [none, none]], [[none, none], [none, none]]], np.int32
        ),
        "event_face": np.array(
            [[[0, 2], [1, 3]], [[0, 2], [none, none]], [[none, none], [none, none]]], np.int32
        ),
        "first_contact_step": np.array([50, 30, none], np.int32),
        "end_step": np.array([700, 1000, 12], np.int32),
        "pose": np.arange(27.0).reshape(3, 3, 3) / 1000,
        "cell": np.array(
            [[[0, 0], [0, 1], [1, 0]], [[0, 0], [0, 0], [1, 0]], [[0, 0], [0, 0], [0, 0]]],
            np.int32,
        ),
        "quarter": np.zeros((3, 3), np.int32),
        "assembly": np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2]], np.int32),
    }


def test_events_get_times_shapes_and_classes() -> None:
    found = build_assembly(plan(), arrays(), attrs={"drawn": "no"})
    names = found["class"].values.tolist()
    assert names == ["I3", "L3", "2+1", "1+1+1"]
    assert [names[k] for k in found["outcome"].values[:2]] == ["L3", "2+1"]
    assert found["outcome"].values[2] == -1, "a run that broke down has no outcome"
    np.testing.assert_array_equal(
        found["event_time"], [[0.5, 7.0], [0.3, np.nan], [np.nan, np.nan]]
    )
    classes = [[names[k] if k >= 0 else "" for k in row] for row in found["event_class"].values]
    assert classes == [["2+1", "L3"], ["2+1", ""], ["", ""]]
    shapes = found["shape"].values
    assert shapes[found["event_shape"].values[0, 1]].tolist() == ["2", "1", "L3"]
    np.testing.assert_array_equal(found["event_assembly"].values[0], [[0, 2], [0, 1]])
    np.testing.assert_array_equal(found["first_contact_time"], [0.5, 0.3, np.nan])
    np.testing.assert_array_equal(found["completion_time"], [7.0, np.nan, np.nan])
    np.testing.assert_array_equal(found["end_time"], [7.0, 10.0, 0.12])
    np.testing.assert_array_equal(found["theta"].values[1], [0.011, 0.014, 0.017])
    np.testing.assert_array_equal(found["drag_coefficient"], [0.4, 0.4, 0.4])
    np.testing.assert_array_equal(found["force_std"], 3 * [0.55e-3])
    assert found["status"].values.tolist() == [0, 0, 1]


def test_every_variable_has_the_dimensions_of_the_contract() -> None:
    found = build_assembly(plan(), arrays(), attrs={})
    dims = {
        "event_count": ("run",),
        "event_time": ("run", "event"),
        "event_block": ("run", "event", "side"),
        "event_face": ("run", "event", "side"),
        "event_assembly": ("run", "event", "side"),
        "event_shape": ("run", "event", "part"),
        "event_class": ("run", "event"),
        "outcome": ("run",),
        "first_contact_time": ("run",),
        "completion_time": ("run",),
        "end_time": ("run",),
        **dict.fromkeys(("x", "y", "theta", "quarter", "assembly"), ("run", "block")),
        "cell": ("run", "block", "axis"),
        **dict.fromkeys(("drag_coefficient", "force_std", "status"), ("run",)),
    }
    assert {str(name): found[name].dims for name in found.data_vars} == dims
    units = {"x": "m", "theta": "rad", "force_std": "N", "event_time": "s", "end_time": "s"}
    assert {name: found[name].attrs["units"] for name in units} == units
    whole = [name for name, values in found.data_vars.items() if values.dtype.kind == "i"]
    assert {found[name].dtype for name in whole} == {np.dtype(np.int32)}
    facts = found.attrs
    assert (facts["kind"], facts["blocks"], facts["runs"], facts["duration_s"]) == (
        *("assembly", 3, 3, 10.0),
    )
    assert dw.model.parse_study(facts["study"]).forces.drag_coefficient == 0.4
    assert {"seed", "chirality", "latching", "hidden_face_drag", "arena"} <= facts.keys()
    assert {"block_side_m", "time_step_s", "force_interval_s"} <= facts.keys()


@pytest.mark.slow
def test_a_dataset_survives_its_file(tmp_path: Any) -> None:
    found = build_assembly(plan(), arrays(), attrs={"drawn": "no"})
    found.to_netcdf(tmp_path / "assembly.nc", engine="h5netcdf")
    import xarray as xr

    with xr.open_dataset(tmp_path / "assembly.nc", engine="h5netcdf") as stored:
        assert stored.load().identical(found)


def test_a_single_block_is_complete_from_the_start() -> None:
    raw = {name: values[:1, ...] for name, values in arrays().items()}
    for name in ("pose", "cell", "quarter", "assembly"):
        raw[name] = raw[name][:, :1]
    for name in ("event_step", "event_block", "event_face"):
        raw[name] = np.full_like(raw[name][:, :1], -1)
    raw |= {"event_count": np.zeros(1, np.int32), "first_contact_step": np.array([-1], np.int32)}
    found = build_assembly(plan(blocks=1, runs=1), raw, attrs={})
    assert found["class"].values.tolist() == ["1"]
    assert found["completion_time"].values.tolist() == [0.0]
    assert np.isnan(found["first_contact_time"].values).all()


def test_chirality_decides_the_classes() -> None:
    four = plan(blocks=4, runs=1, chirality="distinct")
    raw = {
        "status": np.zeros(1, np.uint32),
        "event_count": np.zeros(1, np.int32),
        "event_step": np.full((1, 3), -1, np.int32),
        "event_block": np.full((1, 3, 2), -1, np.int32),
        "event_face": np.full((1, 3, 2), -1, np.int32),
        "first_contact_step": np.full(1, -1, np.int32),
        "end_step": np.full(1, 1000, np.int32),
        "pose": np.zeros((1, 4, 3)),
        "cell": np.zeros((1, 4, 2), np.int32),
        "quarter": np.zeros((1, 4), np.int32),
        "assembly": np.arange(4, dtype=np.int32)[None],
    }
    names = build_assembly(four, raw, attrs={})["class"].values.tolist()
    assert names == ["I", "O", "T", "S", "Z", "L", "J", "I3+1", "L3+1", "2+2", "2+1+1", "1+1+1+1"]


def test_times_are_the_decimals_that_one_would_write() -> None:
    np.testing.assert_array_equal(
        times_of(np.array([[3, -1], [30_000, 7]]), time_step=0.01), [[0.03, np.nan], [300.0, 0.07]]
    )


def test_path_has_poses_assemblies_and_times() -> None:
    pose = np.arange(36, dtype=np.float32).reshape(1, 4, 3, 3)
    samples = {"sample_pose": pose, "sample_assembly": np.zeros((1, 4, 3), np.int32)}
    chosen = make_plan(
        Study(),
        dw.uniform_flow(0.0, 0.0),
        settings={"blocks": 3, "duration_s": 1.0},
        index=np.array([17]),
    )
    path = build_path(chosen, samples, every=30)
    assert path["x"].dims == ("run", "time", "block")
    assert path["run"].values.tolist() == [17]
    np.testing.assert_array_equal(path["time"], [0.0, 0.3, 0.6, 0.9])
    np.testing.assert_array_equal(path["theta"].values[0, 1], [11.0, 14.0, 17.0])
    assert path.attrs["sample_interval_s"] == 0.3
    assert path.attrs["kind"] == "assembly_path"


@pytest.mark.parametrize(
    ("interval", "duration", "steps"), [(0.016, 300.0, 37_500), (0.010, 0.057, 5), (0.01, 1e-3, 1)]
)
def test_a_run_has_whole_steps(interval: float, duration: float, steps: int) -> None:
    study = Study(forces={"force_interval_s": interval}, assembly={"duration_s": duration})
    assert make_plan(study, dw.uniform_flow(0.0, 0.0), settings={}).steps == steps
