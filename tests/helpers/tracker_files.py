"""Small files as the programs that track bodies and their keypoints write them, of one motion."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

PARTS = ("nose", "tail")


def swimmer(count: int = 6) -> np.ndarray[Any, Any]:
    """Return x, y, likelihood of nose and tail, shape (frame, individual, part, 3): it turns."""
    values = np.empty((count, 2, 2, 3))
    for individual in range(2):
        angle = 0.3 * np.arange(count) + individual
        middle = np.stack([100.0 + np.arange(count), 50.0 + 7.0 * np.arange(count)], axis=1)
        away = 5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        values[:, individual, 0, :2] = middle + away
        values[:, individual, 1, :2] = middle - away
        values[:, individual, :, 2] = 0.99
    values[2, 0, 0, 2] = 0.3  # the nose of the first is hardly seen in frame 2
    return values


def movement_file(path: Path, *, plural: str = "s", source: str = "DeepLabCut") -> Path:
    values = swimmer()
    dims = ("time", "space", f"keypoint{plural}", f"individual{plural}")
    position = values[..., :2].transpose(0, 3, 2, 1)
    xr.Dataset(
        {
            "position": (dims, position),
            "confidence": ((dims[0], *dims[2:]), values[..., 2].transpose(0, 2, 1)),
        },
        coords={
            "time": 0.1 * np.arange(6),
            "space": ["x", "y"],
            dims[2]: list(PARTS),
            dims[3]: ["a", "b"],
        },
        attrs={"time_unit": "seconds", "fps": 10.0, "ds_type": "poses", "source_software": source},
    ).to_netcdf(path, engine="h5netcdf")
    return path


def dlc_columns(individuals: list[str]) -> list[list[str]]:
    """Return the header rows of DeepLabCut, without their first field."""
    columns = [
        ("net", individual, part, coordinate)
        for individual in individuals
        for part in PARTS
        for coordinate in ("x", "y", "likelihood")
    ]
    rows = [list(row) for row in zip(*columns, strict=True)]
    return rows if len(individuals) > 1 else [rows[0], *rows[2:]]


def dlc_csv(folder: Path, individuals: list[str]) -> Path:
    titles = ["scorer", "individuals", "bodyparts", "coords"]
    rows = dlc_columns(individuals)
    titles = titles if len(rows) == 4 else [titles[0], *titles[2:]]
    values = swimmer()[:, : len(individuals)].reshape(6, -1)
    lines = [",".join([title, *row]) for title, row in zip(titles, rows, strict=True)]
    lines += [",".join([str(k), *(repr(v) for v in row)]) for k, row in enumerate(values.tolist())]
    path = folder / "videoDLC_resnet50.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def dlc_hdf5(path: Path, individuals: list[str]) -> Path:
    """Write a table as pandas and PyTables lay it out: one compound array, pickled names."""
    import pickle

    rows = dlc_columns(individuals)
    names = list(zip(*rows, strict=True))
    values = swimmer()[:, : len(individuals)].reshape(6, -1)
    kind = np.dtype([("index", "i8"), ("values_block_0", "f8", (values.shape[1],))])
    table = np.zeros(6, kind)
    table["index"], table["values_block_0"] = np.arange(6), values
    with h5py.File(path, "w") as file:
        group = file.create_group("df_with_missing")
        group.attrs["pandas_type"] = np.bytes_("frame_table")
        stored = group.create_dataset("table", data=table)
        stored.attrs["values_block_0_kind"] = np.bytes_(pickle.dumps(names, protocol=0))
    return path


ORDER = ("track", "xy", "node", "frame")


def sleap_hdf5(path: Path, *, dims: tuple[str, ...] | None = None, scores: bool = True) -> Path:
    """Write an analysis file: as SLEAP lays it out, or in an order that attributes state."""
    values = swimmer().transpose(1, 3, 2, 0)  # track, xy and score, node, frame
    with h5py.File(path, "w") as file:
        order = dims or ORDER
        tracks = values[:, :2].transpose([ORDER.index(one) for one in order])
        file.create_dataset("tracks", data=tracks, compression="gzip")
        if scores:
            of_scores = [one for one in order if one != "xy"]
            known = values[:, 2].transpose([("track", "node", "frame").index(o) for o in of_scores])
            file["point_scores"] = known
        if dims is not None:
            file["tracks"].attrs["dims"] = json.dumps(dims)
            file["point_scores"].attrs["dims"] = json.dumps(of_scores)
        file["node_names"] = np.array(PARTS, "S")
        file["track_names"] = np.array(["a", "b"], "S")
    return path


def sleap_csv(path: Path, names: list[str]) -> Path:
    columns = [f"{part}.{one}" for part in PARTS for one in ("x", "y", "score")]
    rows = [
        ",".join([name, str(frame), "0.9", *(repr(v) for v in row.ravel().tolist())])
        for name, individual in zip(names, swimmer().transpose(1, 0, 2, 3), strict=False)
        for frame, row in enumerate(individual)
    ]
    path.write_text(
        "\n".join([",".join(["track,frame_idx,instance.score", *columns]), *rows]) + "\n",
        encoding="utf-8",
    )
    return path


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="")
    return path


FEATURES = [  # y, x, mass, ecc, frame, particle
    (10.5, 1.0, 200.0, 0.1, 0, 3),
    (20.5, 2.0, 210.0, 0.1, 0, 7),
    (11.5, 1.5, 205.0, 0.1, 1, 3),
    (21.5, 2.5, 207.0, 0.1, 2, 7),
]
NAMES = ["y", "x", "mass", "ecc", "frame", "particle"]


def frame_table(file: h5py.File, key: str, rows: list[tuple[float, ...]]) -> None:
    """Write rows of features as pandas' table format has them: a block per type."""
    group = file.create_group(key)
    group.attrs["pandas_type"] = np.bytes_("frame_table")
    kind = [("index", "i8"), ("values_block_0", "f8", (4,)), ("values_block_1", "i8", (2,))]
    table = np.zeros(len(rows), np.dtype(kind))
    table["values_block_0"] = [row[:4] for row in rows]
    table["values_block_1"] = [row[4:] for row in rows]
    stored = group.create_dataset("table", data=table)
    for block, names in (("values_block_0", NAMES[:4]), ("values_block_1", NAMES[4:])):
        stored.attrs[f"{block}_kind"] = np.bytes_(pickle.dumps(names, protocol=0))


