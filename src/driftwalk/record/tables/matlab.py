"""Variables of MATLAB files, of the old format and of the one that is HDF5, as tables.

Structs, vectors, matrices.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, damaged_as
from driftwalk.record.column_names import quantity_of
from driftwalk.record.containers import Hdf5Contents, opened_hdf5, text_of
from driftwalk.record.tables.in_memory import MemorySource, Values, objects
from driftwalk.schema.stores.matlab import HDF5_BASED, OLD, read_old, refuse_many

_CLASS: Final = "MATLAB_class"


@dataclass(frozen=True)
class Opaque:
    """An object that only MATLAB can read."""

    kind: str
    """Its class: table, timetable, datetime, string, ..."""


Value = npt.NDArray[Any] | str | list[Any] | Opaque | None
"""An array of numbers with two axes or more, a text, a list, or none of these: a cell array is a
list, and a struct one of the fields of each of its elements."""


def elements_of(value: Value) -> list[dict[str, Value]]:
    """Return the elements of a struct, [] of any other value."""
    struct = isinstance(value, list) and all(isinstance(one, dict) for one in value)
    return value if isinstance(value, list) and struct else []


@contextmanager
def matlab_variables_of(path: Path) -> Iterator[dict[str, Value]]:
    """Return the variables of a file by their names.

    Raises
    ------
    FormatError
        When it is no file of MATLAB's, is damaged, or declares more than it can hold.
    """
    with path.open("rb") as file:
        start = file.read(len(OLD))
    if start == HDF5_BASED:
        with opened_hdf5(path) as contents:
            names = [str(name) for name in contents.file if not str(name).startswith("#")]
            yield {name: _hdf5_value(contents, name) for name in names}
    elif start == OLD:
        with damaged_as("as a MATLAB file", path):
            content = read_old(path)
        yield {_own_name(value) or name: _old_value(value) for name, value in content.items()}
    else:
        raise FormatError("is no MATLAB file of version 5 or 7.3")


def _is_opaque(value: Any) -> bool:
    names = getattr(getattr(value, "dtype", None), "names", None)
    return names is not None and {"s0", "s1", "s2"} <= set(names)


def _own_name(value: Any) -> str:
    """Return the name that stands in an opaque object, ``""`` of any other value."""
    return text_of(value["s0"].ravel()[0]) if _is_opaque(value) else ""


def _old_value(value: Any) -> Value:
    """Return a value of scipy's in the form that both formats share."""
    if _is_opaque(value):
        return Opaque(text_of(value["s2"].ravel()[0]))
    if not isinstance(value, np.ndarray):
        return None
    if value.dtype.names is not None:
        refuse_many(value.size)
        fields = value.dtype.names
        return [{name: _old_value(one[name]) for name in fields} for one in value.ravel(order="F")]
    if value.dtype.kind == "O":
        refuse_many(value.size)
        return [_old_value(one) for one in value.ravel(order="F")]
    if value.dtype.kind == "U":
        return _texts([str(row) for row in value.ravel()])
    return value if value.dtype.kind in "fiub" else None


def _hdf5_value(contents: Hdf5Contents, name: str) -> Value:
    """Return an entry of an HDF5 file in the form that both formats share."""
    import h5py

    entry = contents.file[name]
    kind = text_of(entry.attrs.get(_CLASS, b""))
    if isinstance(entry, h5py.Group):
        return _hdf5_struct(contents, entry) if kind in ("struct", "") else Opaque(kind)
    if not isinstance(entry, h5py.Dataset):
        return None
    if "MATLAB_object_decode" in entry.attrs:
        return Opaque(kind)
    if "MATLAB_empty" in entry.attrs:
        return np.empty((0, 0))
    if entry.dtype.kind == "O":
        return [_hdf5_value(contents, one) for one in _referred(contents, entry)]
    if entry.dtype.kind not in "fiub":
        return None
    # Columns come first in MATLAB.
    values = contents.array(name).T
    if kind == "char":
        return _texts(["".join(map(chr, row)) for row in np.atleast_2d(values).tolist()])
    return values


