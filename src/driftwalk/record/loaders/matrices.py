"""One matrix per coordinate: files of x, y and theta with a row per frame and a column per body."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import read_header


class MatricesLoader:
    """Metres and radians unless another unit is given; the frame rate has to be given."""

    name = "matrices"
    description = "one matrix per coordinate (`x`, `y` and, if there is one, `theta`); metres"

    def sniff(self, _head: bytes, _path: Path) -> float:
        """Never claim a file: `x` and `y` choose this format."""
        return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the matrices; names are relative to the recording's folder."""
        folder = path if path.is_dir() else path.parent
        x_file = options.x or (None if path.is_dir() else path)
        if x_file is None or options.y is None:
            raise InputError(
                "one matrix per coordinate needs `x` and `y` (and `theta` if there is)"
            )
        x, names = _matrix(_place(x_file, folder))
        y, _ = _matrix(_place(options.y, folder))
        theta = None if options.theta is None else _matrix(_place(options.theta, folder))[0]
        for name, values in (("y", y), ("theta", theta)):
            if values is not None and [v.size for v in values] != [v.size for v in x]:
                raise InputError(
                    f"the matrices disagree: `x` has {x[0].size} rows and {len(x)} columns, "
                    f"`{name}` has {values[0].size} rows and {len(values)} columns"
                )
        frame = np.arange(x[0].size, dtype=np.float64)
        bodies = [
            RawBody(name, frame, x[i], y[i], None if theta is None else theta[i])
            for i, name in enumerate(names)
        ]
        return RawRecording(bodies, bare_length_is_si=True, rows=int(frame.size))


def _place(name: Path, folder: Path) -> Path:
    """Return the file in the recording's folder, or the path as given if there is none."""
    beside = folder / name
    path = beside if beside.exists() else name
    if not path.is_file():
        raise FormatError("there is no such file", path=path)
    return path


def _matrix(path: Path) -> tuple[list[Array], list[str]]:
    """Return the columns of a matrix and their names."""
    names, delimiter, skip, has_header = read_header(path)
    labels = names if has_header else [str(index) for index in range(len(names))]
    table = read_table(path, TableLayout(delimiter, labels, skip, tuple(range(len(names)))))
    return [table.numbers[column] for column in range(len(names))], labels


LOADER = MatricesLoader()
