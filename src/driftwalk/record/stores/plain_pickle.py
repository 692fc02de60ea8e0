"""Pickles that hold plain data only: nothing in them is executed.

A pickle is a program, and it may call any function by name. The few names that NumPy's arrays need
are answered by functions of this module, and `find_class` refuses every other one.
"""

from __future__ import annotations

import io
import pickle
import pickletools
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError

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
