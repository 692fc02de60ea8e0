"""Reading and writing NetCDF files.

Reading: their declared size first, then whole into memory.

A header may declare any size. HDF5 stores a chunk that was never written as nothing at all, and
reads it as its fill value: a file of a few kilobytes holds terabytes so. The declared size is
therefore compared with the size of the file, before anything of that size is made.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import FormatError
from driftwalk.core.text_files import MIB
from driftwalk.schema.check import refuse_other_version
from driftwalk.schema.stores.hdf5_texts import refuse_endless_texts

if TYPE_CHECKING:
    import xarray as xr

HDF5: Final = b"\x89HDF\r\n\x1a\n"
MAGIC: Final = (HDF5, b"CDF\x01", b"CDF\x02")

ALLOWANCE_BYTES: Final = 128 * MIB
"""Memory that any file may declare, however small the file is; chosen by hand."""
LARGEST_RATIO: Final = 500
"""How much more a file may hold in memory than on the disk, beyond that. Deflate, the filter that
NetCDF uses, shrinks nothing by more than 1032, and that only where every byte is the same.
Positions with digits of their own shrink by 10 at most, by 100 where nearly all of them are
missing; chosen by hand."""
_WIDTH: Final = 8
"""Bytes of a number in memory at least: packed ones are unpacked to doubles."""


def open_netcdf(path: Path) -> xr.Dataset:
    """Read a NetCDF file into memory and close it.

    Numbers stay as they are stored: a time in "s" does not become a date. Each reader checks the
    required contents, by `driftwalk.schema.check.check_contents` where work goes on with
    it.

    Raises
    ------
    FormatError
        When it is no NetCDF file, is of another schema version, declares more than it can hold, or
        is damaged.
    """
    if not is_netcdf(path):
        raise FormatError("is not a NetCDF file", path=path)
    with _opened(path) as dataset:
        return refuse_other_version(dataset.load(), path)


def netcdf_bytes(dataset: xr.Dataset) -> bytes:
    """Return a dataset as the bytes of a NetCDF-4 file, numbers compressed.

    In memory, because HDF5 does not survive a disk that fills while it writes.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset of driftwalk.

    Examples
    --------
    >>> import driftwalk as dw
    >>> netcdf_bytes(dw.tank30_flow())[1:4]
    b'HDF'
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    from driftwalk.schema.stores.open_hdf5 import OpenHdf5

    packed = {
        name: {"zlib": True, "complevel": 4, "shuffle": True}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind in "fiu" and variable.size > 1000
    }
    growing = [name for name in dataset.encoding.get("unlimited_dims", ()) if name in dataset.sizes]
    written = BytesIO()
    # What `Dataset.to_netcdf` does, with a file that looks each object up once. A store writes
    # arrays of dask only when its writer is synchronised, so they are computed first.
    with OpenHdf5(written, "w") as file, h5netcdf.File(file, "w") as named:
        store = H5NetCDFStore(named)
        dataset.compute().dump_to_store(store, encoding=packed, unlimited_dims=growing)
    return written.getvalue()


def text_attribute(path: Path, name: str) -> str | None:
    """Return a global attribute of a NetCDF file, None when it is no text, or the file none.

    Parameters
    ----------
    path : Path
        The file, which may be damaged.
    name : str
        Name of the attribute.
    """
    value: Any = None
    try:
        if file_start(path).startswith(HDF5):
            value = _attribute_of_hdf5(path, name)
        elif is_netcdf(path):
            with _opened(path) as dataset:
                value = dataset.attrs.get(name)
    except FormatError:
        return None
    return value if isinstance(value, str) else None


def _attribute_of_hdf5(path: Path, name: str) -> Any:
    """Return the same of HDF5, which h5py opens without the libraries of datasets."""
    import h5py

    try:
        # First what else is in it, which damage of other kinds shows in, and then no more than the
        # one that is asked for.
        refuse_endless_texts(path)
        _declared_hdf5(path)
        with h5py.File(path, "r") as file:
            value = file.attrs.get(name)
            one = value.item() if getattr(value, "size", 0) == 1 else value
            return one.decode("utf-8", "replace") if isinstance(one, bytes) else one
    except Exception:  # whatever the damage of a file leads the library to
        return None


def kind_of_file(path: Path) -> str | None:
    """Return which kind of driftwalk's own datasets a file holds, None for any other file."""
    return text_attribute(path, "kind")


def is_netcdf(path: Path) -> bool:
    """Return whether a file begins as NetCDF files do.

    Raises
    ------
    FormatError
        When it cannot be opened.
    """
    return file_start(path).startswith(MAGIC)


