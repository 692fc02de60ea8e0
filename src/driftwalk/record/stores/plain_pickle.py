"""Pickles that hold plain data only: nothing in them is executed.

A pickle is a program, and it may call any function by name. So its instructions are looked through
first: only those that build dictionaries, lists, tuples, texts and numbers may stand in it. The few
names that NumPy's arrays need are answered by functions of this module, every other one is refused.
"""

from __future__ import annotations

import io
import pickle
import pickletools
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError

_TEXTS: Final = frozenset(
    {"STRING", "BINSTRING", "SHORT_BINSTRING", "UNICODE", "BINUNICODE", "SHORT_BINUNICODE"}
    | {"BINUNICODE8", "BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8"}
)
_NUMBERS: Final = frozenset(
    {"NONE", "NEWTRUE", "NEWFALSE", "INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1"}
    | {"LONG4", "FLOAT", "BINFLOAT"}
)
_CONTAINERS: Final = frozenset(
    {"EMPTY_TUPLE", "TUPLE", "TUPLE1", "TUPLE2", "TUPLE3", "EMPTY_LIST", "LIST", "APPEND"}
    | {"APPENDS", "EMPTY_DICT", "DICT", "SETITEM", "SETITEMS", "MARK", "POP", "POP_MARK", "DUP"}
)
_FRAMING: Final = frozenset({"PROTO", "FRAME", "STOP", "MEMOIZE", "GET", "BINGET", "LONG_BINGET"})
_ARRAY_PARTS: Final = frozenset({"GLOBAL", "STACK_GLOBAL", "REDUCE", "BUILD"})
_PUTS: Final = frozenset({"PUT", "BINPUT", "LONG_BINPUT"})
_INSTRUCTIONS: Final = _TEXTS | _NUMBERS | _CONTAINERS | _FRAMING | _ARRAY_PARTS | _PUTS
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
_KNOWN: Final[dict[tuple[str, str], Callable[..., Any]]] = {
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
        if (module, name) not in _KNOWN:
            raise _ForbiddenError(f"{module}.{name}")
        return _KNOWN[module, name]


class _ForbiddenError(Exception):
    """A pickle asks for something that is no plain data."""


def unpickle(content: bytes, *, where: str, path: Path) -> Any:
    """Return the plain data of a pickle; arrays come as `PickledArray`.

    Parameters
    ----------
    content : bytes
        The pickle.
    where : str
        What it is, for the message.
    path : Path
        The file, for the message.

    Raises
    ------
    FormatError
        When it is damaged, or asks for anything but plain data: the message names it.

    Examples
    --------
    >>> unpickle(pickle.dumps({"a": [1, (2.5, None)]}), where="a pickle", path=Path("a.npy"))
    {'a': [1, (2.5, None)]}
    """
    try:
        _look_through(content)
        return _Plain(io.BytesIO(content)).load()
    except _ForbiddenError as error:
        raise FormatError(
            f"{where} is a pickle that asks for {error}, which is no plain data and could run a "
            "program: it is not read; save the recording in another format (HDF5 or CSV)",
            path=path,
        ) from error
    except _DAMAGED as error:
        raise FormatError(f"{where} is a damaged pickle: {error}", path=path) from error


def _look_through(content: bytes) -> None:
    """Refuse instructions that do more than build plain data, before anything is built."""
    for count, (instruction, argument, _) in enumerate(pickletools.genops(content), start=1):
        if instruction.name not in _INSTRUCTIONS:
            raise _ForbiddenError(f"the instruction {instruction.name}")
        # The reader makes a table as long as the highest number that is asked for.
        if instruction.name in _PUTS and int(str(argument)) > 4 * count:
            raise ValueError("a place far beyond its contents")
        if instruction.name == "GLOBAL" and tuple(str(argument).split(" ", 1)) not in _KNOWN:
            raise _ForbiddenError(str(argument).replace(" ", "."))
