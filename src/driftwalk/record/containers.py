"""Containers: HDF5 that is no NetCDF, NumPy's ``.npz``, and pickles of plain data.

No array is larger than its file can hold. Tables that pandas stored in HDF5 are read without
PyTables. The fixed format keeps blocks of columns of one type each, the table format one compound
array. The names of the columns are arrays in the first, and pickled lists in attributes in the
second.

A pickle is a program, and it may call any function by name. None is executed here: the few names
that NumPy's arrays need are answered by functions of this module, and `find_class` refuses every
other one.
"""

from __future__ import annotations

import io
import pickle
import pickletools
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, damaged_as
from driftwalk.record.raw import Array
from driftwalk.schema.stores.hdf5_texts import refuse_endless_texts
from driftwalk.schema.stores.netcdf import HDF5, declared_bytes, refuse_elsewhere, refuse_huge

if TYPE_CHECKING:
    import h5py


class Hdf5Contents:
    """An open HDF5 file, whose arrays are read within what its size allows."""

    def __init__(self, file: h5py.File, path: Path) -> None:
        self.file = file
        self.path = path
        self._declared = 0

    def array(self, name: str) -> npt.NDArray[Any]:
        """Return the values of an array.

        Raises
        ------
        FormatError
            When there is none of that name, or it declares more than the file can hold.
        """
        import h5py

        entry = self.file.get(name)
        if not isinstance(entry, h5py.Dataset) or entry.shape is None:
            raise FormatError(f"has no array '{name}'")
        steps = entry.id.get_create_plist()
        codes = (steps.get_filter(at)[0] for at in range(steps.get_nfilters()))
        if not all(map(h5py.h5z.filter_avail, codes)):
            raise FormatError(
                f"'{name}' is compressed by a filter that is not installed: save the file without "
                "compression or with gzip, or as CSV"
            )
        # A file may hold many arrays that each declare a little too much.
        self._declared += declared_bytes(entry)
        refuse_huge(self._declared, self.path)
        return np.asarray(entry[()])

    def texts(self, name: str) -> list[str]:
        """Return the values of a one-dimensional array of texts.

        Raises
        ------
        FormatError
            As `array`.
        """
        return [text_of(value) for value in self.array(name).ravel().tolist()]


def text_of(value: Any) -> str:
    """Return a text of HDF5, which may be stored as bytes.

    Examples
    --------
    >>> text_of(b"head")
    'head'
    """
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


@contextmanager
def opened_hdf5(path: Path) -> Iterator[Hdf5Contents]:
    """Open an HDF5 file; what goes wrong with it inside becomes a `FormatError`.

    Raises
    ------
    FormatError
        When it is none, or is damaged.
    """
    import h5py

    with damaged_as("as HDF5", path):
        refuse_endless_texts(path)
        with h5py.File(path, "r") as file:
            refuse_elsewhere(file, path)
            for name in file:
                # A damaged entry is found here, before the attributes.
                file[name]
            yield Hdf5Contents(file, path)


def names_in(path: Path, head: bytes) -> set[str]:
    """Return the names of what lies at the top of an HDF5 file; {} when it is none or damaged.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its start.
    """
    if not head.startswith(HDF5):
        return set()
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return set(map(str, file)) | set(map(str, file.attrs))
    except Exception:  # whatever the damage of a file leads the library to
        return set()


Column = tuple[str, ...]
_SAVE_ELSE = "save the table as CSV (DataFrame.to_csv) and give that"


class Frame(NamedTuple):
    """A table that pandas stored in an HDF5 file."""

    key: str
    columns: dict[Column, npt.NDArray[Any] | None]
    """From the name of each column, by level, to its numbers; None where it holds none."""
    rows: npt.NDArray[Any] | None

    def numbers(self, column: int) -> Array:
        """Return a column as float64.

        Raises
        ------
        FormatError
            When it holds no numbers.
        """
        name = [*self.columns][column]
        values = self.columns[name]
        if values is None:
            raise FormatError(f"column '{'.'.join(name)}' of '{self.key}' holds no numbers")
        return np.array(values, dtype=np.float64)

    def labels(self) -> Array:
        """Return the labels of the rows; they are numbered where they are no numbers."""
        rows = np.arange(self.numbers(0).size) if self.rows is None else self.rows
        return np.array(rows, dtype=np.float64)


def frame_in(contents: Hdf5Contents, key: str) -> Frame:
    """Return the table that lies under a key.

    Parameters
    ----------
    contents : Hdf5Contents
        The file.
    key : str
        Name of the group.

    Raises
    ------
    FormatError
        When there is no table that is understood.
    """
    import h5py

    group = contents.file.get(key)
    if not isinstance(group, h5py.Group):
        raise FormatError(f"has no table '{key}'")
    kind = text_of(group.attrs.get("pandas_type", b""))
    if kind == "frame_table" and isinstance(group.get("table"), h5py.Dataset):
        frame = _table(contents, key, group)
    elif kind == "frame":
        frame = _fixed(contents, key, group)
    else:
        raise FormatError(
            f"'{key}' is no table of pandas that can be read (it says '{kind}'): {_SAVE_ELSE}"
        )
    if not frame.columns:
        raise FormatError(f"the table '{key}' has no columns")
    return frame