def _texts(rows: list[str]) -> Value:
    """Return a matrix of letters as the text of its only row, or as one text a row."""
    texts: list[Any] = [row.strip() for row in rows]
    return texts if len(texts) > 1 else "".join(texts)


def _hdf5_struct(contents: Hdf5Contents, group: Any) -> Value:
    """Return a struct; of an array of them each field holds references to the elements' values."""
    import h5py

    many: dict[str, list[str]] = {}
    one: dict[str, Value] = {}
    for field in map(str, group):
        entry = group[field]
        kind = text_of(entry.attrs.get(_CLASS, b""))
        if isinstance(entry, h5py.Dataset) and entry.dtype.kind == "O" and kind != "cell":
            many[field] = _referred(contents, entry)
        else:
            one[field] = _hdf5_value(contents, str(entry.name))
    lengths = {len(names) for names in many.values()}
    if not many:
        return [one]
    if len(lengths) > 1:
        raise FormatError(f"'{group.name}' has fields of different lengths")
    return [
        {field: _hdf5_value(contents, names[at]) for field, names in many.items()}
        for at in range(lengths.pop())
    ]


def _referred(contents: Hdf5Contents, entry: Any) -> list[str]:
    """Return the names of the entries that a cell array refers to, in MATLAB's order."""
    refuse_many(entry.size)
    references = contents.array(str(entry.name)).T.ravel(order="F")
    return [str(contents.file[reference].name) for reference in references]


_BODY: Final = "body"
_SAVED: Final = {
    "datetime": "posixtime(t)",
    "duration": "seconds(t)",
    "string": "cellstr(s)",
    "categorical": "cellstr(c)",
}
_TABLES: Final = ("table", "timetable")


def matlab_tables(variables: dict[str, Value]) -> dict[str, MemorySource]:
    """Return what variables can be read as a table, by their names.

    Parameters
    ----------
    variables : dict
        Variables of a file.
    """
    tables = ((name, _table(value, f"'{name}'")) for name, value in variables.items())
    found = [("variables", _of_fields(variables, "the vectors")), *tables]
    return {name: table for name, table in found if table is not None}


def only_matlab(variables: dict[str, Value]) -> str:
    """Return what to do about variables that only MATLAB can read, ``""`` where there are none.

    Parameters
    ----------
    variables : dict
        Variables of a file.

    Examples
    --------
    >>> only_matlab({"T": Opaque("table")}).split(":")[0]
    "'T' is a MATLAB table, which only MATLAB can read"
    """
    inner = {
        f"{name}.{field}": one
        for name, value in variables.items()
        for field, one in next(iter(elements_of(value)), {}).items()
    }
    everything = [*variables.items(), *inner.items()]
    found = [(name, value.kind) for name, value in everything if isinstance(value, Opaque)]
    if not found:
        return ""
    name, kind = next((one for one in found if one[1] in _TABLES), found[0])
    what = f"'{name}' is a MATLAB {kind or 'object'}, which only MATLAB can read"
    if kind in _TABLES:
        change = "timetable2table(T)" if kind == "timetable" else "T"
        return (
            f"{what}: save it by writetable({change}, 'file.csv'), or as "
            f"S = table2struct({change}, 'ToScalar', true)"
        )
    return f"{what}: save {_SAVED.get(kind, 'it as numbers')} in its place"


def _table(value: Value, what: str) -> MemorySource | None:
    """Return a variable that holds a table by itself, None of any other."""
    if elements := elements_of(value):
        single = len(elements) == 1
        return _of_fields(elements[0], what) if single else _of_elements(elements, what)
    if isinstance(value, np.ndarray) and value.ndim == 2 and min(value.shape) > 1:
        # There are more samples than quantities, whichever way they lie.
        rows = value if value.shape[0] >= value.shape[1] else value.T
        _refuse_wide(rows.shape[1], what)
        return MemorySource(what, [""] * rows.shape[1], [*rows.T], has_header=False)
    return None


