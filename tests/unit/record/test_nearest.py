"""A file that no format recognises: what it is, and what it lacks of the formats that are near."""

from __future__ import annotations

import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest
from tracker_files import movement_file

from driftwalk.core.errors import FormatError
from driftwalk.record import load, readable_formats
from driftwalk.record.raw import Marks
from driftwalk.record.registry import loaders


def refused(path: Path) -> str:
    with pytest.raises(FormatError) as caught:
        load(path, frame_rate=10.0, metres_per_pixel=0.01)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_hdf5_that_is_nearly_a_format(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["tracks"], file["track_names"] = np.zeros(3), np.array([b"a"])
    text = refused(path)
    assert "not recognised: it is HDF5 with 'track_names', 'tracks'" in text
    assert "the nearest are sleap (lacks 'node_names', 'track_occupancy')" in text
    with h5py.File(path, "w") as file:
        file["frames"] = file["instances"] = file["points"] = np.zeros(3)
    assert "a SLEAP project: export it as analysis HDF5 or CSV" in refused(path)
    with h5py.File(path, "w") as file:
        file["spectrum"] = np.zeros(3)
    assert "sleap (lacks 'tracks', 'node_names'" in refused(path) or "movement" in refused(path)


def test_a_damaged_file_that_has_the_names_of_a_format(tmp_path: Path) -> None:
    """Found by damaging files: the library did not come to an end on values of attributes."""
    path = movement_file(tmp_path / "poses.nc")
    content = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        place = file["space"].id.get_offset() or h5py.h5o.get_info(file["space"].id).addr
    # References to text without an address. Text of 16 MB each: the library clears as much memory
    # before it looks, and with 4 GB that takes most of ten seconds.
    content[place : place + 96] = 6 * (b"\xff\xff\xff\x00" + 12 * b"\xff")
    path.write_bytes(content)
    assert "not recognised" in refused(path) or "cannot be read as NetCDF" in refused(path)


def test_other_containers(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", X=np.zeros(3), time=np.zeros(3))
    assert "NumPy's .npz with 'X', 'time'; the nearest are trex (lacks" in refused(
        tmp_path / "a.npz"
    )
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as file:
        file.writestr("a.txt", "text")
    assert "it is a zip file; the nearest are trex" in refused(tmp_path / "a.zip")
    (tmp_path / "a.xml").write_text("<?xml version='1.0'?>\n<gpx><trk/></gpx>\n")
    assert "it is XML with 'gpx', 'trk'; the nearest are trackmate-xml" in refused(
        tmp_path / "a.xml"
    )
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "trajectories.csv").write_text("time,x1,y1\n0,1,2\n")
    assert "idtrackerai (lacks 'attributes.json')" in refused(tmp_path / "folder")
    (tmp_path / "junk").write_bytes(bytes(range(256)))
    text = refused(tmp_path / "junk")
    assert "it is no text" in text
    assert all(name in text for name in readable_formats())


@pytest.mark.parametrize(
    ("header", "near"),
    [
        (
            "score,net,net,net\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\n0,1,2,1",
            "deeplabcut",
        ),
        ("frame_nr,X#pos (cm),Y#wcentroid (cm)\n0,1,2", ""),
        ("LABEL,ID,TRACK_ID,POS_X,POSITION_Y,POSITION_T,FRAME\nID1,1,1,1,1,1,1", "trackmate"),
        ("temperature,pressure\n1,2", ""),
    ],
)
def test_a_table_that_is_nearly_a_format(tmp_path: Path, header: str, near: str) -> None:
    path = tmp_path / "table.csv"
    path.write_text(header + "\n")
    text = refused(path)
    assert (f"; as {near} it lacks '" in text) if near else ("; as " not in text)


def test_marks_are_those_of_files_that_are_recognised() -> None:
    containers = {"HDF5", "npz", "npy", "XML", "table", "folder"}
    marked = {name: getattr(loader, "marks", ()) for name, loader in loaders().items()}
    assert sum(bool(marks) for marks in marked.values()) >= 10
    for marks in marked.values():
        for one in marks:
            assert isinstance(one, Marks)
            assert one.container in containers
            assert one.names