def file_start(path: Path) -> bytes:
    """Return the first eight bytes of a file, by which formats that are no text are known.

    Raises
    ------
    FormatError
        When it cannot be opened.
    """
    try:
        with path.open("rb") as file:
            return file.read(len(HDF5))
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=path) from error


@contextmanager
def _opened(path: Path) -> Iterator[xr.Dataset]:
    """Open a file that begins as NetCDF; what goes wrong with it inside becomes a `FormatError`."""
    import xarray as xr

    is_hdf5 = file_start(path).startswith(HDF5)
    try:
        with warnings.catch_warnings(), ExitStack() as opened:
            # What the libraries remark about a file of the user's is no line of ours.
            warnings.simplefilter("ignore")
            if is_hdf5:
                refuse_endless_texts(path)
            refuse_huge(_declared_hdf5(path) if is_hdf5 else _declared_classic(path), path)
            source: Any = _store_of_hdf5(path, opened) if is_hdf5 else path
            engine: Any = None if is_hdf5 else "scipy"
            dataset = opened.enter_context(
                xr.open_dataset(source, decode_times=False, engine=engine)
            )
            dataset.encoding["source"] = str(path.absolute())
            yield dataset
    except FormatError:
        raise
    except Exception as error:
        # On a damaged file the libraries fail with whatever the damage leads them to.
        reason = str(error) or type(error).__name__
        raise FormatError(f"cannot be read as NetCDF: {reason}", path=path) from error


def _store_of_hdf5(path: Path, opened: ExitStack) -> Any:
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    from driftwalk.schema.stores.open_hdf5 import OpenHdf5

    file = opened.enter_context(OpenHdf5(path))
    # HDF5 of other programs has dimensions without names.
    named = opened.enter_context(
        h5netcdf.File(file, "r", phony_dims="access", decode_vlen_strings=True)
    )
    return H5NetCDFStore(named)


def refuse_huge(declared: int, path: Path) -> None:
    """Refuse a file that declares more than a file of its size can hold.

    Parameters
    ----------
    declared : int
        Bytes in memory by its header.
    path : Path
        The file.

    Raises
    ------
    FormatError
        Says both sizes.
    """
    if declared > most_bytes(path):
        raise FormatError(
            f"is damaged: its header declares {declared / 1e9:.3g} GB, which a file of "
            f"{path.stat().st_size / 1e6:.2g} MB does not hold",
            path=path,
        )


def most_bytes(path: Path) -> int:
    """Return how many bytes a file may hold in memory by its size on the disk."""
    return ALLOWANCE_BYTES + LARGEST_RATIO * path.stat().st_size


def _declared_hdf5(path: Path) -> int:
    """Return how many bytes the variables of a file have in memory by its header."""
    import h5py

    with h5py.File(path, "r") as file:
        refuse_elsewhere(file, path)
        return sum(declared_bytes(file[name]) for name in file)


def refuse_elsewhere(file: Any, path: Path) -> None:
    """Refuse an HDF5 file that names other files for its contents.

    It may name any: what lies there would be read, and shown to others, as if it were the file's.

    Parameters
    ----------
    file : h5py.File
        The open file, of which nothing has been read.
    path : Path
        Where it is, for the message.

    Raises
    ------
    FormatError
        When an entry is a link to another file, or the values of an array lie in one.
    """
    import h5py

    found: list[bytes | str] = []

    def note_link(name: bytes, link: Any) -> None:
        if link.type == h5py.h5l.TYPE_EXTERNAL:
            found.append(name)

    def note_array(name: str, entry: Any) -> None:
        if isinstance(entry, h5py.Dataset) and (entry.external or entry.is_virtual):
            found.append(name)

    # Neither visit follows a link.
    file.id.links.visit(note_link, info=True)
    file.visititems(note_array)
    if found:
        name = found[0].decode("utf-8", "replace") if isinstance(found[0], bytes) else found[0]
        raise FormatError(
            f"takes '{name}' from another file, which it names: only what lies in the file itself "
            "is read; copy the values into it",
            path=path,
        )


def declared_bytes(entry: Any) -> int:
    """Return how many bytes an entry of an HDF5 file has in memory by its header, 0 of no array.

    Parameters
    ----------
    entry : h5py object
        An array, a group or anything else that a file holds.
    """
    import h5py

    if not isinstance(entry, h5py.Dataset) or entry.shape is None:
        return 0
    return int(entry.size * max(entry.dtype.itemsize, _WIDTH))


def _declared_classic(path: Path) -> int:
    """Return the same of NetCDF 3, whose reader refuses what lies beyond the end of the file."""
    from scipy.io import netcdf_file

    with netcdf_file(path, "r", mmap=True) as file:
        return sum(
            variable.data.size * max(variable.data.itemsize, _WIDTH)
            for variable in file.variables.values()
        )