def _of_fields(fields: dict[str, Value], what: str) -> MemorySource | None:
    """Return fields of one length as columns, a matrix as a column for each body."""
    rows = _row_count(fields)
    if rows is None:
        return None
    names: list[str] = []
    columns: list[Values] = []
    matrices = False
    for name, value in fields.items():
        several = isinstance(value, np.ndarray) and min(value.shape) > 1
        if several and quantity_of(name) not in ("x", "y", "z", "theta"):
            continue  # no other quantity is one of several bodies
        for number, column in enumerate(_columns(value, rows), start=1):
            # The number follows the quantity, before a unit.
            names.append(re.sub(r"^([A-Za-z]+)", rf"\g<1>{number}", name) if several else name)
            columns.append(column)
            matrices |= several
        _refuse_wide(len(columns), what)
    counts = np.asarray(fields.get("ntargets", [])).ravel()
    if counts.size and counts.dtype.kind in "fiu" and counts.sum() == rows:
        # As Ctrax has it: bodies frame after frame, and how many there are in each.
        names.append("frame")
        columns.append(np.repeat(np.arange(counts.size), counts.astype(np.int64)))
    return MemorySource(what, names, columns, matrices=matrices) if columns else None


def _row_count(fields: dict[str, Value]) -> int | None:
    """Return how many samples fields have: as many as x has, else as most of them have."""
    lengths = {
        name: max(value.shape) if isinstance(value, np.ndarray) else len(value)
        for name, value in fields.items()
        if (isinstance(value, np.ndarray) and value.ndim == 2 and value.size)
        or (isinstance(value, list) and not elements_of(value))
    }
    of_x, of_t = (
        [length for name, length in lengths.items() if quantity_of(name) == wanted]
        for wanted in ("x", "t")
    )
    if of_x:
        return (of_t or of_x)[0]
    common = Counter(length for length in lengths.values() if length > 1).most_common(1)
    return common[0][0] if common else None


def _columns(value: Value, rows: int) -> list[Values]:
    """Return the columns of a value that has a value for each row, [] of any other."""
    if isinstance(value, list):
        texts = len(value) == rows and all(isinstance(one, str) for one in value)
        return [objects(value)] if texts else []
    if not isinstance(value, np.ndarray) or value.ndim != 2:
        return []
    if rows not in (value.shape if min(value.shape) > 1 else (value.size,)):
        return []
    return [*(value.T if value.shape[0] == rows else value)]


def _of_elements(elements: list[dict[str, Value]], what: str) -> MemorySource | None:
    """Return an array of structs as a table: a row each, or the rows of a body each."""
    if all(_is_single(value) for element in elements for value in element.values()):
        names = list(elements[0])
        columns = [objects([_single(one.get(name)) for one in elements]) for name in names]
        return MemorySource(what, names, columns)
    parts = [_of_fields(element, what) for element in elements]
    known = [(at, part) for at, part in enumerate(parts, start=1) if part is not None]
    if not known:
        return None
    names = [name for name in known[0][1].names if all(name in part.names for _, part in known)]
    bodies = [
        np.full(part.rows, _body_name(elements[at - 1]) or str(at), dtype=object)
        for at, part in known
    ]
    columns = [
        np.concatenate([part.columns[part.names.index(name)] for _, part in known])
        for name in names
    ]
    return MemorySource(what, [*names, _BODY], [*columns, np.concatenate(bodies)])


def _is_single(value: Value) -> bool:
    return not isinstance(value, list) and getattr(value, "size", 1) <= 1


def _single(value: Value) -> Any:
    """Return the one number or text of a field, None where it is empty."""
    if isinstance(value, np.ndarray):
        return value.ravel()[0].item() if value.size else None
    return value if isinstance(value, str) else None


def _body_name(element: dict[str, Value]) -> str:
    """Return the name of a body, where a field holds it."""
    for name, value in element.items():
        single = _single(value) if quantity_of(name) == _BODY and _is_single(value) else None
        if single is not None:
            return f"{single:g}" if isinstance(single, float) else str(single)
    return ""


def _refuse_wide(count: int, what: str) -> None:
    most = 20_000
    if count > most:
        raise FormatError(f"{what} has {count} columns, more than the {most} that are read")