def _fixed(contents: Hdf5Contents, key: str, group: Any) -> Frame:
    """Return a table of the fixed format: blocks of columns of one type each."""
    columns: dict[Column, npt.NDArray[Any] | None] = {}
    for block in range(int(group.attrs.get("nblocks", 0))):
        names = _labels(contents, key, f"block{block}_items", group)
        columns |= _columns(names, contents.array(f"{key}/block{block}_values"))
    numbered = "axis1" in group and group["axis1"].dtype.kind in "iuf"
    return Frame(key, columns, contents.array(f"{key}/axis1") if numbered else None)


def _columns(
    names: list[Column], values: npt.NDArray[Any]
) -> dict[Column, npt.NDArray[Any] | None]:
    """Return the columns of a block, shape (row, column)."""
    count = values.shape[1] if values.ndim == 2 and values.dtype.kind in "fiub" else 0
    return {name: values[:, at] if at < count else None for at, name in enumerate(names)}


def _labels(contents: Hdf5Contents, key: str, name: str, group: Any) -> list[Column]:
    """Return the names of the columns of a block, of one level or of several."""
    if text_of(group.attrs.get(f"{name}_variety", b"regular")) != "multi":
        return [(text,) for text in contents.texts(f"{key}/{name}")]
    levels: list[list[str]] = []
    for level in range(int(group.attrs.get(f"{name}_nlevels", 0))):
        texts = contents.texts(f"{key}/{name}_level{level}")
        codes = contents.array(f"{key}/{name}_label{level}").tolist()
        if any(not 0 <= code < len(texts) for code in codes):
            raise FormatError(f"the names of the columns of '{key}' are damaged")
        levels.append([texts[code] for code in codes])
    return [*zip(*levels, strict=True)]


def _table(contents: Hdf5Contents, key: str, group: Any) -> Frame:
    """Return a table of the table format: one compound array."""
    stored = contents.array(f"{key}/table")
    fields = stored.dtype.names or ()
    columns: dict[Column, npt.NDArray[Any] | None] = {}
    for name in fields:
        if name != "index":
            values = stored[name]
            values = values.reshape(len(values), -1) if len(values) else values[:, None]
            columns |= _columns(_pickled(group, f"{name}_kind"), values)
    numbered = "index" in fields and stored["index"].dtype.kind in "iuf"
    return Frame(key, columns, stored["index"] if numbered else None)


def _pickled(group: Any, attribute: str) -> list[Column]:
    """Return the names of columns that pandas pickled into an attribute of the table."""
    stored = group["table"].attrs.get(attribute, b"")
    names = unpickle(bytes(stored), where=f"attribute '{attribute}'")
    if not isinstance(names, list):
        raise FormatError(f"the attribute '{attribute}' names no columns")
    return [tuple(map(str, name)) if isinstance(name, tuple) else (str(name),) for name in names]


ZIP: Final = b"PK\x03\x04"
NPY: Final = b"\x93NUMPY"
"""First letters of a single array, ``.npy``."""


def members(path: Path) -> set[str]:
    """Return the names of the arrays in a file, {} when it is no zip file or damaged."""
    return {name.removesuffix(".npy") for name in zip_names(path) if name.endswith(".npy")}


def zip_names(path: Path) -> set[str]:
    """Return the names in a zip file, {} when it is none or damaged."""
    try:
        with zipfile.ZipFile(path) as file:
            return set(file.namelist())
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError):
        return set()


def refuse_huge_zip(path: Path) -> None:
    """Refuse a zip file that declares more than a file of its size can hold."""
    with zipfile.ZipFile(path) as file:
        refuse_huge(sum(entry.file_size for entry in file.infolist()), path)


@contextmanager
def opened_npz(path: Path) -> Iterator[Mapping[str, npt.NDArray[Any]]]:
    """Open a file of arrays, which are read when they are asked for; pickles are refused.

    Raises
    ------
    FormatError
        When it is none, is damaged, or declares more than it can hold.
    """
    with damaged_as("as NumPy's .npz", path):
        refuse_huge_zip(path)
        with np.load(path, allow_pickle=False) as arrays:
            yield arrays


_PUTS: Final = frozenset({"PUT", "BINPUT", "LONG_BINPUT"})
_DAMAGED: Final = (
    *(pickle.UnpicklingError, EOFError, ValueError, TypeError, AttributeError, KeyError),
    *(IndexError, OverflowError, UnicodeError, RecursionError, MemoryError, ImportError),
)
_KINDS: Final = frozenset("biufcSU")
"""Types of values: numbers and texts."""


class PickledType:
    """Type of an array's values, as a pickle describes it."""

    def __init__(self, code: object, *_: object) -> None:
        self.code = str(code)
        self.order = "|"

    def __setstate__(self, state: object) -> None:
        """Take the byte order of the description, and nothing else."""
        if isinstance(state, tuple) and len(state) > 1 and str(state[1]) in "<>|=":
            self.order = str(state[1])

    def numpy(self) -> np.dtype[Any]:
        """Return the type of numbers or texts, or raise `ValueError` for any other."""
        if self.code[:1] not in _KINDS or not (self.code[1:] or "1").isdecimal():
            raise ValueError(f"values of type '{self.code}'")
        return np.dtype(self.order + self.code)


