"""An HDF5 file that names other files is refused, and what is written is what xarray writes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import FormatError
from driftwalk.record.containers import opened_hdf5
from driftwalk.schema.stores.netcdf import kind_of_file, netcdf_bytes, open_netcdf


def linked(file: h5py.File, secret: Path) -> None:
    file["secret"] = h5py.ExternalLink(str(secret), "/secret")


def linked_deeper(file: h5py.File, secret: Path) -> None:
    linked(file.create_group("a/b"), secret)


def stored_beside(file: h5py.File, secret: Path) -> None:
    file.create_dataset("secret", (8,), "u1", external=[(str(secret), 0, 8)])


def joined(file: h5py.File, secret: Path) -> None:
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource(str(secret), "secret", (3,))
    file.create_virtual_dataset("secret", layout)


MADE = [linked, linked_deeper, stored_beside, joined]


@pytest.mark.parametrize("make", MADE)
@pytest.mark.parametrize("secret_is", ["a file", "a pipe"])
def test_another_file_is_not_read(
    tmp_path: Path, make: Callable[[h5py.File, Path], None], secret_is: str
) -> None:
    secret, path = tmp_path / "secret.h5", tmp_path / "received.nc"
    with h5py.File(secret, "w") as file:
        file["secret"] = np.arange(3.0)
    with h5py.File(path, "w") as file:
        file.attrs["kind"] = "fit"
        make(file, secret)
    if secret_is == "a pipe":
        secret.unlink()
        os.mkfifo(secret)
    # The map of joined arrays is damage to the guard of texts, which comes before.
    said = "is damaged" if make is joined else "secret' from another file, which it names"
    with pytest.raises(FormatError, match=said):
        open_netcdf(path)
    with pytest.raises(FormatError, match=said), opened_hdf5(path):
        pass
    assert kind_of_file(path) is None


def test_links_within_the_file_are_read(tmp_path: Path) -> None:
    path = tmp_path / "own.nc"
    with h5py.File(path, "w") as file:
        file["a"] = np.arange(3.0)
        file["b"] = h5py.SoftLink("/a")
    found = open_netcdf(path)
    for name in ("a", "b"):
        np.testing.assert_array_equal(found[name], np.arange(3.0))


def contents(path: Path) -> list[object]:
    """Return what HDF5 holds by h5py alone, in its order: arrays, how they lie, attributes."""

    def attributes(entry: h5py.HLObject) -> list[tuple[str, object]]:
        # References to other entries are compared by the axes that they name.
        return [
            (name, repr(value)) for name, value in entry.attrs.items() if not name.endswith("_LIST")
        ]

    with h5py.File(path) as file:
        found: list[object] = [attributes(file)]
        for name, entry in file.items():
            axes = [[scale.name for scale in axis.values()] for axis in entry.dims]
            packed = (entry.chunks, entry.compression, entry.compression_opts, entry.shuffle)
            shape = (str(entry.dtype), entry.shape, entry.maxshape)
            found.append([name, shape, packed, axes, attributes(entry), repr(entry[()])])
        return found


def test_a_file_holds_what_the_library_s_own_writer_leaves(tmp_path: Path) -> None:
    """With an axis that has no values, an empty one, one that may grow, and texts."""
    dataset = xr.Dataset(
        {
            "u": (("y", "x"), np.linspace(0.0, 1.0, 1200).reshape(40, 30), {"units": "m s-1"}),
            "flag": (("y", "x"), np.zeros((40, 30), np.int8)),
            "knot": (("part", "knot_x"), np.ones((2, 3))),
            "number": ("none", np.zeros(0)),
            "single": ((), 3),
            "name": ("part", np.array(["a", "bä"], dtype=object)),
            "x": ("x", np.arange(30.0)),
            "part": ("part", np.array(["one", "two"], dtype=object)),
            "sure": ("time", np.array([True, False, True])),
        },
        attrs={"kind": "none", "values": [1.5, 2.5], "count": 3},
    )
    dataset.encoding["unlimited_dims"] = {"time"}
    own, other = tmp_path / "own.nc", tmp_path / "other.nc"
    lazy = dataset.assign(u=dataset["u"].chunk({"y": 20}))
    lazy.encoding = dataset.encoding
    own.write_bytes(netcdf_bytes(lazy))
    packed = {key: {"zlib": True, "complevel": 4, "shuffle": True} for key in ("u", "flag")}
    dataset.to_netcdf(other, engine="h5netcdf", encoding=packed)
    assert contents(own) == contents(other)
    with h5py.File(own) as file:
        assert [scale.name for scale in file["u"].dims[1].values()] == ["/x"]
        assert file["sure"].maxshape == (None,)