SPOTS = "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME"


def spots_csv(path: Path, length: str, time: str, *, rows: int = 4) -> Path:
    header = [
        SPOTS,
        "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame",
        "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame",
        f",,,(quality),({length}),({length}),({length}),({time}),",
    ]
    spots = ["ID1,1,0,8,10,20,0,0.0,0", "ID2,2,0,8,11,21,0,0.5,1", "ID3,3,,8,99,99,0,0.5,1",
             "ID4,4,2,8,30,40,0,0.5,1"]  # fmt: skip
    return write(path, *header[:rows], *spots)


SESSION = """<?xml version="1.0" encoding="UTF-8"?>
<TrackMate version="7.6.1">
  <Model spatialunits="{length}" timeunits="{time}">
    <AllSpots nspots="5">
      <SpotsInFrame frame="0">
        <Spot ID="11" name="a" POSITION_X="1.5" POSITION_Y="2.5" POSITION_T="0.0" FRAME="0" />
        <Spot ID="12" name="b" POSITION_X="9.0" POSITION_Y="9.0" POSITION_T="0.0" FRAME="0" />
      </SpotsInFrame>
      <SpotsInFrame frame="1">
        <Spot ID="7" name="c" POSITION_X="2.5" POSITION_Y="3.5" POSITION_T="0.2" FRAME="1" />
        <Spot ID="13" name="d" POSITION_X="5.0" POSITION_Y="5.0" POSITION_T="0.2" FRAME="1" />
      </SpotsInFrame>
      <SpotsInFrame frame="2">
        <Spot ID="14" name="e" POSITION_X="3.5" POSITION_Y="4.5" POSITION_T="0.4" FRAME="2" />
      </SpotsInFrame>
    </AllSpots>
    <AllTracks>
      <Track name="Track_4" TRACK_ID="4">
        <Edge SPOT_SOURCE_ID="7" SPOT_TARGET_ID="14" />
        <Edge SPOT_SOURCE_ID="11" SPOT_TARGET_ID="7" />
      </Track>
      <Track name="Track_5" TRACK_ID="5">
        <Edge SPOT_SOURCE_ID="12" SPOT_TARGET_ID="13" />
      </Track>
    </AllTracks>
    <FilteredTracks><TrackID TRACK_ID="4" /></FilteredTracks>
  </Model>
</TrackMate>
"""


def animalta(path: Path, *, rate: float = 25.0, count: int = 60) -> Path:
    rows = [
        f"{k};{round(k / rate, 2)};{100 + k};{50};{'NA' if k == 3 else 200 - k};{60}"
        for k in range(count)
    ]
    return write(path, "Frame;Time;X_Arena0_Ind0;Y_Arena0_Ind0;X_Arena0_Ind1;Y_Arena0_Ind1", *rows)


def session(count: int = 5) -> dict[str, Any]:
    values = np.arange(count * 4, dtype=float).reshape(count, 2, 2)
    values[1, 0] = np.nan
    known = np.full((count, 2, 1), 0.99)
    known[2, 1] = 0.4
    return {
        "trajectories": values,
        "id_probabilities": known,
        "version": "6.0.1",
        "frames_per_second": 20.0,
        "body_length": np.float64(33.0),
        "video_paths": ["/data/a.avi"],
        "setup_points": {"border": np.array([[1, 2], [3, 4]])},
        "areas": {"mean": np.array([1.0, 2.0])},
        "identities_labels": ["red", "blue"],
        "identities_groups": {"all": ["red"]},
        "length_unit": 12.5,
    }


def trex(folder: Path, number: int, **changed: Any) -> Path:
    frame = np.arange(6.0)
    x = 10.0 + frame + number
    x[2] = np.inf
    arrays = {
        "frame": frame,
        "time": frame / 20,
        "missing": (frame == 2).astype(float),
        "X#wcentroid": x,
        "Y#wcentroid": 5.0 + 0 * frame,
        "X": x + 1,
        "Y": 5.0 + 0 * frame,
        "ANGLE": 0.1 * frame,
        "poseX0": 100 * x,
        "poseY0": 300.0 + 0 * frame,
        "poseX1": 100 * x,
        "poseY1": 310.0 + 0 * frame,
        "cm_per_pixel": np.array([0.01]),
        "frame_rate": np.array([20.0]),
    } | changed
    path = folder / f"tank_id{number}.npz"
    np.savez(path, **{name: one for name, one in arrays.items() if one is not None})
    return path
