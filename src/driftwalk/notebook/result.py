"""A dataset that shows its answer first when a notebook prints it."""

from __future__ import annotations

from html import escape

import xarray as xr

from driftwalk.schema.runs import answer_of


class Result(xr.Dataset):  # type: ignore[no-untyped-call]
    """A fit, a calibration or a comparison: an `xarray.Dataset` whose text begins with the answer.

    Everything else is as in any dataset, and it is stored as one.

    Examples
    --------
    >>> answer = {"estimate": ("parameter", [2.0]), "interval": (("parameter", "bound"), [[1, 3]])}
    >>> names = {"parameter": ["speed"], "unit": ("parameter", ["m/s"])}
    >>> print(str(Result(answer, names)).splitlines()[0])
    speed  2 m/s  [1, 3]
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return "\n".join([*answer_of(self), super().__repr__()])

    def _repr_html_(self) -> str:
        lines = answer_of(self)
        head = f"<pre>{escape(chr(10).join(lines))}</pre>" if lines else ""
        return head + super()._repr_html_()


def as_result(dataset: xr.Dataset) -> Result:
    """Return the same dataset as a `Result`; it remembers the file that it was read from."""
    found = Result(dataset.data_vars, dataset.coords, dataset.attrs)
    found.encoding = dataset.encoding
    return found
