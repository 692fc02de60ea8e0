"""An HDF5 file that names other files for its contents: nothing of them is read."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from driftwalk.core.errors import FormatError
from driftwalk.record.stores.hdf5 import opened_hdf5
from driftwalk.schema.stores.netcdf import kind_of_file, open_netcdf


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