class PickledArray:
    """A NumPy array of a pickle, made only when it is asked for."""

    def __init__(self, *_: object) -> None:
        self._state: tuple[Any, ...] = ()

    def __setstate__(self, state: object) -> None:
        """Keep the shape, type and values."""
        if not isinstance(state, tuple) or len(state) != 5:
            raise ValueError("an array without shape, type and values")
        self._state = state

    def objects(self) -> list[Any]:
        """Return the values of an array of objects."""
        values = self._state[4] if self._state else None
        return values if isinstance(values, list) else []

    def values(self) -> npt.NDArray[Any]:
        """Return the array of numbers or texts, or raise `ValueError` when it is none."""
        if not self._state:
            raise ValueError("an array without values")
        _, shape, kind, by_columns, content = self._state
        if not isinstance(kind, PickledType) or not isinstance(shape, tuple):
            raise ValueError("an array without a shape and a type")
        data = content if isinstance(content, bytes) else bytes(0)
        return np.frombuffer(data, dtype=kind.numpy()).reshape(
            shape, order="F" if by_columns is True else "C"
        )


class _Function:
    """A function for the names of a pickle, whose parts the pickle cannot change."""

    __slots__ = ("_function",)

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def __call__(self, *arguments: object) -> Any:
        return self._function(*arguments)

    def __setstate__(self, state: object) -> None:
        raise ValueError("a function that is given a state")


def _encode(text: object, encoding: object) -> bytes:
    """Return bytes that protocol 2 of pickle writes as a text."""
    if not isinstance(text, str) or encoding != "latin1":
        raise ValueError("bytes in an unknown encoding")
    return text.encode("latin1")


def _number(kind: object, content: object = b"") -> Any:
    """Return a number of NumPy."""
    if not isinstance(kind, PickledType) or not isinstance(content, bytes):
        raise ValueError("a number without its type")
    return np.frombuffer(content, dtype=kind.numpy())[0].item()


def _from_buffer(content: object, kind: object, shape: object, order: object) -> PickledArray:
    """Return an array as protocol 5 of pickle has it."""
    if not isinstance(content, bytes | bytearray) or order not in ("C", "F"):
        raise ValueError("an array without values")
    array = PickledArray()
    array.__setstate__((1, shape, kind, order == "F", bytes(content)))
    return array


_CORES: Final = ("core", "_core")
_ARRAYS: Final = tuple(f"numpy.{core}.multiarray" for core in _CORES)
_NAMES: Final[dict[tuple[str, str], Callable[..., Any]]] = {
    ("numpy", "ndarray"): PickledArray,
    ("numpy", "dtype"): PickledType,
    ("_codecs", "encode"): _Function(_encode),
    **{(f"numpy.{core}.numeric", "_frombuffer"): _Function(_from_buffer) for core in _CORES},
    **{(module, "_reconstruct"): PickledArray for module in _ARRAYS},
    **{(module, "scalar"): _Function(_number) for module in _ARRAYS},
}


class _Plain(pickle.Unpickler):
    """Knows no names but those of arrays."""

    def find_class(self, module: str, name: str, /) -> Any:
        """Return the function of this module for a name, or refuse it."""
        if (module, name) not in _NAMES:
            raise _ForbiddenError(f"{module}.{name}")
        return _NAMES[module, name]


class _ForbiddenError(Exception):
    """A pickle asks for something that is no plain data."""


def unpickle(content: bytes, *, where: str) -> Any:
    """Return the plain data of a pickle; arrays come as `PickledArray`.

    Parameters
    ----------
    content : bytes
        The pickle.
    where : str
        What it is, for the message.

    Raises
    ------
    FormatError
        When it is damaged, or asks for anything but plain data: the message names it.

    Examples
    --------
    >>> unpickle(pickle.dumps({"a": [1, (2.5, None)]}), where="a pickle")
    {'a': [1, (2.5, None)]}
    """
    try:
        _refuse_far_places(content)
        return _Plain(io.BytesIO(content)).load()
    except _ForbiddenError as error:
        raise FormatError(
            f"{where} is a pickle that asks for {error}, which is no plain data and could run a "
            "program: it is not read; save the recording in another format (HDF5 or CSV)"
        ) from error
    except _DAMAGED as error:
        raise FormatError(f"{where} is a damaged pickle: {error}") from error


def _refuse_far_places(content: bytes) -> None:
    """Refuse a place in the reader's table that is far beyond the pickle's contents.

    The reader clears a table as long as the highest number, 64 GB for six bytes of a file.
    """
    for count, (instruction, argument, _) in enumerate(pickletools.genops(content), start=1):
        if instruction.name in _PUTS and int(str(argument)) > 4 * count:
            raise ValueError("a place far beyond its contents")
