"""One small valid file of every format of trackers, and the options that it needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
from matlab_files import hdf5_file, struct_of
from scipy.io import savemat
from tracker_files import (
    FEATURES,
    NAMES,
    SESSION,
    animalta,
    dlc_csv,
    dlc_hdf5,
    frame_table,
    session,
    sleap_csv,
    sleap_hdf5,
    spots_csv,
    trex,
    write,
)

PIXELS = ("--scale", "0.001")
FRAMES = ("--fps", "10", *PIXELS)
POSE = ("--keypoint", "nose", "--heading", "tail,nose")


def tracker_files() -> Iterator[tuple[str, str, tuple[str, ...], Callable[[Path], object]]]:
    """Yield kind, name of the file, options, and how it is written at a path."""
    individuals = ["one", "two"]
    yield "deeplabcut", "videoDLC_resnet50.csv", (*FRAMES, *POSE), _deeplabcut(individuals)
    yield "deeplabcut-h5", "a.h5", (*FRAMES, *POSE), lambda path: dlc_hdf5(path, individuals)
    yield "sleap", "a.h5", (*FRAMES, *POSE), sleap_hdf5
    yield "sleap-csv", "a.csv", (*FRAMES, *POSE), lambda path: sleap_csv(path, individuals)
    rows = [",".join(map(str, row)) for row in FEATURES]
    yield "trackpy", "a.csv", FRAMES, lambda path: write(path, ",".join(NAMES), *rows)
    yield "trackpy-h5", "a.h5", FRAMES, _store
    yield "trackmate", "a.csv", (), lambda path: spots_csv(path, "mm", "sec")
    text = SESSION.format(length="mm", time="sec")
    yield "trackmate-xml", "a.xml", (), lambda path: write(path, text)
    yield "animalta", "a.csv", PIXELS, animalta
    yield "idtrackerai", "a.npy", PIXELS, lambda path: np.save(path, np.array(session(), object))
    yield "idtrackerai-h5", "a.h5", PIXELS, _session
    yield "idtrackerai-labels", "a.h5", PIXELS, lambda path: _session(path, ("identities_labels",))
    yield "trex", "tank_id0.npz", (), lambda path: trex(path.parent, 0)
    yield from _tables()
    settings = ("v2,6", "walk,,2", "1,1,1", "", "", "tag")
    steps = [f"{0.1 * k:.1f},{0.2 * k:.1f},{0.1 * k:.1f},a" for k in range(20)]
    yield "yupi", "a.csv", ("--length-unit", "m"), lambda path: write(path, *settings, *steps)
    names = "Frame,Time,TrackId,x,y,ValueChanged"
    places = [f"{k},{0.02 * k:.2f},8,{k}.5,{2 * k},TRUE" for k in range(20)]
    yield "traja", "a.csv", ("--length-unit", "mm"), lambda path: write(path, names, *places)


def _tables() -> Iterator[tuple[str, str, tuple[str, ...], Callable[[Path], object]]]:
    """Yield tables as spreadsheets and MATLAB write them."""
    places = {"t": 0.1 * np.arange(20), "x": 0.02 * np.arange(20), "y": 0.01 * np.arange(20)}
    rows = [f"00:00:{k:02d},5;{k},5;{2 * k}" for k in range(20)]
    yield "comma", "a.csv", (), lambda path: write(path, "time;x;y", *rows)
    moments = [f"2024-05-01T12:00:{k:02d}.25Z,{k}.5,{k}" for k in range(20)]
    text = "\n".join(["time,x,y", *moments])
    yield "utf16", "a.csv", (), lambda path: path.write_bytes(text.encode("utf-16"))
    yield "matlab", "a.mat", (), lambda path: savemat(path, {"S": places})
    yield "matlab-packed", "a.mat", (), lambda path: savemat(path, places, do_compression=True)
    yield (
        "matlab-h5",
        "a.mat",
        (),
        lambda path: hdf5_file(path, lambda file: struct_of(file, "S", places)),
    )
    yield "excel", "a.xlsx", (), lambda path: pd.DataFrame(places).to_excel(path, index=False)


def _deeplabcut(individuals: list[str]) -> Callable[[Path], object]:
    return lambda path: dlc_csv(path.parent, individuals)


def _store(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["PYTABLES_FORMAT_VERSION"] = np.bytes_("2.1")
        frame_table(file, "tracks", FEATURES)


def _session(path: Path, texts: tuple[str, ...] = ()) -> None:
    values = session()
    with h5py.File(path, "w") as file:
        for name in ("trajectories", "id_probabilities"):
            file[name] = values[name]
        for name in ("frames_per_second", "length_unit", *texts):
            file.attrs[name] = values[name]
